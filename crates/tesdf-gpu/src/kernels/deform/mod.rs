//! Deformation (Sec. V-D): the arrays of a shape follow its vertices. Connectivity, lists and labels stay.
pub mod bounds;
pub mod follow;
pub mod refit;
