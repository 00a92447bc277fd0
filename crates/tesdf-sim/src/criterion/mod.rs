//! Success criteria of a run. Each has a module of its own and a line in `criteria!`.
mod assembly;
mod gear_ratio;
mod hoist;
mod insertion;
mod lift;
mod linking;
mod rest;
mod screw;
mod section;
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

use std::fmt;
use std::sync::Arc;

use serde::Serialize;
use serde::de::{DeserializeOwned, MapAccess};

use crate::System;
use section::Named;
pub use section::{CriterionReport, CriterionSection};
pub(crate) use section::{Trackers, by_name};

/// How far joints came apart, at any step.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct JointDrift {
    /// The greatest distance in a direction that is not free, m.
    pub distance: f64,
    /// The greatest angle about an axis that is not free, rad.
    pub angle: f64,
}

/// A success criterion: the table `[criterion.NAME]` of a scene file.
pub trait Criterion: Clone + fmt::Debug + Serialize + DeserializeOwned + Send + Sync + 'static {
    /// The name of its table.
    const NAME: &str;
    /// What follows it along a run.
    type Tracker: Tracker;

    /// Checks the values, and that they match the bodies and joints. Returns the names of the bodies
    /// that contacts alone may drive, and no script.
    ///
    /// # Errors
    /// A message that names the value that was found and the expected range.
    fn check(&self, system: &System) -> Result<Vec<String>, String>;

    /// A tracker that starts from the current state of `system`.
    ///
    /// # Errors
    /// The same errors as [`check`](Self::check).
    fn track(&self, system: &System) -> Result<Self::Tracker, String>;
}

/// Follows a criterion along a run.
pub trait Tracker: Clone + fmt::Debug + Send + Sync + 'static {
    /// The result.
    type Report: Report;

    /// Records the state after a step of `time_step` seconds.
    fn observe(&mut self, system: &System, time_step: f64);

    /// Compares the run so far with the criterion.
    fn report(&self, system: &System) -> Self::Report;
}

/// Names and values, as people read them.
pub type Rows = Vec<(&'static str, String)>;

/// Result of a criterion, with the requirements that the run did not meet.
pub trait Report: Clone + fmt::Debug + Serialize + Send + Sync + 'static {
    /// The requirements that the run did not meet; empty when it passed.
    fn failures(&mut self) -> &mut Vec<String>;

    /// The measured values.
    fn rows(&self) -> Rows;
}

macro_rules! criteria {
    ($($criterion:ident),* $(,)?) => {
        /// The names of all criteria.
        const NAMES: &[&str] = &[$($criterion::NAME),*];

        /// Reads the table of the criterion `name`, if there is such a criterion.
        fn read<'de, A: MapAccess<'de>>(name: &str, tables: &mut A) -> Result<Option<Named>, A::Error> {
            $(if name == $criterion::NAME {
                let criterion: $criterion = tables.next_value()?;
                return Ok(Some(($criterion::NAME, Arc::new(criterion))));
            })*
            Ok(None)
        }
    };
}

criteria!(
    AssemblyCriterion,
    GearRatioCriterion,
    HoistCriterion,
    InsertionCriterion,
    LiftCriterion,
    RestCriterion,
    ScrewCriterion,
    SeparationCriterion,
    TransmissionCriterion,
);
