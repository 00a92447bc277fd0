//! Converts arguments to the library's options.
use clap::ValueEnum;
use tesdf::encode::{Deformation, EncodeChoices, Refinement, Threshold};
use tesdf::geometry::Aabb;

use super::Args;
use tesdf_terminal::parse;

/// Methods that find the closest faces of a tetrahedron.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum EncoderChoice {
    /// Proven: no face that can be closest is missing
    Certified,
    /// Faces that are closest at samples, as in the paper; faces that are closest only between
    /// samples may be missing
    Sampled,
}

/// Trade-offs between memory, query speed and encoding time.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Preset {
    /// Fast queries
    Default,
    /// Fast encoding
    Fast,
    /// Small files
    Compact,
    /// Few cells, whose lists fill the 32 threads of a GPU that read them; for detection on a GPU
    Gpu,
    /// The paper's encoder: sampled, 129 samples along an edge, tetrahedra not bisected
    Paper,
    /// Sampled with a threshold that is large enough that no needed face is missing
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
            Preset::Gpu => Self::Gpu,
            Preset::Paper => Self::Paper,
            Preset::SampledSafe => Self::SampledSafe,
        }
    }
}

impl Args {
    /// The options for the library.
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

/// Parses a length, or `safe`.
///
/// # Errors
/// The message says what was found.
pub fn threshold(text: &str) -> Result<Threshold, String> {
    match text {
        "safe" => Ok(Threshold::CoveringRadius),
        _ => parse::length(text).map(Threshold::Absolute),
    }
}
