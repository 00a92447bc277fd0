//! Rigid bodies that touch: from a scene of encoded meshes and simple shapes to their motion.
//!
//! ```text
//! Scene of tesdf::collide ──System──▶ bodies with mass ──Dynamics::step──▶ poses, velocities, contacts
//! ```
//!
//! - [`MassProperties`]: mass, centre and inertia of a closed mesh or a simple shape, in `f64`.
//! - [`System`]: bodies, their states, gravity.
//! - [`Dynamics`]: what every engine does: a step of time. [`newton`] is the embedded one.
//!
//! Units are those of the SI: metres, kilograms, seconds, radians. Everything is deterministic: the same input gives the
//! same bits on any number of threads.
#![warn(missing_docs)]

mod dynamics;
mod mass;
pub mod newton;
mod system;

pub use dynamics::{Dynamics, DynamicsError, StepReport};
pub use mass::{MassError, MassProperties};
pub use system::{Body, Mass, State, System};
