//! Closest points, bounds, predicates.
mod aabb;
mod aabb_tree;

pub use aabb::Aabb;
pub use aabb_tree::{AabbTree, Child};
