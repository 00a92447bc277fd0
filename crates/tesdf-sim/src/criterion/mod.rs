//! Success criteria of a run.
mod rest;
mod screw;

pub use rest::{RestCriterion, RestReport, RestTracker};
pub use screw::{ScrewCriterion, ScrewReport, ScrewTracker, screw_acceleration};

use serde::Serialize;

use crate::System;
use crate::scene_file::CriterionSection;

/// How far joints came apart, at any step.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct JointDrift {
    /// The greatest distance in a direction that is not free, m.
    pub distance: f64,
    /// The greatest angle about an axis that is not free, rad.
    pub angle: f64,
}

/// Follows the criteria of a scene along a run.
#[derive(Clone, Debug, Default)]
pub(crate) struct Trackers {
    screw: Option<ScrewTracker>,
    rest: Option<RestTracker>,
    drift: JointDrift,
}

impl Trackers {
    /// Trackers that start from the current state of `system`.
    pub(crate) fn new(section: &CriterionSection, system: &System) -> Result<Self, String> {
        let CriterionSection { screw, rest } = section;
        Ok(Self {
            screw: screw.as_ref().map(|screw| ScrewTracker::new(screw, system)).transpose()?,
            rest: rest.as_ref().map(|rest| RestTracker::new(rest, system)).transpose()?,
            drift: JointDrift::default(),
        })
    }

    /// Records the state after a step of `time_step` seconds.
    pub(crate) fn observe(&mut self, system: &System, time_step: f64) {
        if let Some(screw) = &mut self.screw {
            screw.observe(system, time_step);
        }
        if let Some(rest) = &mut self.rest {
            rest.observe(system, time_step);
        }
        for joint in system.joints() {
            let (distance, angle) = joint.error(System::poses_of(joint, system.states()));
            self.drift.distance = self.drift.distance.max(distance);
            self.drift.angle = self.drift.angle.max(angle);
        }
    }

    /// How far the joints came apart; `None` when there are none.
    pub(crate) fn drift(&self, system: &System) -> Option<JointDrift> {
        (!system.joints().is_empty()).then_some(self.drift)
    }

    /// Compares the run so far with the criteria. `failures` are added to those of each criterion.
    pub(crate) fn report(
        &self,
        system: &System,
        failures: &[String],
    ) -> (Option<ScrewReport>, Option<RestReport>) {
        let mut screw = self.screw.as_ref().map(|screw| screw.report(system));
        let mut rest = self.rest.as_ref().map(RestTracker::report);
        if let Some(screw) = &mut screw {
            screw.failures.extend_from_slice(failures);
        }
        if let Some(rest) = &mut rest {
            rest.failures.extend_from_slice(failures);
        }
        (screw, rest)
    }
}
