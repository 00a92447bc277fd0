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

impl Length {
    /// The length in the unit of `diagonal`.
    pub fn resolve(self, diagonal: f64) -> f64 {
        match self {
            Self::OfDiagonal(share) => share * diagonal,
            Self::Absolute(length) => length,
        }
    }
}
