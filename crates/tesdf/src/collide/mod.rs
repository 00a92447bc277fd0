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
//! - [`time_of_impact`](time_of_impact()): the time at which two moving instances first touch,
//!   or that they stay apart; never too late.
//! - [`why`](why()): why a contact is present or missing.
//!
//! In each contact, *a* is the body that has the face (or node), and *b* is the body whose signed
//! distance field is used. Both orders of a pair are evaluated.
mod ahead;
mod branch;
mod candidates;
mod clearance;
mod coarse;
mod cones;
mod contact;
mod deepest_penetration;
mod depth_bounds;
mod descent;
mod detect;
mod error;
mod field;
mod field_value;
mod first_touch;
mod found;
mod greatest_minimum;
mod hidden;
mod hidden_overlap;
mod hull;
mod ids;
mod instance_pairs;
mod kept_pairs;
mod least;
mod local_minima;
mod middle;
mod motion;
mod moving;
mod narrow;
mod options;
mod ordered_pair;
mod parting;
mod patches;
mod piece;
mod polygon;
mod pose;
mod queue;
mod reach;
mod reduce;
mod scene;
mod shape;
mod shape_distance;
mod shape_ray;
mod simple;
mod spread;
mod surface;
mod time_of_impact;
mod touching_features;
mod why;

/// Constants and functions that the kernels of `tesdf-gpu` and their tests share with this crate.
/// Not part of the API.
#[doc(hidden)]
pub mod internal {
    pub use super::ahead::{Ahead, Approach};
    pub use super::candidates::{count_faces, count_polygons};
    pub use super::cones::in_cones;
    pub use super::field::ROUNDING;
    pub use super::found::kept_at_vertices;
    pub use super::greatest_minimum::greatest_minimum;
    pub use super::hidden::{DEEPER, SETTLED, THICK};
    pub use super::hull::{Wrench, residual};
    pub use super::local_minima::local_minima;
    pub use super::narrow::LARGE;
    pub use super::narrow::extremes::{BEYOND, DIRECTIONS, LEVEL, MOVES, OPPOSES, TRIALS};
    pub use super::polygon::{MAX_VERTICES, Parts, Polygon};
    pub use super::reduce::FLAT;
}

pub use candidates::{Candidate, candidates};
pub use clearance::{Clearance, ClearanceOptions, clearance};
pub use coarse::{CoarseContact, coarse_contacts};
pub use contact::{Contact, Contacts, FeatureB, FeatureId, PairReduction, Statistics};
pub use deepest_penetration::{DeepestPenetration, PenetrationOptions, deepest_penetration};
pub use detect::{detect, detect_pairs, detect_until, detect_with};
pub use error::CollideError;
pub use hidden::hidden_overlaps;
pub use hidden_overlap::HiddenOverlap;
pub use ids::{InstanceId, ShapeId};
pub use instance_pairs::{InstancePair, instance_pairs};
pub use kept_pairs::InstancePairs;
pub use motion::Motion;
pub use options::{CollideOptions, ContactsPer, HiddenSearch, Mode, Reduction};
pub use patches::{ContactPatch, ContactPatches, PatchOptions, PatchPoint, PatchTracker};
pub use pose::{Placement, Pose};
pub use reduce::{reduce_pairs, wrench_error};
pub use scene::{Groups, Instance, Scene, Velocity};
pub use shape::Shape;
pub use shape_ray::ShapeHit;
pub use time_of_impact::{FreeUntil, Impact, TimeOfImpact, TimeOfImpactOptions, time_of_impact};
pub use touching_features::TouchingFeatures;
pub use why::{BroadVerdict, PairVerdict, PartReport, PolygonReport, PolygonVerdict, WhyReport, why};
