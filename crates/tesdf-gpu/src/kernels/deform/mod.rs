//! Deformation (Sec. V-D of the paper): updates the arrays of a shape after vertices have moved.
//! Connectivity, lists and labels stay.
pub mod bounds;
pub mod move_vertices;
pub mod refit;
