//! Criteria and trackers of any kind.
use std::any::Any;
use std::fmt;
use std::sync::Arc;

use serde_json::Value;

use super::{Criterion, Report, Rows, Tracker};
use crate::System;

/// A [`Criterion`] of any kind.
pub(crate) trait AnyCriterion: fmt::Debug + Send + Sync {
    fn check(&self, system: &System) -> Result<Vec<String>, String>;
    fn follow(&self, system: &System) -> Result<Box<dyn AnyTracker>, String>;
    fn value(&self) -> Value;
    fn as_any(&self) -> &dyn Any;
}

impl<C: Criterion> AnyCriterion for C {
    fn check(&self, system: &System) -> Result<Vec<String>, String> {
        Criterion::check(self, system)
    }

    fn follow(&self, system: &System) -> Result<Box<dyn AnyTracker>, String> {
        Ok(Box::new(self.track(system)?))
    }

    fn value(&self) -> Value {
        // Only a map with other keys than texts has no JSON.
        serde_json::to_value(self).unwrap_or_default()
    }

    fn as_any(&self) -> &dyn Any {
        self
    }
}

/// A [`Tracker`] of any kind.
pub(crate) trait AnyTracker: fmt::Debug + Send + Sync {
    fn observe(&mut self, system: &System, time_step: f64);
    fn report(&self, name: &'static str, system: &System, failures: &[String]) -> CriterionReport;
    fn copy(&self) -> Box<dyn AnyTracker>;
}

impl<T: Tracker> AnyTracker for T {
    fn observe(&mut self, system: &System, time_step: f64) {
        Tracker::observe(self, system, time_step);
    }

    fn report(&self, name: &'static str, system: &System, failures: &[String]) -> CriterionReport {
        let mut report = Tracker::report(self, system);
        report.failures().extend_from_slice(failures);
        CriterionReport {
            name,
            failures: report.failures().clone(),
            rows: report.rows(),
            values: serde_json::to_value(&report).unwrap_or_default(),
            report: Arc::new(report),
        }
    }

    fn copy(&self) -> Box<dyn AnyTracker> {
        Box::new(self.clone())
    }
}

/// Result of a criterion. As JSON it is the [report](Self::report).
#[derive(Clone)]
pub struct CriterionReport {
    /// The name of the criterion.
    pub name: &'static str,
    /// The requirements that the run did not meet; empty when it passed.
    pub failures: Vec<String>,
    /// The measured values, as people read them.
    pub rows: Rows,
    pub(super) values: Value,
    report: Arc<dyn Any + Send + Sync>,
}

impl CriterionReport {
    /// The result of the kind `R`, such as [`RestReport`](super::RestReport); `None` when it is of
    /// another kind.
    pub fn report<R: Report>(&self) -> Option<&R> {
        self.report.downcast_ref()
    }
}

impl fmt::Debug for CriterionReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: {}", self.name, self.values)
    }
}

impl PartialEq for CriterionReport {
    fn eq(&self, other: &Self) -> bool {
        (self.name, &self.values) == (other.name, &other.values)
    }
}
