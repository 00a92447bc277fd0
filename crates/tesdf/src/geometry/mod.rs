//! Geometry of points, triangles and tetrahedra: closest points, bounds, box trees, exact
//! predicates, the local frame.
mod aabb;
mod aabb_tree;
mod barycentric;
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
mod winding;

pub use aabb::Aabb;
pub use aabb_tree::{AabbTree, Child};
pub use barycentric::barycentric;
pub use crossing::{normal_signs, orientation, perturbed_orientation, signed_crossing};
pub use flat::is_flat;
pub use frame::LocalFrame;
pub use generalized_winding::{Generalized, GeneralizedWinding, NearWinding};
pub use meet::{segment_meets_triangle, surely_apart, triangles_meet};
pub use polygon_distance::polygon_to_triangle;
pub(crate) use ray::{NearRay, length_and_direction};
pub use self_overlap::self_overlaps;
pub(crate) use sign_rule::SignRule;
pub use tetrahedron::{tetrahedron_volume, triangle_meets_tetrahedron};
pub use triangle::{Closest, Feature, Regions, Triangle};
pub use winding::WindingNumber;
