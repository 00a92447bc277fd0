//! Closest points, bounds, predicates, winding numbers.
mod aabb;
mod aabb_tree;
mod crossing;
mod winding;

pub use aabb::Aabb;
pub use aabb_tree::{AabbTree, Child};
pub use crossing::{normal_signs, orientation, signed_crossing};
pub use winding::WindingNumber;
