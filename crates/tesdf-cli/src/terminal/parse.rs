//! Parsers for the values of options.
use std::path::{Path, PathBuf};

use clap::builder::{PathBufValueParser, PossibleValue, PossibleValuesParser, TypedValueParser};
use tesdf::Length;
use tesdf::base::Named;
use tesdf::collide::{Motion, Pose, Velocity};
use tesdf::geometry::Aabb;
use tesdf::glam::{DQuat, DVec3};

/// Parses the name of a file that is read; `-` is the standard input.
pub fn input() -> impl TypedValueParser<Value = PathBuf> {
    PathBufValueParser::new().try_map(|path| stream(path, "/dev/stdin"))
}

/// Parses the name of a file that is written; `-` is the standard output.
pub fn output() -> impl TypedValueParser<Value = PathBuf> {
    PathBufValueParser::new().try_map(|path| stream(path, "/dev/stdout"))
}

/// The name of a stream in place of `-`.
///
/// # Errors
/// The system has no such names.
pub fn stream(path: PathBuf, name: &str) -> Result<PathBuf, String> {
    match path == Path::new("-") {
        true if cfg!(unix) => Ok(name.into()),
        true => {
            Err("standard input and output have no name on this system; expected the name of a file".into())
        }
        false => Ok(path),
    }
}

/// Parses the name of a mesh. It is not `-`, because the extension names the format.
pub fn mesh() -> impl TypedValueParser<Value = PathBuf> {
    file_but_not_a_stream(
        "the extension of the name is the format of the mesh; save it as a file first, such as part.stl",
    )
}

/// Parses the name of a scene. It is not `-`, because the scene names its files from its own folder.
pub fn scene() -> impl TypedValueParser<Value = PathBuf> {
    file_but_not_a_stream("a scene names its files from its own folder; save it as a file there first")
}

/// Parses the name of a folder. It is not `-`.
pub fn folder() -> impl TypedValueParser<Value = PathBuf> {
    file_but_not_a_stream("expected the name of a folder; ./- is one of this name")
}

fn file_but_not_a_stream(reason: &'static str) -> impl TypedValueParser<Value = PathBuf> {
    PathBufValueParser::new().try_map(move |path| match path == Path::new("-") {
        true => Err(reason),
        false => Ok(path),
    })
}

/// Parses a finite number.
///
/// # Errors
/// The message says what was found.
pub fn number(text: &str) -> Result<f64, String> {
    match text.trim().parse::<f64>() {
        Ok(value) if value.is_finite() => Ok(value),
        Ok(value) => Err(format!("{value} is not a finite number")),
        Err(_) => Err("not a number".into()),
    }
}

/// Parses a length: a finite number that is not negative.
///
/// # Errors
/// The message says what was found.
pub fn length(text: &str) -> Result<f64, String> {
    number(text).and_then(|value| match value >= 0.0 {
        true => Ok(value),
        false => Err(format!("{} is negative; expected a length", Length::Absolute(value))),
    })
}

/// The units of [`metres`], by their names, and their length in metres. Longer names come first.
const UNITS: [(&str, f64); 6] =
    [("nm", 1e-9), ("um", 1e-6), ("µm", 1e-6), ("mm", 1e-3), ("cm", 1e-2), ("m", 1.0)];

/// Parses a length with its unit, such as `16mm` or `25um`, in metres. Only 0 needs no unit.
///
/// # Errors
/// The message says what was found and expected.
pub fn metres(text: &str) -> Result<f64, String> {
    let text = text.trim();
    let Some((value, unit)) =
        UNITS.into_iter().find_map(|(name, unit)| Some((text.strip_suffix(name)?, unit)))
    else {
        return match length(text) {
            Ok(0.0) => Ok(0.0),
            _ => Err("expected a length with its unit (nm, um, mm, cm or m), such as 16mm".into()),
        };
    };
    // Division by a power of ten gives the nearest number: 25um is 2.5e-5, as written.
    Ok(length(value)? / (1.0 / unit).round())
}

/// Parses `N` lengths with units, separated by spaces or commas. `expected` describes them in error
/// messages.
///
/// # Errors
/// The message says how many lengths were found, or which one is at fault.
pub fn all_metres<const N: usize>(words: &[&str], expected: &str) -> Result<[f64; N], String> {
    let words: [&str; N] =
        words.try_into().map_err(|_| format!("{} lengths; expected {expected}", words.len()))?;
    let mut values = [0.0; N];
    for (value, word) in values.iter_mut().zip(words) {
        *value = metres(word).map_err(|e| format!("{word}: {e}"))?;
    }
    Ok(values)
}

/// The words of a list, separated by spaces or commas.
pub fn words(text: &str) -> Vec<&str> {
    text.split(|c: char| c == ',' || c.is_whitespace()).filter(|w| !w.is_empty()).collect()
}

/// Parses a choice by its name. The help lists all names with their meanings.
pub fn named<T: Named>() -> impl TypedValueParser<Value = T> {
    let values = T::ALL.iter().map(|value| PossibleValue::new(value.name()).help(value.meaning()));
    // Only the names of `T` come here.
    PossibleValuesParser::new(values).try_map(|name| T::of_name(&name).ok_or_else(|| T::names("")))
}

/// Parses a number from 0 to 1.
///
/// # Errors
/// The message says what was found.
pub fn fraction(text: &str) -> Result<f64, String> {
    number(text).and_then(|value| match (0.0..=1.0).contains(&value) {
        true => Ok(value),
        false => Err(format!("{value} is not between 0 and 1")),
    })
}

/// Parses a box as `x0 y0 z0 x1 y1 z1`, separated by spaces or commas. The first corner is the
/// lower one.
///
/// # Errors
/// The message names the number at fault.
pub fn region(text: &str) -> Result<Aabb, String> {
    let values: [f64; 6] = numbers(text, "six, \"x0 y0 z0 x1 y1 z1\"")?;
    let [min, max] = [0, 3].map(|i| DVec3::new(values[i], values[i + 1], values[i + 2]));
    for (axis, (low, high)) in ["x", "y", "z"].into_iter().zip(min.to_array().into_iter().zip(max.to_array()))
    {
        if low >= high {
            let [low, high] = [low, high].map(Length::Absolute);
            return Err(format!("{axis}0 = {low} is not below {axis}1 = {high}"));
        }
    }
    Ok(Aabb { min, max })
}

/// Parses a pose as `tx ty tz qx qy qz qw`, separated by spaces or commas.
///
/// # Errors
/// The message names the number at fault, or says that the quaternion is not of unit length.
pub fn pose(text: &str) -> Result<Pose, String> {
    let [x, y, z, i, j, k, w] = numbers(text, "seven, \"tx ty tz qx qy qz qw\"")?;
    Pose::new(DVec3::new(x, y, z), DQuat::from_xyzw(i, j, k, w)).map_err(|e| e.to_string())
}

/// Parses a point as `x y z`.
///
/// # Errors
/// The same errors as [`numbers`].
pub fn point(text: &str) -> Result<DVec3, String> {
    numbers(text, "three, \"x y z\"").map(DVec3::from_array)
}

/// Parses the size of a picture in pixels as `WIDTHxHEIGHT`.
///
/// # Errors
/// The message says what was expected.
pub fn size(text: &str) -> Result<[u32; 2], String> {
    let sides = text.split_once('x').and_then(|(w, h)| Some([w.parse().ok()?, h.parse().ok()?]));
    sides.ok_or_else(|| "expected WIDTHxHEIGHT in pixels, such as 1200x800".into())
}

/// Parses a viewing direction as `azimuth elevation`, in degrees.
///
/// # Errors
/// The errors of [`numbers`], or an elevation outside of -90 to 90.
pub fn direction(text: &str) -> Result<[f64; 2], String> {
    let [azimuth, elevation] = numbers(text, "two, \"azimuth elevation\"")?;
    match (-90.0..=90.0).contains(&elevation) {
        true => Ok([azimuth, elevation]),
        false => Err(format!("elevation {elevation} is not between -90 and 90")),
    }
}

/// Parses a field of view, in degrees.
///
/// # Errors
/// The message says what was found.
pub fn field_of_view(text: &str) -> Result<f64, String> {
    number(text).and_then(|value| match (1.0..=150.0).contains(&value) {
        true => Ok(value),
        false => Err(format!("{value} is not between 1 and 150")),
    })
}

/// Parses a finite number greater than 0.
///
/// # Errors
/// The message says what was found.
pub fn factor(text: &str) -> Result<f64, String> {
    number(text).and_then(|value| match value > 0.0 {
        true => Ok(value),
        false => Err(format!("{value} is not greater than 0")),
    })
}

/// Parses a velocity as `vx vy vz wx wy wz`, separated by spaces or commas.
///
/// # Errors
/// The message names the number at fault.
pub fn velocity(text: &str) -> Result<Motion, String> {
    let [x, y, z, u, v, w] = numbers(text, "six, \"vx vy vz wx wy wz\"")?;
    let velocity = Velocity { linear: DVec3::new(x, y, z), angular: DVec3::new(u, v, w) };
    Ok(Motion::Linear { velocity })
}

/// Parses a screw motion as `px py pz ax ay az omega pitch`, separated by spaces or commas.
///
/// # Errors
/// The message names the number at fault, or says that the axis has no direction.
pub fn screw(text: &str) -> Result<Motion, String> {
    let [x, y, z, i, j, k, angular_speed, pitch] = numbers(text, "eight, \"px py pz ax ay az omega pitch\"")?;
    let axis = DVec3::new(i, j, k);
    match axis.try_normalize() {
        Some(_) => Ok(Motion::Screw { point: DVec3::new(x, y, z), axis, angular_speed, pitch }),
        None => Err(format!("axis {axis} has no direction; expected numbers that are not all 0")),
    }
}

/// Parses a face or vertex of a body as `PART` or `INSTANCE:PART`.
///
/// # Errors
/// The message says what was expected.
pub fn part(text: &str) -> Result<(u32, u32), String> {
    let (instance, part) = text.split_once(':').unwrap_or(("0", text));
    match (instance.trim().parse(), part.trim().parse()) {
        (Ok(instance @ 0..=1), Ok(part)) => Ok((instance, part)),
        _ => Err("expected a number of a face of instance 0, or INSTANCE:FACE with instance 0 or 1".into()),
    }
}

/// Parses `N` numbers, separated by spaces or commas. `expected` describes them in error messages.
///
/// # Errors
/// The message says how many numbers were found, or which one is at fault.
pub fn numbers<const N: usize>(text: &str, expected: &str) -> Result<[f64; N], String> {
    let words: [&str; N] =
        words(text).try_into().map_err(|w: Vec<_>| format!("{} numbers; expected {expected}", w.len()))?;
    let mut values = [0.0; N];
    for (value, word) in values.iter_mut().zip(words) {
        *value = number(word).map_err(|e| format!("{word}: {e}"))?;
    }
    Ok(values)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_of_options_are_checked() {
        assert_eq!(number(" -1e-3"), Ok(-1e-3));
        assert_eq!(number("inf"), Err("inf is not a finite number".into()));
        assert_eq!(length("-1"), Err("-1 is negative; expected a length".into()));
        assert_eq!(metres("25um"), Ok(25e-6));
        assert_eq!(metres(" 0.2 mm"), Ok(0.2e-3));
        assert_eq!(
            [metres("1.5m"), metres("3cm"), metres("10nm"), metres("0")].map(Result::unwrap),
            [1.5, 0.03, 1e-8, 0.0]
        );
        assert_eq!(metres("-1mm"), Err("-1 is negative; expected a length".into()));
        assert!(metres("16").unwrap_err().starts_with("expected a length with its unit"));
        assert!(metres("mm").is_err() && metres("infm").is_err());
        assert_eq!(all_metres(&words("1mm, 2mm"), "two"), Ok([1e-3, 2e-3]));
        assert_eq!(all_metres::<2>(&["1mm"], "two"), Err("1 lengths; expected two".into()));
        assert_eq!(fraction("1.5"), Err("1.5 is not between 0 and 1".into()));
        let expected = Aabb { min: DVec3::new(-1., -2., -3.), max: DVec3::new(1., 2., 3.) };
        assert_eq!(region("-1 -2,-3  1, 2 3"), Ok(expected));
        assert_eq!(region("1 2 3"), Err("3 numbers; expected six, \"x0 y0 z0 x1 y1 z1\"".into()));
        assert_eq!(region("0 0 a 1 1 1"), Err("a: not a number".into()));
        assert_eq!(size("30x20"), Ok([30, 20]));
        assert!(size("30").is_err() && size("30x-1").is_err());
        assert_eq!(direction("-30, 90"), Ok([-30.0, 90.0]));
        assert_eq!(direction("0 91"), Err("elevation 91 is not between -90 and 90".into()));
        assert_eq!(pose("1 2 -3 0 0 0 1"), Ok(Pose::at(DVec3::new(1.0, 2.0, -3.0))));
        assert!(pose("1 2 -3 0 0 0 2").unwrap_err().contains("of length 2"));
        assert_eq!(factor("0"), Err("0 is not greater than 0".into()));
        assert_eq!(field_of_view("180"), Err("180 is not between 1 and 150".into()));
        assert_eq!(region("0 2 0 1 1 1"), Err("y0 = 2 is not below y1 = 1".into()));
        let motion = Motion::Screw { point: DVec3::ZERO, axis: -DVec3::Z, angular_speed: 2.0, pitch: -0.5 };
        assert_eq!(screw("0 0 0, 0 0 -1, 2 -0.5"), Ok(motion));
        assert!(screw("0 0 0 0 0 0 1 1").is_err_and(|e| e.contains("no direction")));
        assert!(velocity("1 2 3").is_err_and(|e| e == "3 numbers; expected six, \"vx vy vz wx wy wz\""));
        assert_eq!((part("7"), part("1:7")), (Ok((0, 7)), Ok((1, 7))));
        assert!(part("2:7").is_err() && part("x").is_err());
    }
}
