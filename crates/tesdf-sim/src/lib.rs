//! Rigid bodies that touch: from a scene of encoded meshes and simple shapes to their motion.
//!
//! ```text
//! scene.toml ──LoadedScene──▶ System, Newton ──simulate──▶ RunRecord, Summary ──save──▶ run.tesrun
//!                                                 └─after each step─▶ RunJournal ──▶ CutRun ──simulate_from──▶ …
//! ```
//!
//! - [`MassProperties`]: mass, centre and inertia of a closed mesh or a simple shape, in `f64`.
//! - [`System`]: bodies, their states, gravity.
//! - [`Dynamics`]: what every engine does: a step of time. [`newton`] is the embedded one.
//! - [`scene_file`]: scenes as TOML; [`criterion`]: what makes a run a success; [`record`]: runs as files.
//!
//! Units are those of the SI: metres, kilograms, seconds, radians. Everything is deterministic: the same input gives the
//! same bits on any number of threads.
#![warn(missing_docs)]

pub mod criterion;
mod dynamics;
mod mass;
pub mod newton;
pub mod record;
pub mod scene_file;
mod simulate;
mod system;

pub use dynamics::{Dynamics, DynamicsError, StepReport};
pub use mass::{MassError, MassProperties};
pub use record::{CutRun, HiddenPair, RunJournal, RunOrigin, RunRecord};
pub use simulate::{Moment, PartialRun, SimulateError, Summary, simulate, simulate_from};
pub use system::{Body, Mass, State, System};
