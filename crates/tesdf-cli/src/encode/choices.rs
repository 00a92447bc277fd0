//! From arguments to the library's options.
use std::convert::Infallible;
use std::path::PathBuf;
use std::str::FromStr;

use clap::ValueEnum;
use tesdf::domain::gmsh::{GmshOptions, tetrahedralise};
use tesdf::domain::{ConformingMesh, read_tetrahedra};
use tesdf::encode::{
    Deformation, EncodeOptions, Encoder, Length, Preset as LibraryPreset, Refinement, Sampling, Threshold,
};
use tesdf::geometry::Aabb;
use tesdf::mesh::SolidMesh;

use super::Args;
use crate::parse;
use crate::report::Failure;

/// Ways to cut space into tetrahedra.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum DomainChoice {
    /// Cubes and their halves, finer near the surface; no other program is needed.
    Bisection,
    /// Gmsh, as a program of its own.
    Gmsh,
    /// A file of tetrahedra.
    File(PathBuf),
}

impl FromStr for DomainChoice {
    type Err = Infallible;

    fn from_str(text: &str) -> Result<Self, Infallible> {
        Ok(match text {
            "bisection" => Self::Bisection,
            "gmsh" => Self::Gmsh,
            path => Self::File(path.into()),
        })
    }
}

impl DomainChoice {
    /// The tetrahedra of a conforming domain; `None` for the bisection domain.
    ///
    /// # Errors
    /// The file cannot be read, Gmsh is not there or gives nothing valid, or the tetrahedra do not conform to the solid.
    pub fn tetrahedra(&self, solid: &SolidMesh, args: &Args) -> Result<Option<ConformingMesh>, Failure> {
        match self {
            Self::Bisection => Ok(None),
            Self::Gmsh => {
                let options = GmshOptions {
                    band: args.band.map(Length::Absolute),
                    regions: args.regions.iter().map(numbers).collect(),
                    ..GmshOptions::default()
                };
                tetrahedralise(solid, &options).map(Some).map_err(Failure::new)
            }
            Self::File(path) => {
                let at = |e: &dyn std::fmt::Display| Failure::new(format!("{}: {e}", path.display()));
                let tetrahedra = read_tetrahedra(path).map_err(|e| at(&e))?;
                ConformingMesh::new(solid, &tetrahedra).map(Some).map_err(|e| at(&e))
            }
        }
    }
}

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

/// Samples along an edge, less one, unless asked for: the paper's 128 takes minutes on a processor.
const RESOLUTION: u32 = 32;

impl Args {
    /// What the library is asked for.
    ///
    /// # Errors
    /// Options that contradict each other.
    pub fn options(&self) -> Result<EncodeOptions, String> {
        let mut options = match self.preset {
            Preset::Default => EncodeOptions::preset(LibraryPreset::Default),
            Preset::Fast => EncodeOptions::preset(LibraryPreset::Fast),
            Preset::Compact => EncodeOptions::preset(LibraryPreset::Compact),
            Preset::Paper => EncodeOptions::PAPER,
            Preset::SampledSafe => EncodeOptions::SAMPLED_SAFE,
        };
        let of_preset = match options.encoder {
            Encoder::Sampled(sampling) => Some(sampling),
            Encoder::Certified => None,
        };
        let sampled = Sampling { resolution: RESOLUTION, ..Sampling::PAPER };
        let sampling = match (self.encoder, of_preset) {
            (Some(EncoderChoice::Certified), Some(_)) => {
                return Err(
                    "--encoder certified: the preset is one of the sampled encoder; leave one of them out"
                        .into(),
                );
            }
            (None, None) | (Some(EncoderChoice::Certified), None) => None,
            (Some(EncoderChoice::Sampled), None) => Some(sampled),
            (_, Some(sampling)) => Some(sampling),
        };
        match sampling {
            Some(of_preset) => {
                options.encoder = Encoder::Sampled(Sampling {
                    resolution: self.resolution.unwrap_or(of_preset.resolution),
                    threshold: self.threshold.unwrap_or(of_preset.threshold),
                    ..of_preset
                });
            }
            None if self.resolution.is_some() || self.threshold.is_some() => {
                return Err(
                    "--resolution and --threshold are of the sampled encoder; add --encoder sampled".into()
                );
            }
            None => {}
        }
        if let (DomainChoice::File(_), true) = (&self.domain, self.band.is_some() || !self.regions.is_empty())
        {
            return Err(
                "--band and --region: the tetrahedra of the file are the domain; leave these options out"
                    .into(),
            );
        }
        options.refinement = match (&self.domain, self.plain) {
            (DomainChoice::Bisection, true) => {
                return Err(
                    "--plain: the bisection domain is nothing but bisections; give --domain gmsh or a FILE"
                        .into(),
                );
            }
            (DomainChoice::Bisection, false) => Refinement::ByCost,
            (_, true) => Refinement::None,
            (_, false) => options.refinement,
        };
        if self.deformable {
            options.deformation = Deformation::Expected;
        }
        options.max_entries = self.e_max.map(Into::into);
        if let Some(band) = self.band {
            options.band = Length::Absolute(band);
        }
        options.regions = self.regions.iter().map(numbers).collect();
        options.unit.clone_from(&self.unit);
        Ok(options)
    }
}

fn numbers(r: &Aabb) -> [f64; 6] {
    [r.min.x, r.min.y, r.min.z, r.max.x, r.max.y, r.max.z]
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
