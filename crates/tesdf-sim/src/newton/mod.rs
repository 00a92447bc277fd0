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
//! *Joints* (`joints.rs`) and their couplings (`couplings.rs`) are rows `eᵢ + h Jᵢ v = 0`, and
//! *motors* rows whose force stays within their limit.
//!
//! `v*` is the velocity without contacts, `gᵢ` the gap, `Jᵢ v` its rate and `h` the time step. The
//! minimiser moves the poses. The velocity that the next step starts from is the result of a second
//! minimisation, without the terms that push penetrating bodies apart.
//!
//! With re-detection, the gaps and rows come from the predicted pose. The step is then an iteration
//! of sequential quadratic programming on the exact distance.

use std::sync::Arc;

use tesdf::collide::{CollideError, CollideOptions, Contacts, Mode, Scene};

use crate::System;
use crate::forces::Forces;

mod bounce;
mod chains;
mod couplings;
mod deep;
mod engine;
mod far_contacts;
mod flat_patches;
mod gaps;
mod geometric;
mod group;
mod hold;
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
mod packed;
mod passing;
mod pattern;
mod problem;
mod reactions;
mod relative;
mod resting;
mod rotation;
mod rows;
mod runs;
mod seen;
mod sleep;
mod snapshot;
mod solve;
mod step;
mod stopwatch;
mod velocities;

pub use options::NewtonOptions;
pub use snapshot::Snapshot;

use deep::Surfaces;
use kept::Kept;
use seen::Seen;
use sleep::Sleep;

/// Finds the contacts of a scene. [`tesdf::collide::detect`] and every function of the same
/// signature implement this trait.
pub trait Detect: Send + Sync {
    /// All contacts within the distances of `options`, in an order that depends on the scene alone.
    /// Those of a pair depend on its two instances alone: [`Newton`] does not ask again for pairs
    /// of instances that stay as they were, and [marks](Scene::set_still) them.
    ///
    /// # Errors
    /// The errors of the detection, as [`CollideError`].
    fn detect(&self, scene: &Scene, options: &CollideOptions) -> Result<Contacts, CollideError>;

    /// Whether contacts hold every part of a surface that comes within those distances. Where this
    /// is so, [`Newton`] follows fast pairs by the exact distance and divides the step where one
    /// passes; where it is not, no number of parts would hold them. And it parts deep bodies
    /// without turning them.
    fn holds_all(&self, options: &CollideOptions) -> bool {
        options.mode != Mode::Node
    }

    /// What solves the problems of islands; by default, the processor does.
    #[doc(hidden)]
    fn solver(&self) -> Option<&dyn internal::SolveIslands> {
        None
    }
}

impl<F> Detect for F
where
    F: Fn(&Scene, &CollideOptions) -> Result<Contacts, CollideError> + Send + Sync,
{
    fn detect(&self, scene: &Scene, options: &CollideOptions) -> Result<Contacts, CollideError> {
        self(scene, options)
    }
}

/// What a device has to know of the problems of islands. Not part of the interface.
#[doc(hidden)]
pub mod internal {
    pub use super::interior::constants;
    pub use super::packed::{
        BODIES, BODY, FORCES, GROUP, HEADER, NONE, Packed, REPORT, RUN, SCALARS, SolveIslands, UNBOUNDED,
        field,
    };
}

/// The built-in engine: Newton's method on a regularised convex problem of all contacts. A clone
/// shares meshes and detector, and makes the same steps.
#[derive(Clone)]
pub struct Newton {
    system: System,
    detector: Arc<dyn Detect>,
    collide: CollideOptions,
    options: NewtonOptions,
    /// Diagonal of each body's bounding box, m.
    sizes: Vec<f64>,
    /// The greatest distance of a point of a body from its origin, m. Planes do not count.
    reach: f64,
    /// For bodies that overlap deeply.
    surfaces: Arc<Surfaces>,
    /// What the last step found at its beginning.
    found: Contacts,
    /// Of the last step.
    forces: Forces,
    sleep: Sleep,
    kept: Kept,
    seen: Seen,
}
