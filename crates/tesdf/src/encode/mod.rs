//! Which faces can be closest in each cell: from a solid mesh to an encoded asset.
//!
//! 1. [`roots`]: the tetrahedra to begin with, of the cube or of a conforming mesh.
//! 2. [`refine`]: bisects them, hands the surviving faces of each cell to its children
//!    ([`filter`]), and merges cells while unwinding where that costs less.
//! 3. [`lists`]: for each cell that is kept a label, and its list: certified ([`tighten`]) or [`sampled`], truncated by [`rank`].
//! 4. [`assemble`]: lays the forest and its lists out as bytes.
pub mod assemble;
pub mod candidates;
pub mod chains;
mod choices;
mod doubles;
mod effort;
pub mod filter;
pub mod hints;
mod holds;
pub mod lists;
mod options;
mod pipeline;
mod plane_rule;
mod progress;
pub mod rank;
pub mod refine;
pub mod roots;
pub mod sampled;
pub mod surface;
pub mod tighten;

pub use choices::{ChoiceError, DomainChoice, DomainError, EncodeChoices, EncoderChoice};
pub use options::{Deformation, EncodeOptions, Encoder, Length, Preset, Refinement, Sampling, Threshold};
pub use pipeline::{Domain, EncodeError, Source, encode, encode_in, encode_with};
pub use progress::{EncodeProgress, Stage};
pub use sampled::{SampledCell, Sampler};
