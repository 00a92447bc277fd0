//! Shared parts of the tests of encoding and queries: the meshes of `data/`, an exact reference by
//! brute force, seeded points, closed shapes, and the cells of an asset decoded from its bytes
//! alone.
#![allow(dead_code, reason = "each test program uses its own part")]

pub mod blocks;
pub mod bodies;
pub mod brute_inside;
pub mod cells;
pub mod flush;
pub mod lowest;
pub mod meshes;
pub mod parts;
pub mod per_face;
pub mod points;
pub mod random;
pub mod reference;
pub mod rotation;
pub mod ruled;
pub mod shapes;
pub mod tetrahedra;
pub mod well_formed;
