//! The choices of a user, by the names that the commands and the bindings give them.
//!
//! Choices become options and a domain. Some choices exclude each other. A choice that would have
//! no effect is an error.
use std::convert::Infallible;
use std::num::NonZeroU32;
use std::path::PathBuf;
use std::str::FromStr;

use super::{Deformation, EncodeOptions, Method, Preset, Refinement, Sampling, Threshold};
use crate::base::{Inside, InsideRule, Length, Progress, SurfaceFaces};
#[cfg(feature = "gmsh")]
use crate::domain::gmsh::{GmshError, GmshOptions, tetrahedralise_and_report};
use crate::domain::{ConformingError, ConformingMesh, ReadTetrahedraError, read_tetrahedra};
use crate::mesh::SolidMesh;
use crate::named;

/// Ways to cut space into tetrahedra.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub enum DomainChoice {
    /// Cubes and their halves, finer near the surface. No other program is needed.
    #[default]
    Bisection,
    /// Gmsh, run as a separate program.
    Gmsh,
    /// A file of tetrahedra whose sides are the faces of the mesh.
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
    /// By proof: no face that can be closest is left out.
    Certified,
    /// By samples: the faces that are closest at samples, as in the paper.
    Sampled,
}

named!(EncoderChoice {
    Certified: "certified", "Proven: no face that can be closest is missing";
    Sampled: "sampled", "Faces that are closest at samples, as in the paper; faces that are closest only between samples may be missing";
});

/// Rules of what is inside, by the names that the commands give them. See [`InsideRule`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum InsideChoice {
    /// [`InsideRule::Winding`]
    #[default]
    Winding,
    /// [`InsideRule::Nonzero`]
    Nonzero,
    /// [`InsideRule::Odd`]
    Odd,
    /// [`InsideRule::Generalized`]
    Generalized,
    /// [`InsideRule::Sheet`], which needs a thickness.
    Sheet,
}

named!(InsideChoice {
    Winding: "winding", "A winding number of 1 or more; the mesh must be closed";
    Nonzero: "nonzero", "A winding number other than 0: takes shells that are inside out; the mesh must be closed";
    Odd: "odd", "An odd winding number: overlaps of two solids are outside; the mesh must be closed";
    Generalized: "generalized", "A generalised winding number of 1/2 or more in absolute value; for open meshes, whose distance jumps in the holes";
    Sheet: "sheet", "Nearer to a face than half of a thickness; for sheets, and any other faces";
});

/// What a user may choose. `None` stands for the value of the preset.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct EncodeChoices {
    /// The preset that the other choices change.
    pub preset: Preset,
    /// How space is cut into tetrahedra.
    pub domain: DomainChoice,
    /// How the closest faces of each tetrahedron are found.
    pub encoder: Option<EncoderChoice>,
    /// Samples along an edge of a tetrahedron, less one. The default is 32, unless the preset has
    /// its own value.
    pub resolution: Option<u32>,
    /// How much farther than the closest face a listed face may be at a sample.
    pub threshold: Option<Threshold>,
    /// E_max: longer lists are cut to this many faces.
    pub e_max: Option<NonZeroU32>,
    /// Whether the vertices will move.
    pub deformation: Deformation,
    /// How the tetrahedra of a conforming domain are refined.
    pub refinement: Option<Refinement>,
    /// Width of the layer around the solid that is encoded too, in the unit of the mesh.
    pub band: Option<f64>,
    /// Boxes that are encoded too, in the unit of the mesh: `[min x y z, max x y z]`.
    pub regions: Vec<[f64; 6]>,
    /// Name of the unit of the mesh. Nothing is scaled.
    pub unit: Option<String>,
    /// What is inside.
    pub inside: InsideChoice,
    /// The thickness of a sheet, in the unit of the mesh.
    pub thickness: Option<f64>,
    /// Which faces are the surface.
    pub surface: SurfaceFaces,
}

/// Choices that exclude each other.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum ChoiceError {
    /// A preset of the sampled encoder together with the certified encoder.
    #[error("encoder `certified`: the preset is one of the encoder `sampled`; leave one of them out")]
    CertifiedPreset,
    /// Options for samples together with an encoder that takes no samples.
    #[error(
        "resolution and threshold are of the encoder `sampled`, which was not chosen; choose it, or leave them out"
    )]
    NotSampled,
    /// A band or regions together with tetrahedra from a file.
    #[error("band and region: the tetrahedra of the file are the domain; leave these options out")]
    BesidesFile,
    /// No refinement together with the bisection domain, which consists of bisections.
    #[error(
        "plain: the bisection domain is nothing but bisections; choose the domain `gmsh` or a file of tetrahedra"
    )]
    PlainBisection,
    /// A sheet without a thickness.
    #[error("inside `sheet`: a sheet needs its thickness, in the unit of the mesh; give one")]
    NoThickness,
    /// A thickness of something that is not a sheet.
    #[error("thickness: only the faces of a sheet have one; choose inside `sheet`, or leave it out")]
    NotASheet,
    /// The boundary of a sheet.
    #[error("surface `boundary`: a sheet has no faces between inside and outside; leave it out")]
    BoundaryOfSheet,
}

/// Why the tetrahedra of the chosen domain could not be made.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum DomainError {
    /// The library was built without the feature that runs Gmsh.
    #[error("tesdf was built without the feature `gmsh`; build it with it, or give a file of tetrahedra")]
    NotBuilt,
    /// Gmsh gave no valid tetrahedra.
    #[cfg(feature = "gmsh")]
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
    /// The tetrahedra of the file do not conform to this solid.
    #[error("{}: {source}", path.display())]
    Conforming {
        /// The file.
        path: PathBuf,
        /// Where they do not conform.
        source: ConformingError,
    },
}

/// Samples along an edge, less one, unless the user asks for another number. The 128 of the paper
/// takes minutes on a processor.
const RESOLUTION: u32 = 32;

impl EncodeChoices {
    /// The options for the encoder.
    ///
    /// # Errors
    /// [`ChoiceError`]: choices that exclude each other.
    pub fn options(&self) -> Result<EncodeOptions, ChoiceError> {
        let of_preset = EncodeOptions::preset(self.preset);
        let method = match (self.encoder, of_preset.method) {
            (Some(EncoderChoice::Certified), Method::Sampled(_)) => {
                return Err(ChoiceError::CertifiedPreset);
            }
            (Some(EncoderChoice::Sampled), Method::Certified) => {
                Method::Sampled(Sampling { resolution: RESOLUTION, ..Sampling::PAPER })
            }
            (_, method) => method,
        };
        let method = match method {
            Method::Sampled(sampling) => Method::Sampled(Sampling {
                resolution: self.resolution.unwrap_or(sampling.resolution),
                threshold: self.threshold.unwrap_or(sampling.threshold),
                ..sampling
            }),
            Method::Certified if self.resolution.is_some() || self.threshold.is_some() => {
                return Err(ChoiceError::NotSampled);
            }
            Method::Certified => Method::Certified,
        };
        if matches!(self.domain, DomainChoice::File(_)) && (self.band.is_some() || !self.regions.is_empty()) {
            return Err(ChoiceError::BesidesFile);
        }
        let inside = self.inside()?;
        let refinement = match (&self.domain, self.refinement) {
            (DomainChoice::Bisection, Some(Refinement::None)) => return Err(ChoiceError::PlainBisection),
            (DomainChoice::Bisection, _) => Refinement::ByCost,
            (_, chosen) => chosen.unwrap_or(of_preset.refinement),
        };
        Ok(EncodeOptions {
            method,
            refinement,
            deformation: self.deformation,
            max_entries: self.e_max.map(Into::into),
            band: self.band.map_or(of_preset.band, Length::Absolute),
            regions: self.regions.clone(),
            unit: self.unit.clone(),
            inside,
            ..of_preset
        })
    }

    /// What is inside, for [`SolidMesh::with_inside`].
    ///
    /// # Errors
    /// [`ChoiceError`]: choices that exclude each other.
    pub fn inside(&self) -> Result<Inside, ChoiceError> {
        let rule = match (self.inside, self.thickness) {
            (InsideChoice::Sheet, Some(thickness)) => InsideRule::Sheet { thickness },
            (InsideChoice::Sheet, None) => return Err(ChoiceError::NoThickness),
            (_, Some(_)) => return Err(ChoiceError::NotASheet),
            (InsideChoice::Winding, None) => InsideRule::Winding,
            (InsideChoice::Nonzero, None) => InsideRule::Nonzero,
            (InsideChoice::Odd, None) => InsideRule::Odd,
            (InsideChoice::Generalized, None) => InsideRule::Generalized,
        };
        if self.inside == InsideChoice::Sheet && self.surface == SurfaceFaces::Boundary {
            return Err(ChoiceError::BoundaryOfSheet);
        }
        Ok(Inside { rule, surface: self.surface })
    }

    /// Makes or reads the tetrahedra of a conforming domain. Returns `None` for the bisection
    /// domain. When `progress` is cancelled, Gmsh is ended.
    ///
    /// # Errors
    /// [`DomainError`]: the file cannot be read, Gmsh is missing or gives no valid tetrahedra, or
    /// the tetrahedra do not conform to the solid.
    pub fn tetrahedra(
        &self,
        solid: &SolidMesh,
        progress: &Progress,
    ) -> Result<Option<ConformingMesh>, DomainError> {
        match &self.domain {
            DomainChoice::Bisection => Ok(None),
            #[cfg(not(feature = "gmsh"))]
            DomainChoice::Gmsh => {
                let _ = progress;
                Err(DomainError::NotBuilt)
            }
            #[cfg(feature = "gmsh")]
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

/// The name of the file, where the error does not contain it.
fn prefix(path: &std::path::Path, source: &ReadTetrahedraError) -> String {
    match source {
        ReadTetrahedraError::Open { .. } | ReadTetrahedraError::UnknownExtension { .. } => String::new(),
        _ => format!("{}: ", path.display()),
    }
}
