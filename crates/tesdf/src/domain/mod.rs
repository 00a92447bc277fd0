//! The embedded domain: a cube of six Kuhn tetrahedra, refined by newest-vertex bisection.
//!
//! Comes in: bounds and an outer band. Goes out: cells, named by their path from a root, whose
//! geometry nothing stores.
mod bisection;
mod cube;

pub use bisection::{Barycentric, Cell, MAX_DEPTH, ROOTS};
pub use cube::DomainCube;
