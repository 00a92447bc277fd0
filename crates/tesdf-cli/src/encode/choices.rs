//! From arguments to the library's choices.
use clap::ValueEnum;
use tesdf::encode::{Deformation, EncodeChoices, Refinement, Threshold};
use tesdf::geometry::Aabb;

use super::Args;
use tesdf_terminal::parse;

/// Ways to find the closest faces of a tetrahedron.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum EncoderChoice {
    /// Proven: no face that can be closest is left out
    Certified,
    /// Faces that are closest at samples, as in the paper; between samples some may be missing
    Sampled,
}

/// Points on the curve of memory and speed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Preset {
    /// Fast queries
    Default,
    /// Quickest to encode
    Fast,
    /// Smallest
    Compact,
    /// The paper's encoder: sampled, 129 samples along an edge, tetrahedra as they are
    Paper,
    /// Sampled so that nothing is missing
    SampledSafe,
}

impl From<EncoderChoice> for tesdf::encode::MethodChoice {
    fn from(choice: EncoderChoice) -> Self {
        match choice {
            EncoderChoice::Certified => Self::Certified,
            EncoderChoice::Sampled => Self::Sampled,
        }
    }
}

impl From<Preset> for tesdf::encode::Preset {
    fn from(preset: Preset) -> Self {
        match preset {
            Preset::Default => Self::Default,
            Preset::Fast => Self::Fast,
            Preset::Compact => Self::Compact,
            Preset::Paper => Self::Paper,
            Preset::SampledSafe => Self::SampledSafe,
        }
    }
}

impl Args {
    /// What the library is asked for.
    pub fn choices(&self) -> EncodeChoices {
        let numbers = |r: &Aabb| [r.min.x, r.min.y, r.min.z, r.max.x, r.max.y, r.max.z];
        EncodeChoices {
            preset: self.preset.into(),
            domain: self.domain.clone(),
            method: self.encoder.map(Into::into),
            resolution: self.resolution,
            threshold: self.threshold,
            max_entries: self.e_max,
            deformation: if self.deformable { Deformation::Expected } else { Deformation::None },
            refinement: self.plain.then_some(Refinement::None),
            band: self.band,
            regions: self.regions.iter().map(numbers).collect(),
            unit: self.unit.clone(),
        }
    }
}

/// A length, or `safe`.
///
/// # Errors
/// Says what was found.
pub fn threshold(text: &str) -> Result<Threshold, String> {
    match text {
        "safe" => Ok(Threshold::CoveringRadius),
        _ => parse::length(text).map(Threshold::Absolute),
    }
}
