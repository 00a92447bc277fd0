//! The encoder: finds the faces that can be closest in each cell. A solid mesh becomes an encoded
//! asset.
//!
//! [`Encoder`] is the entry. Its stages:
//!
//! 1. `roots` gives the first tetrahedra, of the cube or of a conforming mesh.
//! 2. `refine` bisects them, passes the surviving faces of each cell to its children (`filter`),
//!    and merges cells on the way back where that costs less.
//! 3. `lists` gives each remaining cell a label and a list. The list is certified (`tighten`) or
//!    `sampled`, and may be truncated (`rank`).
//! 4. `assemble` lays the forest and its lists out as bytes.
mod assemble;
mod attempts;
pub(crate) mod candidates;
mod cell_signs;
mod chains;
mod choices;
mod doubles;
mod effort;
mod encoder;
mod error;
pub(crate) mod filter;
mod hints;
mod json;
mod list_proof;
pub(crate) mod lists;
mod pipeline;
mod placed;
mod plane_rule;
#[cfg(test)]
mod random_tetrahedra;
mod rank;
mod refine;
mod requirement_set;
mod roots;
pub(crate) mod sampled;
mod sections;
mod statistics;
pub(crate) mod surface;
mod tighten;
mod validate;

/// For the GPU crate and for tests only: it may change in any version.
#[doc(hidden)]
pub mod internal {
    pub use super::filter::PAD;
    pub use super::surface::Touching;
}

pub use crate::asset::about::Source;
pub use crate::asset::options::{
    Deformation, EncodeOptions, Groups, Method, Preset, Refinement, Sampling, Threshold,
};
pub use choices::{ChoiceError, DomainChoice, DomainError, EncodeChoices, EncoderChoice, InsideChoice};
pub use encoder::{EncodeFileError, Encoder};
pub use error::EncodeError;
pub use json::{ExportJsonError, ImportJsonError};
pub use roots::Domain;
pub use sampled::{Processor, SampledCell, Sampler};
pub use surface::Surface;
