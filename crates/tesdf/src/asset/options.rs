use serde::{Deserialize, Serialize};

use crate::base::Length;
use crate::geometry::Aabb;

/// Options by one name: a point on the curve of memory against speed, or what the paper has.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Preset {
    /// Few faces per query.
    #[default]
    Default,
    /// Quickest to encode; lists as they come.
    Fast,
    /// Smallest; more faces per query.
    Compact,
    /// [`EncodeOptions::PAPER`]: the only one that is not exact.
    Paper,
    /// [`EncodeOptions::SAMPLED_SAFE`].
    SampledSafe,
}

/// Which faces a list names.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Method {
    /// Those that bounds cannot rule out: none is missing.
    #[default]
    Certified,
    /// Those closest at samples, Algorithm 1 of the paper.
    Sampled(Sampling),
}

/// How [`Method::Sampled`] samples.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Sampling {
    /// Q: samples have barycentric coordinates that are multiples of 1 / Q.
    pub resolution: u32,
    /// α: the cell is shrunk by this towards its centroid first.
    pub shrink: f64,
    /// ε: how much farther than the closest face a listed one may be at a sample.
    pub threshold: Threshold,
}

impl Sampling {
    /// That of the paper, Sec. VII-A.
    pub const PAPER: Self = Self { resolution: 128, shrink: 0.999, threshold: Threshold::Absolute(0.0) };
    /// So wide a threshold that nothing is missing: a face that is closest anywhere is within it at the nearest sample.
    pub const SAFE: Self = Self { resolution: 16, shrink: 1.0, threshold: Threshold::CoveringRadius };
}

/// How much farther than the closest face a listed one may be at a sample.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Threshold {
    /// In the mesh's unit.
    Absolute(f64),
    /// Twice the distance from which on every point of the cell has a sample.
    CoveringRadius,
}

/// What becomes of the tetrahedra of a conforming domain.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Refinement {
    /// They are bisected where shorter lists are worth the bytes.
    #[default]
    ByCost,
    /// Nothing: the plain form of the paper.
    None,
}

/// Whether the vertices will move.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Deformation {
    /// They will not.
    #[default]
    None,
    /// They will: lists of tetrahedra at the surface name all faces around their surface vertices (Sec. V-D).
    Expected,
}

/// What to encode, and for how much memory. Every field is used.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct EncodeOptions {
    /// Width of the layer outside of the surface that belongs to the bisection domain; a conforming domain is what its tetrahedra fill.
    pub band: Length,
    /// Further boxes that belong to the bisection domain, in the mesh's unit: `[min x y z, max x y z]`.
    pub regions: Vec<[f64; 6]>,
    /// How many faces less per query near the surface one more byte per face of the mesh is worth.
    /// Smaller makes more cells with shorter lists.
    pub byte_worth: f64,
    /// Bisections below each cell that tell apart which faces it needs; 0 keeps the lists as they come.
    pub tighten_levels: u32,
    /// Name of the mesh's unit, for people; nothing is scaled.
    pub unit: Option<String>,
    /// Which faces a list names.
    #[serde(default, rename = "encoder")]
    pub method: Method,
    /// E_max: longer lists are cut to the faces that are needed nearest to the surface (Sec. V-C).
    #[serde(default)]
    pub max_entries: Option<u32>,
    /// What becomes of the tetrahedra of a conforming domain.
    #[serde(default)]
    pub refinement: Refinement,
    /// Whether the vertices will move; only in a conforming domain.
    #[serde(default)]
    pub deformation: Deformation,
}

impl EncodeOptions {
    /// The encoder of the paper, on a conforming domain that is left as it is.
    pub const PAPER: Self = Self::sampled(Sampling::PAPER);
    /// The same with a threshold that lets nothing be missed.
    pub const SAMPLED_SAFE: Self = Self::sampled(Sampling::SAFE);

    const fn sampled(sampling: Sampling) -> Self {
        Self {
            band: Length::OfDiagonal(0.05),
            regions: Vec::new(),
            byte_worth: 0.067,
            tighten_levels: 0,
            unit: None,
            method: Method::Sampled(sampling),
            max_entries: None,
            refinement: Refinement::None,
            deformation: Deformation::None,
        }
    }

    /// The options of a preset.
    pub fn preset(preset: Preset) -> Self {
        let (byte_worth, tighten_levels) = match preset {
            Preset::Default => (0.067, 12),
            Preset::Fast => (0.12, 2),
            Preset::Compact => (0.24, 11),
            Preset::Paper => return Self::PAPER,
            Preset::SampledSafe => return Self::SAMPLED_SAFE,
        };
        Self {
            byte_worth,
            tighten_levels,
            method: Method::Certified,
            refinement: Refinement::ByCost,
            ..Self::PAPER
        }
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
