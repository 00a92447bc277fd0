//! Chains of joints: further rounds in which joints come to hold, and the parts of a step that they
//! need.
//!
//! A round solves the joints with their errors at the predicted poses and their directions at the
//! beginning of the step (SHAKE, Ryckaert, Ciccotti and Berendsen 1977). A joint that is left open
//! becomes energy in the next step: twenty links with an end of twenty times their mass, that swung
//! from the horizontal, flew apart with one round, and stay within 0.2 µm with these.
use nalgebra::Vector6;

use super::Newton;
use super::couplings::coupling_errors;
use super::geometric::{ARM_TURN, Loads, Motion, Start};
use super::joints::predict;
use super::rows::{Gap, Row, RowForce};
use super::solve::from_last;
use super::step::Step;
use crate::{Coupling, DynamicsError, Joint, JointKind, Mass, State, System};

/// Maximum number of rounds for the joints alone. An error falls by three to ten in a round. A
/// chain with an end of 20,000 times the mass of a link needs six; with four it flew apart.
const ROUNDS: u32 = 8;

/// Joints hold when they are apart by less than this part of the child's diagonal, and this angle,
/// rad.
const HOLDS: f64 = 2e-6;

/// Couplings hold when they are off by less than this, rad or m, ...
const COUPLED: f64 = 1e-10;
/// ... or this part of a coordinate of many turns.
const ROUNDING: f64 = 1e-14;

/// A step has at most as many parts because of its joints.
const PARTS: f64 = 64.0;

/// Joints that are off by this much more than at the beginning of a part do not hold in it. Joints
/// that contradict each other would not hold in shorter parts, either.
const WORSE: f64 = 2.0;

/// A joint on the axis of a body has an arm below this part of its diagonal.
const NO_ARM: f64 = 1e-3;

/// What the rounds of a step improve.
pub struct Iterate {
    /// The rows of the contacts, then those of the joints.
    pub rows: Vec<Row>,
    /// Velocities of the free bodies.
    pub velocities: Vec<Vector6<f64>>,
    /// The forces of the rows.
    pub forces: Vec<RowForce>,
    /// The velocities that lead to the poses at which the contacts were found.
    pub found_at: Vec<Vector6<f64>>,
    /// The motion without geometric stiffness.
    pub plain: Motion,
    /// With it, where it matters.
    pub stiffened: Option<Motion>,
}

impl Iterate {
    /// The motion to minimise.
    pub fn motion(&self) -> &Motion {
        self.stiffened.as_ref().unwrap_or(&self.plain)
    }
}

impl Newton {
    /// Solves again until the joints hold. The rows from `of_joints` on are theirs.
    pub(super) fn close_joints(
        &self,
        step: &mut Step,
        iterate: &mut Iterate,
        of_joints: usize,
        start: &Start<'_>,
    ) -> Result<(), DynamicsError> {
        let mut loads = None;
        for _ in 0..ROUNDS {
            let states = self.moved(step, &iterate.velocities);
            if self.joint_error(&states, step.h) < HOLDS && self.are_coupled(&states, step.h) {
                break;
            }
            step.turn(&mut iterate.plain, &iterate.velocities);
            // Forces that close a gap are no loads: with a stiffness that follows them in each
            // round, the rounds converge more slowly.
            let Iterate { rows, forces, found_at, .. } = &*iterate;
            let loads = loads.get_or_insert_with(|| Loads::new(step.free.len(), rows, forces, of_joints));
            iterate.stiffened = iterate.plain.stiffened(loads, found_at, start);
            let rows = &mut iterate.rows[of_joints..];
            predict(rows, &self.gaps(step).bodies(), &states, &iterate.velocities, step.h);
            let (rows, velocities) = (&iterate.rows, &iterate.velocities);
            let solved = self.solve(
                step,
                iterate.motion(),
                rows,
                Gap::Position,
                from_last(velocities, &iterate.forces),
            )?;
            (iterate.velocities, iterate.forces) = solved;
        }
        Ok(())
    }

    /// Whether joints that a shorter part may hold do not hold in a part of `time` seconds of the step
    /// `whole`, which leads to `states`, or arms turn too far in it.
    pub(super) fn is_loose(&self, states: &[State], time: f64, whole: f64) -> bool {
        let allowed = HOLDS.max(WORSE * self.joint_error(self.system.states(), 0.0));
        let far = self.joint_error(states, time) > allowed || time * self.arm_rate(states) > 2.0 * ARM_TURN;
        far && time > 1.5 * whole / PARTS
    }

    /// How long the next part may be, when `left` seconds of the step `whole` are left, so that no
    /// arm of a joint turns by more than [`ARM_TURN`].
    pub(super) fn part_of_arms(&self, left: f64, whole: f64) -> f64 {
        let parts = (left * self.arm_rate(self.system.states()) / ARM_TURN).ceil().max(1.0);
        (left / parts).max(whole / PARTS).min(left)
    }

    /// The greatest error of a joint or a coupling: its distance as part of the child's diagonal,
    /// or its angle, rad. The states are those after a motion of `time` seconds at their
    /// velocities.
    fn joint_error(&self, states: &[State], time: f64) -> f64 {
        let of_joint = |joint: &Joint| {
            let (distance, angle) = joint.error(System::poses_of(joint, states));
            angle.max(distance / self.sizes[joint.child])
        };
        let of_coupling = |(coupling, error): (&Coupling, f64)| {
            let Joint { kind, child, .. } = &self.system.joints()[coupling.joint];
            let size = if *kind == JointKind::Slider { self.sizes[*child] } else { 1.0 };
            error.abs() / size
        };
        let errors = coupling_errors(&self.system, states, time);
        let of_couplings = self.system.couplings().iter().zip(errors).map(of_coupling);
        self.system.joints().iter().map(of_joint).chain(of_couplings).fold(0.0, f64::max)
    }

    /// Whether all couplings hold at such states.
    fn are_coupled(&self, states: &[State], time: f64) -> bool {
        let couplings = self.system.couplings().iter().zip(coupling_errors(&self.system, states, time));
        couplings.into_iter().all(|(coupling, error)| {
            let target = coupling.target(self.system.coordinates());
            error.abs() < COUPLED.max(ROUNDING * target.abs())
        })
    }

    /// The greatest rate at which the arm of a joint turns, rad/s.
    fn arm_rate(&self, states: &[State]) -> f64 {
        let of_joint = |joint: &Joint| {
            let bodies = [Some(joint.child), joint.parent];
            let rates = bodies.into_iter().flatten().map(|body| self.arm_rate_of(joint, body, states));
            rates.fold(0.0, f64::max)
        };
        self.system.joints().iter().map(of_joint).fold(0.0, f64::max)
    }

    fn arm_rate_of(&self, joint: &Joint, body: usize, states: &[State]) -> f64 {
        let Mass::Free(mass) = self.system.bodies()[body].mass else { return 0.0 };
        let point = joint.frames_in_world(System::poses_of(joint, states))[1].translation;
        let arm = point - states[body].pose.to_world(mass.center);
        let length = arm.length();
        if length < NO_ARM * self.sizes[body] {
            return 0.0;
        }
        states[body].angular.cross(arm).length() / length
    }
}
