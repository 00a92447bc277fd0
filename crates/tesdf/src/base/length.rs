use serde::{Deserialize, Serialize};

/// A length: a share of the mesh's diagonal, or in the mesh's unit.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Length {
    /// Share of the diagonal of the mesh's bounds.
    OfDiagonal(f64),
    /// In the mesh's unit.
    Absolute(f64),
}

impl Length {
    /// In the unit of `diagonal`.
    pub fn resolve(self, diagonal: f64) -> f64 {
        match self {
            Self::OfDiagonal(share) => share * diagonal,
            Self::Absolute(length) => length,
        }
    }
}
