//! Which faces can be closest in each cell.
pub mod filter;
pub mod refine;
pub mod surface;
pub mod tighten;
