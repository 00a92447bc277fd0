//! Closest points, bounds, predicates.
mod aabb;
mod aabb_tree;
mod frame;
mod tetrahedron;
mod triangle;

pub use aabb::Aabb;
pub use aabb_tree::{AabbTree, Child};
pub use frame::LocalFrame;
pub use tetrahedron::{tetrahedron_volume, triangle_meets_tetrahedron};
pub use triangle::{Closest, Feature, Regions, Triangle};
