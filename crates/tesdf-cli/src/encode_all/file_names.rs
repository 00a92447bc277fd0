//! File names for assets that have names of their own.
use std::collections::HashSet;

/// Longest name in bytes, without the extension. File systems allow 255.
const MAX_BYTES: usize = 100;

/// Names that Windows keeps for devices, in lower case.
const DEVICES: [&str; 4] = ["con", "prn", "aux", "nul"];

/// File names `NAME.tesdf`, one for each of `names`, such that no two are equal on a file system
/// that does not tell upper from lower case. An empty name becomes `fallback`.
pub(crate) fn unique<'a>(names: impl Iterator<Item = &'a str>, fallback: &str) -> Vec<String> {
    let mut taken = HashSet::new();
    names
        .map(|name| {
            let safe = Some(safe(name)).filter(|name| !name.is_empty()).unwrap_or_else(|| safe(fallback));
            let safe = if safe.is_empty() { "part".to_owned() } else { safe };
            let numbered = (2..).map(|n| format!("{safe}-{n}"));
            let free =
                std::iter::once(safe.clone()).chain(numbered).find(|name| taken.insert(name.to_lowercase()));
            format!("{}.tesdf", free.unwrap_or(safe))
        })
        .collect()
}

/// The name with `_` in place of characters that are not letters, digits, `.`, `-` or `_`.
fn safe(name: &str) -> String {
    let allowed = |c: char| if c.is_alphanumeric() || matches!(c, '.' | '-' | '_') { c } else { '_' };
    let name: String = name.chars().map(allowed).collect();
    let mut name = name.trim_matches(['.', '_', ' ']).to_owned();
    while name.len() > MAX_BYTES {
        name.pop();
    }
    let stem = name.split('.').next().unwrap_or_default().to_lowercase();
    let is_port = stem.len() == 4 && (stem.starts_with("com") || stem.starts_with("lpt"));
    if DEVICES.contains(&stem.as_str()) || is_port { format!("{name}_") } else { name }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_safe_and_unique() {
        let long = "x".repeat(300);
        let names =
            ["wheel", "Wheel", "wheel", "a/b\\c:d", "..", "", "räder", "NUL", "com1.x", &long, "wheel-2"];
        let found = unique(names.into_iter(), "machine.3mf");
        assert_eq!(
            found[..8].join(" "),
            "wheel.tesdf Wheel-2.tesdf wheel-3.tesdf a_b_c_d.tesdf machine.3mf.tesdf machine.3mf-2.tesdf räder.tesdf NUL_.tesdf"
        );
        assert_eq!(found[8], "com1.x_.tesdf");
        assert_eq!(found[9].len(), MAX_BYTES + 6);
        assert_eq!(found[10], "wheel-2-2.tesdf");
    }
}
