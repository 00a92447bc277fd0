//! Vectors, faces, poses and wrenches.
pub mod greatest_minimum;
pub mod pose;
pub mod triangle;
pub mod vector;
pub mod wrench;
