//! What a person chooses, by the names that commands and bindings give it: in go choices, out come options and a domain. Some choices
//! exclude others; one that would be without effect is an error.
use std::convert::Infallible;
use std::num::NonZeroU32;
use std::path::PathBuf;
use std::str::FromStr;

use super::{Deformation, EncodeOptions, Encoder, Preset, Refinement, Sampling, Threshold};
use crate::base::{Length, Progress};
use crate::domain::gmsh::{GmshError, GmshOptions, tetrahedralise_and_report};
use crate::domain::{ConformingError, ConformingMesh, ReadTetrahedraError, read_tetrahedra};
use crate::mesh::SolidMesh;

/// Ways to cut space into tetrahedra.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub enum DomainChoice {
    /// Cubes and their halves, finer near the surface; no other program is needed.
    #[default]
    Bisection,
    /// Gmsh, as a program of its own.
    Gmsh,
    /// A file of tetrahedra whose sides are the mesh's faces.
    File(PathBuf),
}

impl FromStr for DomainChoice {
    type Err = Infallible;

    /// `bisection`, `gmsh`, or a path.
    fn from_str(text: &str) -> Result<Self, Infallible> {
        Ok(match text {
            "bisection" => Self::Bisection,
            "gmsh" => Self::Gmsh,
            path => Self::File(path.into()),
        })
    }
}

/// Ways to find the closest faces of a tetrahedron.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum EncoderChoice {
    /// Proven: no face that can be closest is left out.
    Certified,
    /// Faces that are closest at samples, as in the paper.
    Sampled,
}

/// What a person may choose; `None` is what the preset says.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct EncodeChoices {
    /// What the others change.
    pub preset: Preset,
    /// How space is cut into tetrahedra.
    pub domain: DomainChoice,
    /// How the closest faces of each are found.
    pub encoder: Option<EncoderChoice>,
    /// Samples along an edge of a tetrahedron, less one; 32 unless the preset has its own.
    pub resolution: Option<u32>,
    /// How much farther than the closest face a listed one may be at a sample.
    pub threshold: Option<Threshold>,
    /// E_max: lists are cut to this many faces.
    pub max_entries: Option<NonZeroU32>,
    /// Whether the vertices will move.
    pub deformation: Deformation,
    /// What becomes of the tetrahedra of a conforming domain.
    pub refinement: Option<Refinement>,
    /// Width of the layer around the solid that is encoded too, in the mesh's unit.
    pub band: Option<f64>,
    /// Boxes that are encoded too, in the mesh's unit: `[min x y z, max x y z]`.
    pub regions: Vec<[f64; 6]>,
    /// Name of the mesh's unit; nothing is scaled.
    pub unit: Option<String>,
}

/// Choices that exclude each other.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum ChoiceError {
    /// A preset of the sampled encoder, with the other encoder.
    #[error("encoder `certified`: the preset is one of the encoder `sampled`; leave one of them out")]
    CertifiedPreset,
    /// Options of samples without samples.
    #[error(
        "resolution and threshold are of the encoder `sampled`, which was not chosen; choose it, or leave them out"
    )]
    NotSampled,
    /// A layer around tetrahedra that are given.
    #[error("band and region: the tetrahedra of the file are the domain; leave these options out")]
    BesidesFile,
    /// No bisections of a domain that is nothing but bisections.
    #[error(
        "plain: the bisection domain is nothing but bisections; choose the domain `gmsh` or a file of tetrahedra"
    )]
    PlainBisection,
}

/// Why there are no tetrahedra of the domain that was chosen.
#[derive(Debug, thiserror::Error)]
pub enum DomainError {
    /// Gmsh made none.
    #[error(transparent)]
    Gmsh(#[from] GmshError),
    /// The file cannot be read.
    #[error("{}{source}", prefix(path, source))]
    Read {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        source: ReadTetrahedraError,
    },
    /// The tetrahedra of the file are not of this solid.
    #[error("{}: {source}", path.display())]
    Conforming {
        /// The file.
        path: PathBuf,
        /// Where they do not conform.
        source: ConformingError,
    },
}

/// Samples along an edge, less one, unless asked for: the paper's 128 takes minutes on a processor.
const RESOLUTION: u32 = 32;

impl EncodeChoices {
    /// What the encoder is asked for.
    ///
    /// # Errors
    /// [`ChoiceError`]: choices that exclude each other.
    pub fn options(&self) -> Result<EncodeOptions, ChoiceError> {
        let of_preset = EncodeOptions::preset(self.preset);
        let encoder = match (self.encoder, of_preset.encoder) {
            (Some(EncoderChoice::Certified), Encoder::Sampled(_)) => {
                return Err(ChoiceError::CertifiedPreset);
            }
            (Some(EncoderChoice::Sampled), Encoder::Certified) => {
                Encoder::Sampled(Sampling { resolution: RESOLUTION, ..Sampling::PAPER })
            }
            (_, encoder) => encoder,
        };
        let encoder = match encoder {
            Encoder::Sampled(sampling) => Encoder::Sampled(Sampling {
                resolution: self.resolution.unwrap_or(sampling.resolution),
                threshold: self.threshold.unwrap_or(sampling.threshold),
                ..sampling
            }),
            Encoder::Certified if self.resolution.is_some() || self.threshold.is_some() => {
                return Err(ChoiceError::NotSampled);
            }
            Encoder::Certified => Encoder::Certified,
        };
        if matches!(self.domain, DomainChoice::File(_)) && (self.band.is_some() || !self.regions.is_empty()) {
            return Err(ChoiceError::BesidesFile);
        }
        let refinement = match (&self.domain, self.refinement) {
            (DomainChoice::Bisection, Some(Refinement::None)) => return Err(ChoiceError::PlainBisection),
            (DomainChoice::Bisection, _) => Refinement::ByCost,
            (_, chosen) => chosen.unwrap_or(of_preset.refinement),
        };
        Ok(EncodeOptions {
            encoder,
            refinement,
            deformation: self.deformation,
            max_entries: self.max_entries.map(Into::into),
            band: self.band.map_or(of_preset.band, Length::Absolute),
            regions: self.regions.clone(),
            unit: self.unit.clone(),
            ..of_preset
        })
    }

    /// The tetrahedra of a conforming domain; `None` for the bisection domain. Gmsh is ended when `progress` is cancelled.
    ///
    /// # Errors
    /// [`DomainError`]: the file cannot be read, Gmsh is not there or gives nothing valid, or the tetrahedra do not conform to the solid.
    pub fn tetrahedra(
        &self,
        solid: &SolidMesh,
        progress: &Progress,
    ) -> Result<Option<ConformingMesh>, DomainError> {
        match &self.domain {
            DomainChoice::Bisection => Ok(None),
            DomainChoice::Gmsh => {
                let options = GmshOptions {
                    band: self.band.map(Length::Absolute),
                    regions: self.regions.clone(),
                    ..GmshOptions::default()
                };
                Ok(Some(tetrahedralise_and_report(solid, &options, progress)?.mesh))
            }
            DomainChoice::File(path) => {
                let read = read_tetrahedra(path);
                let tetrahedra = read.map_err(|source| DomainError::Read { path: path.clone(), source })?;
                let conforming = ConformingMesh::new(solid, &tetrahedra);
                conforming.map(Some).map_err(|source| DomainError::Conforming { path: path.clone(), source })
            }
        }
    }
}

/// The file's name, where the error does not say it itself.
fn prefix(path: &std::path::Path, source: &ReadTetrahedraError) -> String {
    match source {
        ReadTetrahedraError::Open { .. } | ReadTetrahedraError::UnknownExtension { .. } => String::new(),
        _ => format!("{}: ", path.display()),
    }
}
