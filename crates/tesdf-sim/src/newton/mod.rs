//! The embedded engine: all contacts as they are, in one convex problem per island.
//!
//! Contacts are springs that act at the end of the step, so a step minimises a convex function of the velocities: the
//! formulation of Todorov, *Convex and analytically-invertible dynamics with contacts and constraints* (ICRA 2014), and
//! of Castro, Permenter and Han, *An unconstrained convex formulation of compliant contact* (IEEE T-RO 2022), here
//! without friction:
//!
//! ```text
//! minimise over v   ½ |v − v*|²_M + Σ ½ Kᵢ min(0, gᵢ + h Jᵢ v)²,     Kᵢ = κ / (wᵢ h²),  wᵢ = Jᵢ M⁻¹ Jᵢᵀ
//! ```
//!
//! `v*` is the velocity without contacts, `gᵢ` the gap and `Jᵢ v` its rate. The poses are integrated with the minimiser; the
//! velocity that is carried on comes from a second minimisation that leaves out what pushes penetrating bodies apart.
//! With re-detection the gaps and rows are those of the predicted pose: sequential quadratic programming on the exact distance.
//!
//! A joint, a motor or a friction cone is one more convex term of a row; `problem.rs` is the only place that would change.

mod engine;
mod integrate;
mod islands;
mod linear;
mod options;
mod problem;
mod rows;

pub use engine::{Detect, Newton};
pub use options::NewtonOptions;
