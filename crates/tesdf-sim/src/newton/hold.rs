//! Bodies that a step would move by no more than it is exact stay where they are, bit for bit.
//!
//! A minimisation leaves bodies at rest with velocities of 1e-13 to 1e-11 of those that gravity
//! gives them in the step: by these they would creep, and nothing would ever be as it was. Where
//! they stay, the next step need neither detect their contacts (`seen.rs`) nor find their forces
//! (`kept.rs`).
use nalgebra::Vector6;

use super::Newton;
use super::integrate::{unpack, velocity};
use super::step::Step;
use crate::State;

/// A body stays when its velocity at the end of a step is below this share of that which gravity
/// and wrenches give it in the step: when all that acts on it, contacts included, accelerates it by
/// less than this share of its weight.
const HELD: f64 = 1e-10;

impl Newton {
    /// Gives the free bodies that stay in a step their poses of its beginning and no velocity.
    /// `velocities` move the bodies; `states` are those at the end of the step.
    pub(super) fn hold(&self, step: &Step, velocities: &[Vector6<f64>], states: &mut [State]) {
        // What pushes deep bodies apart follows from where they are, not from their velocities.
        for (k, free) in step.free.iter().enumerate().filter(|(k, _)| !step.deep[*k]) {
            let speed = |v: &Vector6<f64>| {
                let (linear, angular) = unpack(v);
                linear.length() + self.sizes[free.body] * angular.length()
            };
            let begin = velocity(&self.system.states()[free.body]);
            let least = HELD * speed(&(step.target[k] - begin));
            let state = &mut states[free.body];
            if speed(&velocities[k]) <= least && speed(&velocity(state)) <= least {
                *state = State::at_rest(step.poses[free.body]);
            }
        }
    }
}
