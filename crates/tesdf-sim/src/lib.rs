//! Rigid-body dynamics with contacts, from a scene of encoded meshes and simple shapes to its
//! motion.
//!
//! ```text
//! scene.toml ──LoadedScene──▶ System, Newton ──simulate──▶ RunRecord, Summary ──save──▶ run.tesrun
//!                                                 └─each step─▶ RunJournal
//! run.tesrun ──InterruptedRun──▶ simulate_from ──▶ …
//! ```
//!
//! - [`MassProperties`]: mass, centre of mass and inertia of a closed mesh or a simple shape, in
//!   `f64`.
//! - [`System`]: the bodies, their states and gravity.
//! - [`Dynamics`]: the trait of every physics engine, which advances a system by a time step.
//!   [`newton`] is the built-in engine.
//! - [`Joint`], [`Motor`], [`Coupling`]: what connects bodies besides contacts.
//! - [`script`]: keyframes of kinematic bodies, motors and wrenches.
//! - [`scene_file`]: scenes as TOML files.
//! - [`robot`]: robot descriptions in URDF and MJCF.
//! - [`planning`]: clearance of a robot among obstacles, and certified motions, for planners.
//! - [`criterion`]: what makes a run a success; other crates can add criteria.
//! - [`Run`]: a run that is made step by step.
//! - [`Worlds`]: many worlds of one scene, stepped on all threads, for control and learning.
//! - [`record`]: run files.
//!
//! Units are SI: metres, kilograms, seconds, radians. Everything is deterministic: the same input
//! gives the same bits on any number of threads, processor and platform.
#![warn(missing_docs)]

mod coupling;
pub mod criterion;
mod dynamics;
mod error;
mod forces;
mod joint;
mod mass;
pub mod newton;
pub mod planning;
pub mod record;
pub mod robot;
pub mod scene_file;
pub mod script;
mod simulate;
mod system;
mod totals;
mod warning;
mod worlds;

pub use coupling::Coupling;
pub use dynamics::{Dynamics, Residual, StepReport};
pub use error::DynamicsError;
pub use forces::{ContactForce, Forces, JointForce};
pub use joint::{Drive, Joint, JointKind, JointResistance, Motor};
pub use mass::{MassError, MassProperties, inertia_matrix};
pub use record::{HiddenPair, InterruptedRun, RunJournal, RunOrigin, RunRecord};
pub use simulate::{Moment, PartialRun, Run, SimulateError, Summary, simulate, simulate_from};
pub use system::{Body, Mass, State, System, Wrench};
pub use warning::{Warning, WarningKind};
pub use worlds::{World, WorldError, WorldSnapshot, Worlds};
