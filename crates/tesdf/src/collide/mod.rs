//! Contacts between instances of encoded meshes and simple shapes.
//!
//! ```text
//! Scene ──instance_pairs──▶ pairs ──broad──▶ Candidates ──middle──▶ ClippedPolygons
//!       ──narrow──▶ contacts ──filter, reduce──▶ Contacts
//! ```
//!
//! - [`Scene`]: shapes (an encoded mesh, a plane, a box, a sphere, a capsule) and their instances.
//!   An instance has a pose, a velocity, a scale and a world, and needs memory only for this state.
//! - [`detect`](detect()): all contacts of a scene, sorted by ids. The same input gives the same
//!   bytes for any number of threads.
//! - [`InstancePairs`]: the pairs of instances that can touch, kept from step to step for
//!   [`detect_with`], which finds the same contacts.
//! - [`candidates`](candidates()): the result of the broad and the middle phase, for debug views.
//! - [`reduce_pairs`]: fewer contacts per pair, with a bound of the loss; [`wrench_error`] computes
//!   the loss. [`Reduction::Spread`] does not find all contacts.
//! - [`PatchTracker`]: contacts grouped into patches, which keep their ids from step to step.
//! - [`hidden_overlaps`]: pairs that overlap without a contact that shows it. Detections report
//!   them beside the contacts.
//! - [`coarse_contacts`]: faces that touch between their vertices, where the mode node can miss it.
//! - [`clearance`](clearance()): the signed distance between two instances, with witness points.
//! - [`deepest_penetration`](deepest_penetration()): the deepest of many pairs, without the clearance
//!   of each.
//! - [`least_clearance`](least_clearance()): the least clearance of many pairs, or whether one is below
//!   a bound.
//! - [`time_of_impact`](time_of_impact()): the time at which two moving instances first touch,
//!   or that they stay apart; never too late.
//! - [`why`](why()): why a contact is present or missing.
//!
//! In each contact, *a* is the body that has the face (or node), and *b* is the body whose signed
//! distance field is used. Both orders of a pair are evaluated.
mod bodies;
mod clearance;
mod cones;
mod detect;
mod mode;
mod narrow;
mod options;
mod pairs;
mod report;
mod scene;
mod search;
mod time_of_impact;

/// Constants and functions that the kernels of `tesdf-gpu` and their tests share with this crate.
/// Not part of the API.
#[doc(hidden)]
pub mod internal {
    pub use super::bodies::field::ROUNDING;
    pub use super::bodies::polygon::{MAX_VERTICES, Parts, Polygon};
    pub use super::cones::{in_cones, limits};
    pub use super::detect::candidate_contacts::kept_at_vertices;
    pub use super::detect::candidates::{count_faces, count_polygons};
    pub use super::detect::hidden::{DEEPER, SETTLED, THICK};
    pub use super::detect::local_minima::local_minima;
    pub use super::narrow::LARGE;
    pub use super::narrow::extremes::{BEYOND, DIRECTIONS, LEVEL, MOVES, OPPOSES, TRIALS};
    pub use super::pairs::ahead::{Ahead, Approach};
    pub use super::report::hull::{Wrench, residual};
    pub use super::report::reduce::FLAT;
    pub use super::search::greatest_minimum::greatest_minimum;
}

pub use clearance::apart::clearance_bound;
pub use clearance::deepest_penetration::{DeepestPenetration, PenetrationOptions, deepest_penetration};
pub use clearance::least_clearance::{LeastClearance, LeastClearanceOptions, least_clearance};
pub use clearance::{Clearance, ClearanceOptions, clearance};
pub use detect::candidates::{Candidate, candidates};
pub use detect::coarse::{CoarseContact, coarse_contacts};
pub use detect::hidden::hidden_overlaps;
pub use detect::why::{BroadVerdict, PairVerdict, PartReport, PolygonReport, PolygonVerdict, WhyReport, why};
pub use detect::{detect, detect_pairs, detect_until, detect_with};
pub use mode::{ContactsPer, FaceOptions, Mode, ModeChoices, ModeName};
pub use options::{CollideOptions, HiddenSearch, Reduction};
pub use pairs::kept::InstancePairs;
pub use pairs::{InstancePair, instance_pairs};
pub use report::contact::{Contact, Contacts, FeatureB, FeatureId, PairReduction, Statistics};
pub use report::hidden_overlap::HiddenOverlap;
pub use report::patches::{ContactPatch, ContactPatches, PatchOptions, PatchPoint, PatchTracker};
pub use report::reduce::{reduce_pairs, wrench_error};
pub use report::touching_features::TouchingFeatures;
pub use scene::error::CollideError;
pub use scene::ids::{InstanceId, ShapeId};
pub use scene::motion::Motion;
pub use scene::pose::{Placement, Pose};
pub use scene::shape::Shape;
pub use scene::shape_ray::ShapeHit;
pub use scene::{Groups, Instance, Scene, Velocity};
pub use time_of_impact::{FreeUntil, Impact, TimeOfImpact, TimeOfImpactOptions, time_of_impact};
