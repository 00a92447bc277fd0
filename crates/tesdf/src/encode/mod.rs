//! Which faces can be closest in each cell: from a solid mesh to an encoded asset.
//!
//! 1. `roots`: the tetrahedra to begin with, of the cube or of a conforming mesh.
//! 2. `refine`: bisects them, hands the surviving faces of each cell to its children
//!    (`filter`), and merges cells while unwinding where that costs less.
//! 3. `lists`: for each cell that is kept a label, and its list: certified (`tighten`) or `sampled`, truncated by `rank`.
//! 4. `assemble`: lays the forest and its lists out as bytes.
mod assemble;
mod attempts;
pub(crate) mod candidates;
mod chains;
mod choices;
mod doubles;
mod effort;
mod error;
pub(crate) mod filter;
mod hints;
mod holds;
pub(crate) mod lists;
mod pipeline;
mod plane_rule;
#[cfg(test)]
mod random_tetrahedra;
mod rank;
mod refine;
mod roots;
pub(crate) mod sampled;
mod settled;
mod statistics;
pub(crate) mod surface;
mod tighten;

/// What the crate for devices and the tests look into. Not for others: it changes without notice.
#[doc(hidden)]
pub mod internal {
    pub use super::filter::PAD;
    pub use super::surface::Touching;
}

pub use crate::asset::about::Source;
pub use crate::asset::options::{
    Deformation, EncodeOptions, Encoder, Preset, Refinement, Sampling, Threshold,
};
pub use choices::{ChoiceError, DomainChoice, DomainError, EncodeChoices, EncoderChoice};
pub use error::EncodeError;
pub use pipeline::{encode, encode_in, encode_with};
pub use roots::Domain;
pub use sampled::{Processor, SampledCell, Sampler};
pub use surface::Surface;
