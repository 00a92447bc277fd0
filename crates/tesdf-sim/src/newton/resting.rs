//! Bodies that the first minimisation of a step leaves where they are: nothing is detected again
//! between them, and they are not solved again, until something else in the step moves them.
//!
//! Where no body of an island moves, and nothing that moves touches it, what is detected at the
//! predicted poses is what was detected at the beginning, and the solution stays. In a scene of
//! bodies that have not yet fallen asleep (`sleep.rs`), this is most of a step.
use nalgebra::Vector6;
use tesdf::collide::Contact;

use super::Newton;
use super::islands::islands;
use super::rows::Row;
use super::sleep::pairs_of;
use super::step::Step;
use crate::{Mass, State};

/// A body rests in a step when no point of it moves by more than this, m: what a minimisation from
/// kept forces leaves.
const STAYS: f64 = 1e-12;

impl Newton {
    /// Which free bodies rest in a step with these velocities. The rows are those of all joints, and
    /// of the contacts that may act.
    pub(super) fn resting(
        &self,
        step: &Step,
        contacts: &[Contact],
        rows: &[Row],
        velocities: &[Vector6<f64>],
    ) -> Vec<bool> {
        let zero = vec![Vector6::zeros(); velocities.len()];
        let ways = self.ways(step, &zero, velocities);
        let mut resting: Vec<bool> = ways.zip(&step.deep).map(|(way, deep)| way <= STAYS && !deep).collect();
        if !resting.contains(&true) {
            return resting;
        }
        // Their contacts move, although the body may not.
        let joints = self.system.joints().iter().filter_map(|joint| Some([joint.parent?, joint.child]));
        for [a, b] in pairs_of(contacts, &self.system).chain(joints) {
            for (moving, body) in [(a, b), (b, a)] {
                if self.is_driven(moving)
                    && let Some(free) = step.free_of[body]
                {
                    resting[free] = false;
                }
            }
        }
        for island in islands(step.free.len(), rows) {
            if island.bodies.iter().any(|&k| !resting[k]) {
                island.bodies.iter().for_each(|&k| resting[k] = false);
            }
        }
        resting
    }

    /// Whether a body that rests moves with these velocities.
    pub(super) fn stirs(&self, step: &Step, velocities: &[Vector6<f64>]) -> bool {
        let zero = vec![Vector6::zeros(); velocities.len()];
        let mut ways = self.ways(step, &zero, velocities).zip(&step.resting);
        step.resting.contains(&true) && ways.any(|(way, resting)| *resting && way > STAYS)
    }

    /// Marks the bodies that do not move in the step as still, so that nothing is detected between
    /// them.
    pub(super) fn mark_resting(&mut self, step: &Step) {
        let is_still = |body: usize| match self.system.bodies()[body].mass {
            Mass::Fixed => true,
            Mass::Kinematic => !self.is_driven(body),
            Mass::Free(_) => step.free_of[body].is_none_or(|free| step.resting[free]),
        };
        let still: Vec<bool> = (0..step.free_of.len()).map(is_still).collect();
        self.mark(&still);
    }

    /// Whether a body is kinematic and has a velocity.
    fn is_driven(&self, body: usize) -> bool {
        let state = self.system.states()[body];
        self.system.bodies()[body].mass == Mass::Kinematic && state != State::at_rest(state.pose)
    }
}
