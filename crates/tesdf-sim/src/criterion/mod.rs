//! Success criteria of a run.
mod rest;
mod screw;

pub use rest::{RestCriterion, RestReport, RestTracker};
pub use screw::{ScrewCriterion, ScrewReport, ScrewTracker, screw_acceleration};

use crate::System;
use crate::scene_file::CriterionSection;

/// Follows the criteria of a scene along a run.
#[derive(Clone, Debug, Default)]
pub(crate) struct Trackers {
    screw: Option<ScrewTracker>,
    rest: Option<RestTracker>,
}

impl Trackers {
    /// Trackers that start from the current state of `system`.
    pub(crate) fn new(section: &CriterionSection, system: &System) -> Result<Self, String> {
        let CriterionSection { screw, rest } = section;
        Ok(Self {
            screw: screw.as_ref().map(|screw| ScrewTracker::new(screw, system)).transpose()?,
            rest: rest.as_ref().map(|rest| RestTracker::new(rest, system)).transpose()?,
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
