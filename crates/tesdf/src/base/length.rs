use std::fmt;

use serde::{Deserialize, Serialize};

/// A length, given as a share of the diagonal of the mesh or in the unit of the mesh.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Length {
    /// Share of the diagonal of the bounds of the mesh.
    OfDiagonal(f64),
    /// Length in the unit of the mesh.
    Absolute(f64),
}

/// With four significant digits: `5 % of the diagonal`, `0.25`, `1.235e5`. The unit of the mesh is
/// not known here.
impl fmt::Display for Length {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::OfDiagonal(share) => write!(f, "{} % of the diagonal", four_digits(100.0 * share)),
            Self::Absolute(length) => f.write_str(&four_digits(*length)),
        }
    }
}

/// A number with four significant digits, and with an exponent if it is below 0.001 or at least
/// 10,000.
pub(crate) fn four_digits(value: f64) -> String {
    let rounded = format!("{value:.3e}").parse().unwrap_or(value);
    if value == 0.0 || (1e-3..1e4).contains(&rounded.abs()) {
        format!("{rounded}")
    } else {
        format!("{rounded:e}")
    }
}

impl Length {
    /// The length in the unit of `diagonal`.
    pub fn resolve(self, diagonal: f64) -> f64 {
        match self {
            Self::OfDiagonal(share) => share * diagonal,
            Self::Absolute(length) => length,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lengths_are_printed_with_four_digits() {
        let printed = [0.0, -1.0, 0.25, 1.0 / 3.0, 12.0, 9999.6, 123456.0, 1e300, 1e-9, f64::INFINITY]
            .map(|length| Length::Absolute(length).to_string());
        assert_eq!(printed, ["0", "-1", "0.25", "0.3333", "12", "1e4", "1.235e5", "1e300", "1e-9", "inf"]);
        assert_eq!(Length::OfDiagonal(0.07).to_string(), "7 % of the diagonal");
    }
}
