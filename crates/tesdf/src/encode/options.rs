use serde::{Deserialize, Serialize};

use crate::geometry::Aabb;

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

/// A named point on the curve of memory against speed. All are exact.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Preset {
    /// Few faces per query.
    Default,
    /// Quickest to encode; lists as they come.
    Fast,
    /// Smallest; more faces per query.
    Compact,
}

/// What to encode, and for how much memory. Every field is used.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct EncodeOptions {
    /// Width of the layer outside of the surface that belongs to the domain.
    pub band: Length,
    /// Further boxes that belong to the domain, in the mesh's unit: `[min x y z, max x y z]`.
    pub regions: Vec<[f64; 6]>,
    /// How many faces less per query near the surface one more byte per face of the mesh is worth.
    /// Smaller makes more cells with shorter lists.
    pub byte_worth: f64,
    /// Bisections below each cell that tell apart which faces it needs; 0 keeps the lists as they come.
    pub tighten_levels: u32,
    /// Name of the mesh's unit, for people; nothing is scaled.
    pub unit: Option<String>,
}

impl EncodeOptions {
    /// The options of a preset.
    pub fn preset(preset: Preset) -> Self {
        let (byte_worth, tighten_levels) = match preset {
            Preset::Default => (0.067, 12),
            Preset::Fast => (0.12, 2),
            Preset::Compact => (0.24, 11),
        };
        Self { band: Length::OfDiagonal(0.05), regions: Vec::new(), byte_worth, tighten_levels, unit: None }
    }

    /// The regions as boxes.
    pub fn region_boxes(&self) -> impl Iterator<Item = Aabb> {
        self.regions.iter().map(|&[a, b, c, d, e, f]| Aabb {
            min: glam::DVec3::new(a, b, c),
            max: glam::DVec3::new(d, e, f),
        })
    }
}

impl Default for EncodeOptions {
    fn default() -> Self {
        Self::preset(Preset::Default)
    }
}
