//! Success criteria of a run.
mod assembly;
mod gear_ratio;
mod hoist;
mod insertion;
mod lift;
mod linking;
mod rest;
mod screw;
mod separation;
mod shared;
mod transmission;

pub use assembly::{AssemblyCriterion, AssemblyReport, AssemblyTracker, NutGroup, PartReport, PegGroup};
pub use gear_ratio::{GearRatioCriterion, GearRatioReport, GearRatioTracker};
pub use hoist::{HoistChain, HoistCriterion, HoistLink, HoistReport, HoistTracker};
pub use insertion::{InsertionCriterion, InsertionReport, InsertionTracker};
pub use lift::{LiftCriterion, LiftReport, LiftTracker};
pub use rest::{RestCriterion, RestReport, RestTracker};
pub use screw::{ScrewCriterion, ScrewReport, ScrewTracker, screw_acceleration};
pub use separation::{SeparationCriterion, SeparationReport, SeparationTracker};
pub use transmission::{
    EngagedGear, EngagedReport, TransmissionCriterion, TransmissionReport, TransmissionTracker,
};

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
    insertion: Option<InsertionTracker>,
    lift: Option<LiftTracker>,
    gear_ratio: Option<GearRatioTracker>,
    separation: Option<SeparationTracker>,
    hoist: Option<HoistTracker>,
    transmission: Option<TransmissionTracker>,
    assembly: Option<AssemblyTracker>,
}

impl Trackers {
    /// Trackers that start from the current state of `system`.
    pub(crate) fn new(section: &CriterionSection, system: &System) -> Result<Self, String> {
        let CriterionSection {
            screw,
            rest,
            insertion,
            lift,
            gear_ratio,
            separation,
            hoist,
            transmission,
            assembly,
        } = section;
        Ok(Self {
            screw: screw.as_ref().map(|screw| ScrewTracker::new(screw, system)).transpose()?,
            rest: rest.as_ref().map(|rest| RestTracker::new(rest, system)).transpose()?,
            insertion: insertion
                .as_ref()
                .map(|insertion| InsertionTracker::new(insertion, system))
                .transpose()?,
            lift: lift.as_ref().map(|lift| LiftTracker::new(lift, system)).transpose()?,
            gear_ratio: gear_ratio.as_ref().map(|gears| GearRatioTracker::new(gears, system)).transpose()?,
            separation: separation.as_ref().map(|of| SeparationTracker::new(of, system)).transpose()?,
            hoist: hoist.as_ref().map(|hoist| HoistTracker::new(hoist, system)).transpose()?,
            transmission: transmission
                .as_ref()
                .map(|gears| TransmissionTracker::new(gears, system))
                .transpose()?,
            assembly: assembly.as_ref().map(|parts| AssemblyTracker::new(parts, system)).transpose()?,
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
        if let Some(insertion) = &mut self.insertion {
            insertion.observe(system, time_step);
        }
        if let Some(lift) = &mut self.lift {
            lift.observe(system, time_step);
        }
        if let Some(gears) = &mut self.gear_ratio {
            gears.observe(system, time_step);
        }
        if let Some(separation) = &mut self.separation {
            separation.observe(system, time_step);
        }
        if let Some(hoist) = &mut self.hoist {
            hoist.observe(system, time_step);
        }
        if let Some(transmission) = &mut self.transmission {
            transmission.observe(system, time_step);
        }
        if let Some(assembly) = &mut self.assembly {
            assembly.observe(system, time_step);
        }
    }

    /// Compares the run so far with the criteria. `failures` are added to those of each criterion.
    pub(crate) fn report(&self, system: &System, failures: &[String]) -> Reports {
        let mut reports = Reports {
            screw: self.screw.as_ref().map(|screw| screw.report(system)),
            rest: self.rest.as_ref().map(RestTracker::report),
            insertion: self.insertion.as_ref().map(InsertionTracker::report),
            lift: self.lift.as_ref().map(|lift| lift.report(system)),
            gear_ratio: self.gear_ratio.as_ref().map(GearRatioTracker::report),
            separation: self.separation.as_ref().map(SeparationTracker::report),
            hoist: self.hoist.as_ref().map(HoistTracker::report),
            transmission: self.transmission.as_ref().map(TransmissionTracker::report),
            assembly: self.assembly.as_ref().map(|parts| parts.report(system)),
        };
        reports.failures_mut().for_each(|of_one| of_one.extend_from_slice(failures));
        reports
    }
}

/// Results of the criteria of a scene.
#[derive(Clone, Debug)]
pub(crate) struct Reports {
    pub(crate) screw: Option<ScrewReport>,
    pub(crate) rest: Option<RestReport>,
    pub(crate) insertion: Option<InsertionReport>,
    pub(crate) lift: Option<LiftReport>,
    pub(crate) gear_ratio: Option<GearRatioReport>,
    pub(crate) separation: Option<SeparationReport>,
    pub(crate) hoist: Option<HoistReport>,
    pub(crate) transmission: Option<TransmissionReport>,
    pub(crate) assembly: Option<AssemblyReport>,
}

impl Reports {
    /// Whether all criteria hold; `None` when there are none.
    pub(crate) fn passed(&mut self) -> Option<bool> {
        let mut failures = self.failures_mut().peekable();
        failures.peek().is_some().then(|| failures.all(|failures| failures.is_empty()))
    }

    fn failures_mut(&mut self) -> impl Iterator<Item = &mut Vec<String>> {
        let Self { screw, rest, insertion, lift, gear_ratio, separation, hoist, transmission, assembly } =
            self;
        let screw = screw.as_mut().map(|screw| &mut screw.failures);
        let rest = rest.as_mut().map(|rest| &mut rest.failures);
        let insertion = insertion.as_mut().map(|insertion| &mut insertion.failures);
        let lift = lift.as_mut().map(|lift| &mut lift.failures);
        let gear_ratio = gear_ratio.as_mut().map(|gears| &mut gears.failures);
        let separation = separation.as_mut().map(|separation| &mut separation.failures);
        let hoist = hoist.as_mut().map(|hoist| &mut hoist.failures);
        let transmission = transmission.as_mut().map(|gears| &mut gears.failures);
        let assembly = assembly.as_mut().map(|parts| &mut parts.failures);
        [screw, rest, insertion, lift, gear_ratio, separation, hoist, transmission, assembly]
            .into_iter()
            .flatten()
    }
}
