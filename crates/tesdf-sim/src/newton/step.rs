//! What is known of a step before its contacts.
use glam::DVec3;
use nalgebra::{Vector3, Vector6};
use tesdf::collide::Pose;

use super::geometric::Motion;
use super::integrate::{pack, unpack};
use super::rotation::Rotation;
use super::rows::{FreeBody, Row};
use crate::{State, StepReport};

/// Values that are constant during a step.
pub struct Step {
    /// Its duration, s.
    pub h: f64,
    /// The duration of the whole step that this is a part of, s.
    pub whole: f64,
    /// Poses at the beginning of the step.
    pub poses: Vec<Pose>,
    /// The free bodies.
    pub free: Vec<FreeBody>,
    /// For each body its index in `free`, or `None` when it is fixed.
    pub free_of: Vec<Option<usize>>,
    /// Mean velocities in the step without contacts.
    pub target: Vec<Vector6<f64>>,
    /// The rotations of the free bodies.
    pub rotations: Vec<Rotation>,
    /// For each free body: whether a body of its island penetrates too deeply for a linear
    /// prediction.
    pub deep: Vec<bool>,
    /// For each free body: whether it rests in the step (`resting.rs`).
    pub resting: Vec<bool>,
    /// What is reported of it.
    pub report: StepReport,
}

impl Step {
    /// Whether a row has a body of an island that overlaps deeply.
    pub fn is_deep(&self, row: &Row) -> bool {
        row.bodies().any(|(k, _)| self.deep[*k])
    }

    /// Whether a contact stays as it was found at the beginning of the step. A deep body that is
    /// pushed into another one must not kick it, and between bodies that rest nothing else would be
    /// found.
    pub fn stays(&self, row: &Row) -> bool {
        self.is_deep(row) || row.bodies().all(|(k, _)| self.resting[*k])
    }

    /// Sets the targets so that the angular momenta that `velocities` have in the motion `plain`
    /// lead to the rotations of rigid bodies.
    ///
    /// Rows change the angular momentum L, and `plain` has the mean velocity ω as linear in it. An
    /// iteration of Newton's method on ω = Φ(L), with Φ of [`Rotation::mean`]. Velocities that part
    /// deep bodies are no motion, and must not become one: the pile of shafts was kicked to three
    /// times its energy.
    pub fn turn(&self, plain: &mut Motion, velocities: &[Vector6<f64>]) {
        for (k, v) in velocities.iter().enumerate().filter(|(k, _)| !self.deep[*k]) {
            let added = added(plain, k, v);
            let mean = self.rotations[k].mean(self.rotations[k].momentum + added);
            let of_rows = unpack(&(self.free[k].inverse * pack(DVec3::ZERO, added))).1;
            let target = mean - of_rows;
            plain.target[k].fixed_rows_mut::<3>(3).copy_from(&Vector3::from(target.to_array()));
        }
    }

    /// The velocities that the next step starts from: `carried` in the motion `plain`, with the
    /// angular velocities at the end of the step of these angular momenta. The poses move at
    /// `velocities`.
    pub fn ended(
        &self,
        plain: &Motion,
        velocities: &[Vector6<f64>],
        carried: &[Vector6<f64>],
    ) -> Vec<Vector6<f64>> {
        let end = |(k, v): (usize, &Vector6<f64>)| {
            if self.deep[k] {
                return *v;
            }
            let momentum = self.rotations[k].momentum + added(plain, k, v);
            pack(unpack(v).0, self.rotations[k].end(unpack(&velocities[k]).1, momentum))
        };
        carried.iter().enumerate().map(end).collect()
    }
}

/// The angular momentum that rows have given to free body `k` when its velocity is `v`.
fn added(plain: &Motion, k: usize, v: &Vector6<f64>) -> DVec3 {
    unpack(&(plain.inertia[k] * (v - plain.target[k]))).1
}

/// Gives the free bodies these velocities.
pub fn set_velocities(states: &mut [State], free: &[FreeBody], velocities: &[Vector6<f64>]) {
    for (free, v) in free.iter().zip(velocities) {
        (states[free.body].linear, states[free.body].angular) = unpack(v);
    }
}
