//! The built-in engine: it solves all contacts of an island together, as one convex problem.
//!
//! A contact is a spring that acts at the end of the step, so a step minimises a convex function of
//! the velocities. This is the formulation of Todorov, *Convex and analytically-invertible dynamics
//! with contacts and constraints* (ICRA 2014), and of Castro, Permenter and Han, *An unconstrained
//! convex formulation of compliant contact* (IEEE T-RO 2022):
//!
//! ```text
//! minimise over v   ½ |v − v*|²_M + Σ ½ Kᵢ min(0, gᵢ + h Jᵢ v)² + Σ friction + Σ joints + Σ motors
//! with              Kᵢ = κ / (wᵢ h²),   wᵢ = Jᵢ M⁻¹ Jᵢᵀ
//! ```
//!
//! Springs give way. So the problem is solved again, with each spring compressed by its force,
//! until no contact gives way (the method of multipliers, in `problem.rs`). Its solution is that of
//! rigid contacts: the minimum of the first term with `gᵢ + h Jᵢ v ≥ 0`. Islands that overlap
//! deeply keep their springs. Gaps are counted from a skin ([`NewtonOptions::skin`]), and normals
//! at edges that are flush are those of the faces (`normals.rs`).
//!
//! *Friction* is a spring against the slip `h t`, where `t` is the tangential velocity, whose force
//! ends at the limit `b = μ` × push of the contact. The push is that of the minimisation before, so
//! that each minimisation is convex (lagged friction: Kaufman et al., *Staggered projections for
//! frictional contact in multibody systems*, SIGGRAPH Asia 2008). It cannot act across a gap, as
//! the convex cone of Castro et al. can. The limits stay once they change by less than 0.3 %. Below
//! the limit the force is raised, too, so a body that sticks does not creep.
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
mod gaps;
mod geometric;
mod impacts;
mod integrate;
mod islands;
mod joints;
mod linear;
mod look;
mod normals;
mod options;
mod passing;
mod problem;
mod rotation;
mod rows;
mod spring;
mod step;

pub use engine::{Detect, Newton};
pub use options::NewtonOptions;
