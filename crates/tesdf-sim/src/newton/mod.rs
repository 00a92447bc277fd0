//! The built-in engine: it solves all contacts of an island together, as one convex problem.
//!
//! The velocities `v` at the end of a step are those of rigid contacts:
//!
//! ```text
//! minimise over v   ½ |v − v*|²_M      with   gᵢ + h Jᵢ v ≥ 0,   joints, motors and friction
//! ```
//!
//! This is the formulation of Todorov, *Convex and analytically-invertible dynamics with contacts
//! and constraints* (ICRA 2014), and of Castro, Permenter and Han, *An unconstrained convex
//! formulation of compliant contact* (IEEE T-RO 2022), without their springs. An interior point
//! method solves it (`interior.rs`), with Coulomb's friction. Contacts of islands that overlap deeply
//! are springs of the stiffness `Kᵢ = κ / (wᵢ h²)`, with `wᵢ = Jᵢ M⁻¹ Jᵢᵀ`. Gaps are counted from a
//! skin ([`NewtonOptions::skin`]), and normals at edges that are flush are those of the faces
//! (`normals.rs`).
//!
//! *Joints* (`joints.rs`) are rows `eᵢ + h Jᵢ v = 0`, and *motors* rows whose force stays within
//! their limit.
//!
//! `v*` is the velocity without contacts, `gᵢ` the gap, `Jᵢ v` its rate and `h` the time step. The
//! minimiser moves the poses. The velocity that the next step starts from is the result of a second
//! minimisation, without the terms that push penetrating bodies apart.
//!
//! With re-detection, the gaps and rows come from the predicted pose. The step is then an iteration
//! of sequential quadratic programming on the exact distance.

mod chains;
mod deep;
mod engine;
mod far;
mod gaps;
mod geometric;
mod impacts;
mod integrate;
mod interior;
mod islands;
mod joints;
mod kept;
mod lanes;
mod line;
mod linear;
mod look;
mod normals;
mod options;
mod passing;
mod problem;
mod relative;
mod resting;
mod rotation;
mod rows;
mod runs;
mod sleep;
mod solve;
mod step;
mod velocities;

pub use engine::{Detect, Newton};
pub use options::NewtonOptions;
