//! Which faces can be closest in each cell: from a solid mesh to an encoded asset.
//!
//! 1. [`refine`]: bisects the cube, hands the surviving faces of each cell to its children
//!    ([`filter`]), and merges cells while unwinding where that costs less.
//! 2. [`tighten`]: shortens the list of each cell that is kept.
//! 3. labels each cell by its winding number.
//! 4. [`assemble`]: lays the forest and its lists out as bytes.
pub mod assemble;
pub mod candidates;
mod certified;
mod doubles;
pub mod filter;
pub mod hints;
mod options;
mod plane_rule;
mod progress;
pub mod refine;
pub mod surface;
pub mod tighten;

pub use certified::{EncodeError, Source, encode};
pub use options::{EncodeOptions, Length, Preset};
pub use progress::{EncodeProgress, Stage};
