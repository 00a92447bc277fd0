//! Middle phase: finds the cells of nodes, and the parts of faces in cells and around them.
pub mod branches;
pub mod cell_walk;
pub mod clip;
pub mod corners;
pub mod faces;
pub mod level_bits;
pub mod nodes;
pub mod outside;
pub mod polygon;
