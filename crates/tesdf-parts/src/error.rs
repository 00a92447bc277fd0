use std::fmt;

use tesdf::mesh::{MeshError, NotSolid};

/// Why a part cannot be made.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum PartError {
    /// A thread size that is not in the table.
    #[error("{found} is not in the table of sizes; expected one of {known}")]
    UnknownSize {
        /// The size found.
        found: String,
        /// The sizes of the table.
        known: String,
    },
    /// A parameter with an impossible value.
    #[error("the {name} is {found}; expected {expected}")]
    Parameter {
        /// The parameter.
        name: &'static str,
        /// Its value.
        found: String,
        /// The values that are possible, and what limits them.
        expected: String,
    },
    /// The outlines of a flat face cross or touch each other.
    #[error("the outlines of a flat face of the {part} cross or touch each other; change its dimensions")]
    Outlines {
        /// The part.
        part: &'static str,
    },
    /// The surface of the part would pass through itself.
    #[error("the surface of the {part} would touch or pass through itself: {defect}; change its dimensions")]
    Overlap {
        /// The part.
        part: &'static str,
        /// The first defect.
        defect: String,
    },
    /// The part would have more faces than a `.tesdf` file can have.
    #[error(
        "the {part} would have about {faces:.0} faces, and a .tesdf file has at most {limit}; choose fewer segments or a larger deviation"
    )]
    TooFine {
        /// The part.
        part: &'static str,
        /// Number of faces, about.
        faces: f64,
        /// The largest number of faces.
        limit: f64,
    },
    /// The part is no mesh: a coordinate is not finite.
    #[error("the {part}: {source}")]
    Mesh {
        /// The part.
        part: &'static str,
        /// What is wrong.
        source: MeshError,
    },
    /// The coordinates of the part are too small or too large.
    #[error("the {part}: {source}")]
    NotSolid {
        /// The part.
        part: &'static str,
        /// All defects.
        source: NotSolid,
    },
}

/// A length in metres, printed in millimetres with at most six decimals.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Mm(pub f64);

impl fmt::Display for Mm {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let text = format!("{:.6}", self.0 * 1e3);
        let text = text.trim_end_matches('0').trim_end_matches('.');
        write!(f, "{} mm", if text == "-0" { "0" } else { text })
    }
}

/// The error of a length.
pub(crate) fn wrong(name: &'static str, found: f64, expected: impl fmt::Display) -> PartError {
    PartError::Parameter { name, found: Mm(found).to_string(), expected: expected.to_string() }
}

/// Checks that a length is more than 0.
pub(crate) fn positive(name: &'static str, found: f64) -> Result<(), PartError> {
    above(name, found, 0.0, "")
}

/// Checks that a length is 0 or more.
pub(crate) fn not_negative(name: &'static str, found: f64) -> Result<(), PartError> {
    match found >= 0.0 && found.is_finite() {
        true => Ok(()),
        false => Err(wrong(name, found, "at least 0 mm")),
    }
}

/// Checks that a length is more than a limit. `what` says what the limit is, after a comma.
pub(crate) fn above(name: &'static str, found: f64, limit: f64, what: &str) -> Result<(), PartError> {
    match found > limit && found.is_finite() {
        true => Ok(()),
        false => Err(wrong(name, found, format!("more than {}{what}", Mm(limit)))),
    }
}

/// Checks that a length is less than a limit. `what` says what the limit is, after a comma.
pub(crate) fn below(name: &'static str, found: f64, limit: f64, what: &str) -> Result<(), PartError> {
    match found < limit && found.is_finite() {
        true => Ok(()),
        false => Err(wrong(name, found, format!("less than {}{what}", Mm(limit)))),
    }
}

/// Checks a number of things.
pub(crate) fn count(
    name: &'static str,
    found: usize,
    range: std::ops::RangeInclusive<usize>,
) -> Result<(), PartError> {
    match range.contains(&found) {
        true => Ok(()),
        false => Err(PartError::Parameter {
            name,
            found: found.to_string(),
            expected: format!("{} to {}", range.start(), range.end()),
        }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lengths_are_printed_in_millimetres() {
        assert_eq!(
            [0.016, 25e-6, -0.0, 1e-12, 1.0 / 3e3].map(|x| Mm(x).to_string()),
            ["16 mm", "0.025 mm", "0 mm", "0 mm", "0.333333 mm"]
        );
        let message = below("bore", 0.02, 0.01, ", the root diameter").unwrap_err().to_string();
        assert_eq!(message, "the bore is 20 mm; expected less than 10 mm, the root diameter");
        assert!(positive("width", f64::NAN).is_err() && not_negative("width", 0.0).is_ok());
    }
}
