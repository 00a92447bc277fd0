//! Pieces of a face, and the bounds of their depths, in the search for a least distance.
pub mod greatest_minimum;
pub mod piece;
