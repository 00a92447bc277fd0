//! Success criteria of a run.
//!
//! The criteria of this crate are those of [`Criteria::standard`]. A criterion of another crate is a
//! type that implements [`Criterion`]; its [`Tracker`] sees the system after each step, and its
//! [`Report`] is a field of the [`Summary`](crate::Summary). [`measure`] has what criteria look up
//! and measure. Scene files are read with the criteria that they may have:
//!
//! ```
//! use serde::{Deserialize, Serialize};
//! use tesdf_sim::System;
//! use tesdf_sim::criterion::{Criteria, Criterion, Report, Rows, Tracker, measure};
//! use tesdf_sim::scene_file::LoadedScene;
//!
//! /// A body ends above a height: `[criterion.above]`.
//! #[derive(Clone, Debug, Serialize, Deserialize)]
//! #[serde(deny_unknown_fields)]
//! struct Above {
//!     body: String,
//!     height: f64,
//! }
//!
//! impl Criterion for Above {
//!     const NAME: &str = "above";
//!     type Tracker = Height;
//!
//!     fn check(&self, system: &System) -> Result<Vec<String>, String> {
//!         measure::positive([("height", self.height)])?;
//!         measure::free_body(system, &self.body, "lift")?;
//!         Ok(vec![self.body.clone()])
//!     }
//!
//!     fn track(&self, system: &System) -> Result<Height, String> {
//!         Ok(Height { body: measure::body(system, &self.body)?, least: self.height })
//!     }
//! }
//!
//! #[derive(Clone, Debug)]
//! struct Height {
//!     body: usize,
//!     least: f64,
//! }
//!
//! impl Tracker for Height {
//!     type Report = HeightReport;
//!
//!     fn observe(&mut self, _: &System, _: f64) {}
//!
//!     fn report(&self, system: &System) -> HeightReport {
//!         let height = system.states()[self.body].pose.translation.z;
//!         let failure = format!("height: {height} m; expected at least {} m", self.least);
//!         let failures = if height >= self.least { Vec::new() } else { vec![failure] };
//!         HeightReport { height, failures }
//!     }
//! }
//!
//! #[derive(Clone, Debug, Serialize)]
//! struct HeightReport {
//!     height: f64,
//!     failures: Vec<String>,
//! }
//!
//! impl Report for HeightReport {
//!     fn failures(&mut self) -> &mut Vec<String> {
//!         &mut self.failures
//!     }
//!
//!     fn rows(&self) -> Rows {
//!         vec![("height", format!("{:.3} m", self.height))]
//!     }
//! }
//!
//! let text = r#"
//!     time_step = 0.01
//!     duration = 0.1
//!     [criterion.above]
//!     body = "ball"
//!     height = 0.5
//!     [[bodies]]
//!     name = "ball"
//!     shape = { sphere = { radius = 0.1 } }
//!     mass = 1
//!     translation = [0, 0, 1]
//! "#;
//! let criteria = Criteria::standard().with::<Above>();
//! let loaded = LoadedScene::parse_with(text.into(), "scene.toml", &criteria)?;
//! let mut engine = loaded.newton(loaded.system()?)?;
//! let watch = |_: &tesdf_sim::Moment| std::ops::ControlFlow::Continue(());
//! let (_, summary) = tesdf_sim::simulate(&loaded.scene, &mut engine, watch)?;
//! assert_eq!(summary.passed, Some(true));
//! assert!(summary.report::<HeightReport>().unwrap().height < 1.0);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
mod any;
mod criteria;
mod gear_ratio;
mod insertion;
mod lift;
pub mod measure;
mod rest;
mod screw;
mod section;
mod separation;

pub use any::CriterionReport;
pub use criteria::Criteria;
pub use gear_ratio::{GearRatioCriterion, GearRatioReport, GearRatioTracker};
pub use insertion::{InsertionCriterion, InsertionReport, InsertionTracker};
pub use lift::{LiftCriterion, LiftReport, LiftTracker};
pub use rest::{RestCriterion, RestReport, RestTracker};
pub use screw::{ScrewCriterion, ScrewReport, ScrewTracker, screw_acceleration};
pub use section::CriterionSection;
pub(crate) use section::{Trackers, by_name};
pub use separation::{SeparationCriterion, SeparationReport, SeparationTracker};

use std::fmt;

use serde::Serialize;
use serde::de::DeserializeOwned;

use crate::System;

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
