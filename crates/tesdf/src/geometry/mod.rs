//! Boxes and triangles, and the closest points of triangles.
mod aabb;
mod aabb_tree;
mod barycentric;
mod convex_hull;
mod crossing;
mod flat;
mod frame;
mod generalized_winding;
mod meet;
mod polygon_distance;
mod ray;
mod self_overlap;
mod sign_rule;
#[cfg(test)]
pub(crate) mod strategy;
mod tetrahedron;
mod triangle;
pub(crate) mod winding;

/// What the other crates of this project and its tests use. Not part of the API.
#[doc(hidden)]
pub mod internal {
    pub use super::aabb_tree::{AabbTree, Child};
    pub use super::barycentric::barycentric;
    pub use super::convex_hull::convex_hull;
    pub use super::crossing::{orientation, perturbed_orientation, signed_crossing};
    pub use super::frame::LocalFrame;
    pub use super::meet::triangles_meet;
    pub use super::polygon_distance::polygon_to_triangle;
    pub use super::tetrahedron::{tetrahedron_volume, triangle_meets_tetrahedron};
}

pub use aabb::Aabb;
pub(crate) use crossing::normal_signs;
pub(crate) use flat::is_flat;
pub(crate) use generalized_winding::GeneralizedWinding;
pub(crate) use internal::*;
pub(crate) use meet::{segment_meets_triangle, surely_apart};
pub(crate) use ray::{NearRay, length_and_direction};
pub(crate) use self_overlap::self_overlaps;
pub(crate) use sign_rule::SignRule;
pub(crate) use triangle::Regions;
pub use triangle::{Closest, Feature, Triangle};
pub(crate) use winding::WindingNumber;
