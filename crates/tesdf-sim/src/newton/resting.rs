//! Bodies that the first minimisation of a step leaves where they are: nothing is detected again
//! between them, and they are not solved again, until something else in the step moves them.
//!
//! Where no body of an island moves, and nothing that moves touches it, what is detected at the
//! predicted poses is what was detected at the beginning, and the solution stays. In a scene of
//! bodies that have not yet fallen asleep (`sleep.rs`), this is most of a step.
use nalgebra::Vector6;
use tesdf::collide::Contact;

use super::Newton;
use super::islands::spread;
use super::rows::Row;
use super::sleep::{joined, pairs_of};
use super::step::Step;
use crate::Mass;

/// A body rests in a step when no point of it moves by more than this, m: what a minimisation from
/// kept forces leaves.
const STAYS: f64 = 1e-12;

impl Newton {
    /// Which free bodies rest in a step with these velocities. The rows are those of all joints,
    /// and of the contacts that may act.
    pub(super) fn resting(
        &self,
        step: &Step,
        contacts: &[Contact],
        rows: &[Row],
        velocities: &[Vector6<f64>],
    ) -> Vec<bool> {
        let mut moves = self.move_at(step, velocities);
        moves.iter_mut().zip(&step.deep).for_each(|(moves, deep)| *moves |= deep);
        if moves.contains(&false) {
            // Where what they touch is driven, their contacts move, although they may not.
            for [a, b] in pairs_of(contacts, &self.system).chain(joined(&self.system)) {
                for (other, body) in [(a, b), (b, a)] {
                    if let Some(free) = step.free_of[body] {
                        moves[free] |= self.is_driven(other);
                    }
                }
            }
            spread(&mut moves, rows);
        }
        moves.into_iter().map(|moves| !moves).collect()
    }

    /// Whether a body that rests moves with these velocities.
    pub(super) fn stirs(&self, step: &Step, velocities: &[Vector6<f64>]) -> bool {
        let moves = || self.move_at(step, velocities).into_iter();
        step.resting.contains(&true) && moves().zip(&step.resting).any(|(moves, resting)| moves && *resting)
    }

    /// Of each free body whether it moves at these velocities.
    fn move_at(&self, step: &Step, velocities: &[Vector6<f64>]) -> Vec<bool> {
        let still = vec![Vector6::zeros(); velocities.len()];
        self.ways(step, &still, velocities).map(|way| way > STAYS || way.is_nan()).collect()
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
        self.system.bodies()[body].mass == Mass::Kinematic && self.system.states()[body].has_velocity()
    }
}
