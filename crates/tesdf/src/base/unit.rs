//! Names of units of length, as people record them.

/// The length in metres of a unit, by its name or sign, such as `mm`, `millimetre` or `inches`.
/// `None` for an unknown name.
pub fn metres(name: &str) -> Option<f64> {
    let name = name.trim().to_lowercase();
    // `metres`, `meter` and `meters` become `metre`.
    let name = name.strip_suffix('s').unwrap_or(&name).replace("meter", "metre");
    Some(match name.as_str() {
        "nm" | "nanometre" => 1e-9,
        "um" | "µm" | "μm" | "micron" | "micrometre" => 1e-6,
        "mm" | "millimetre" => 1e-3,
        "cm" | "centimetre" => 1e-2,
        "dm" | "decimetre" => 1e-1,
        "m" | "metre" => 1.0,
        "km" | "kilometre" => 1e3,
        "mil" | "thou" => 2.54e-5,
        "in" | "inch" | "inche" | "\"" => 0.0254,
        "ft" | "foot" | "feet" | "'" => 0.3048,
        "yd" | "yard" => 0.9144,
        _ => return None,
    })
}

/// Whether two names stand for the same unit: units of the same length or, where a name is unknown,
/// the same name in any case.
pub fn is_same_unit(a: &str, b: &str) -> bool {
    match (metres(a), metres(b)) {
        (Some(a), Some(b)) => a == b,
        _ => a.trim().to_lowercase() == b.trim().to_lowercase(),
    }
}

/// A warning, if the user `chosen` another unit than that of the file.
pub fn conflict(of_file: Option<&str>, chosen: Option<&str>) -> Option<String> {
    let (of_file, chosen) = (of_file?, chosen?);
    (!is_same_unit(of_file, chosen)).then(|| {
        format!("the file is in {of_file}, but the unit {chosen} was given; {chosen} is recorded, and nothing is scaled")
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn another_unit_than_that_of_the_file_is_a_conflict() {
        assert_eq!(conflict(Some("in"), Some("Inches")), None);
        assert_eq!((conflict(None, Some("m")), conflict(Some("m"), None)), (None, None));
        assert!(conflict(Some("in"), Some("mm")).unwrap().contains("the file is in in"));
    }

    #[test]
    fn names_of_one_unit_are_the_same() {
        for names in [
            &["mm", " MM ", "millimetres", "Millimeter"][..],
            &["in", "inch", "Inches"],
            &["furlong", "Furlong "],
        ] {
            for (a, b) in names.iter().zip(names.iter().skip(1)) {
                assert!(is_same_unit(a, b), "{a} {b}");
            }
        }
        for (a, b) in [("mm", "m"), ("m", "metric"), ("furlong", "m"), ("mil", "mm"), ("", "m")] {
            assert!(!is_same_unit(a, b), "{a} {b}");
        }
        assert_eq!((metres("meters"), metres("µm"), metres("parsec")), (Some(1.0), Some(1e-6), None));
    }
}
