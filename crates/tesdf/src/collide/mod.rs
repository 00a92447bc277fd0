//! Contacts between instances of encoded meshes and simple shapes.
//!
//! ```text
//! Scene ──instance_pairs──▶ pairs ──broad──▶ Candidates ──middle──▶ ClippedPolygons ──narrow──▶ contacts ──filter, reduce──▶ Contacts
//! ```
//!
//! - [`Scene`]: shapes (an encoded mesh, a plane, a box, a sphere, a capsule), and instances of them: a pose, a
//!   velocity, a scale, a world. An instance costs its state only.
//! - [`detect`](detect()): all contacts of a scene, sorted by ids; the same input gives the same bytes on any number of threads.
//! - [`candidates`](candidates()): what the broad and the middle phase leave, for debug views.
//! - [`reduce_pairs`]: fewer contacts per pair, with a bound on what is lost; [`wrench_error`] tells what is.
//! - [`hidden_overlaps`]: pairs that overlap although no contact shows it, which detections tell beside their contacts.
//! - [`clearance`](clearance()): the signed distance between two instances, with witnesses.
//! - [`time_of_impact`](time_of_impact()): when two moving instances first touch, never too late.
//! - [`why`](why()): why a contact is, or is not, there.
//!
//! In each contact *a* is the body whose face (or node) it is and *b* the body whose signed distance field it is; both
//! directions of a pair are evaluated.
mod candidates;
mod clearance;
mod contact;
mod detect;
mod error;
mod field;
mod field_value;
mod hidden;
mod hidden_overlap;
mod hull;
mod ids;
mod instance_pairs;
mod least;
mod middle;
mod motion;
mod narrow;
mod options;
mod ordered_pair;
mod polygon;
mod pose;
mod reduce;
mod scene;
mod shape;
mod shape_distance;
mod shape_ray;
mod simple;
mod surface;
mod time_of_impact;
mod why;

pub use candidates::{Candidate, candidates};
pub use clearance::{Clearance, ClearanceOptions, clearance};
pub use contact::{Contact, Contacts, FeatureB, FeatureId, PairReduction, Statistics};
pub use detect::detect;
pub use error::CollideError;
pub use hidden::hidden_overlaps;
pub use hidden_overlap::HiddenOverlap;
pub use ids::{InstanceId, ShapeId};
pub use instance_pairs::{InstancePair, instance_pairs};
pub use motion::Motion;
pub use options::{CollideOptions, Mode, Reduction};
pub use pose::{Placement, Pose};
pub use reduce::{reduce_pairs, wrench_error};
pub use scene::{Groups, Instance, Scene, Velocity};
pub use shape::Shape;
pub use shape_ray::ShapeHit;
pub use time_of_impact::{Impact, TimeOfImpactOptions, time_of_impact};
pub use why::{BroadVerdict, PairVerdict, PartReport, PolygonReport, PolygonVerdict, WhyReport, why};
