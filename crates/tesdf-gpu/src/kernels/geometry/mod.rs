//! Vectors, triangles and distances between them.
pub mod polygon_distance;
pub mod triangle;
pub mod vector;
