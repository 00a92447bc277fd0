//! The criteria of a scene, whichever they are.
use std::any::Any;
use std::collections::BTreeMap;
use std::fmt;
use std::sync::Arc;

use serde::{Deserialize, Serialize, Serializer};
use serde_json::Value;

use super::{Criterion, Report, Rows, Tracker, known};
use crate::System;

/// The success criteria of a run, by the names of their tables. Every criterion that is given must
/// hold.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
#[serde(transparent)]
pub struct CriterionSection {
    tables: BTreeMap<String, Value>,
    /// Criteria from outside of this crate.
    #[serde(skip)]
    added: Vec<Kind>,
}

impl PartialEq for CriterionSection {
    /// Whether both have the same criteria with the same values.
    fn eq(&self, other: &Self) -> bool {
        self.tables == other.tables
    }
}

/// A criterion that scene files can have.
#[derive(Clone, Copy)]
pub(super) struct Kind {
    name: &'static str,
    read: fn(&Value) -> Result<Box<dyn Known>, String>,
}

impl fmt::Debug for Kind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name)
    }
}

impl Kind {
    pub(super) fn of<C: Criterion>() -> Self {
        Self { name: C::NAME, read: |table| Ok(Box::new(read::<C>(table)?)) }
    }
}

fn read<C: Criterion>(table: &Value) -> Result<C, String> {
    C::deserialize(table).map_err(|e| e.to_string())
}

impl CriterionSection {
    /// Makes a criterion from outside of this crate known.
    pub fn add<C: Criterion>(&mut self) {
        self.added.push(Kind::of::<C>());
    }

    /// The criterion `C`, if the scene has it and its values can be read.
    pub fn get<C: Criterion>(&self) -> Option<C> {
        self.tables.get(C::NAME).and_then(|table| read(table).ok())
    }

    /// Gives the scene the criterion `C`, in place of the one that it may have.
    pub fn set<C: Criterion>(&mut self, criterion: &C) {
        // Only a map with other keys than texts has no JSON.
        self.tables.insert(C::NAME.into(), serde_json::to_value(criterion).unwrap_or_default());
    }

    /// Changes the criterion `C`; `None` when the scene does not have it, or its values cannot be read.
    pub fn edit<C: Criterion, R>(&mut self, change: impl FnOnce(&mut C) -> R) -> Option<R> {
        let mut criterion = self.get()?;
        let changed = change(&mut criterion);
        self.set(&criterion);
        Some(changed)
    }

    /// Takes the criterion `C` out of the scene, if it has it.
    pub fn remove<C: Criterion>(&mut self) {
        self.tables.remove(C::NAME);
    }

    /// The criteria with their names, or the name of a table that cannot be read, and why.
    fn all(&self) -> Result<Vec<Named>, (String, String)> {
        let kinds = [known(), self.added.clone()].concat();
        let one = |(name, table): (&String, &Value)| {
            let kind = kinds.iter().find(|kind| kind.name == name).ok_or_else(|| {
                let names = kinds.iter().map(|kind| kind.name).collect::<Vec<_>>().join(", ");
                format!("there is no such criterion; the criteria are {names}")
            });
            kind.and_then(|kind| Ok((kind.name, (kind.read)(table)?))).map_err(|e| (name.clone(), e))
        };
        self.tables.iter().map(one).collect()
    }

    /// Checks that the criteria match the bodies and joints. `free` says why a body is driven by more than
    /// contacts. Errors are the name of a criterion and a message.
    pub(crate) fn check(
        &self,
        system: &System,
        free: impl Fn(&str) -> Result<(), String>,
    ) -> Result<(), (String, String)> {
        for (name, criterion) in self.all()? {
            let bodies = criterion.check(system);
            bodies
                .and_then(|all| all.iter().try_for_each(|body| free(body)))
                .map_err(|e| (name.into(), e))?;
        }
        Ok(())
    }
}

/// A criterion and its name.
type Named = (&'static str, Box<dyn Known>);

/// A [`Criterion`] of any kind.
trait Known {
    fn check(&self, system: &System) -> Result<Vec<String>, String>;
    fn follow(&self, system: &System) -> Result<Box<dyn Followed>, String>;
}

impl<C: Criterion> Known for C {
    fn check(&self, system: &System) -> Result<Vec<String>, String> {
        Criterion::check(self, system)
    }

    fn follow(&self, system: &System) -> Result<Box<dyn Followed>, String> {
        Ok(Box::new(self.track(system)?))
    }
}

/// A [`Tracker`] of any kind.
trait Followed: fmt::Debug + Send + Sync {
    fn observe(&mut self, system: &System, time_step: f64);
    fn report(&self, name: &'static str, system: &System, failures: &[String]) -> CriterionReport;
    fn copy(&self) -> Box<dyn Followed>;
}

impl<T: Tracker> Followed for T {
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

    fn copy(&self) -> Box<dyn Followed> {
        Box::new(self.clone())
    }
}

/// Follows the criteria of a scene along a run.
#[derive(Debug)]
pub(crate) struct Trackers(Vec<(&'static str, Box<dyn Followed>)>);

impl Clone for Trackers {
    fn clone(&self) -> Self {
        Self(self.0.iter().map(|(name, tracker)| (*name, tracker.copy())).collect())
    }
}

impl Trackers {
    /// Trackers that start from the current state of `system`.
    pub(crate) fn new(section: &CriterionSection, system: &System) -> Result<Self, String> {
        let criteria = section.all().map_err(|(name, e)| format!("{name}: {e}"))?;
        let followed = criteria.into_iter().map(|(name, criterion)| Ok((name, criterion.follow(system)?)));
        Ok(Self(followed.collect::<Result<_, String>>()?))
    }

    /// Records the state after a step of `time_step` seconds.
    pub(crate) fn observe(&mut self, system: &System, time_step: f64) {
        self.0.iter_mut().for_each(|(_, tracker)| tracker.observe(system, time_step));
    }

    /// Compares the run so far with the criteria. `failures` are added to those of each criterion.
    pub(crate) fn report(&self, system: &System, failures: &[String]) -> Vec<CriterionReport> {
        self.0.iter().map(|(name, tracker)| tracker.report(name, system, failures)).collect()
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
    values: Value,
    report: Arc<dyn Any + Send + Sync>,
}

impl CriterionReport {
    /// The result of the kind `R`, such as [`RestReport`](super::RestReport); `None` when it is of another
    /// kind.
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

/// Writes reports as fields with the names of their criteria.
pub(crate) fn by_name<S: Serializer>(reports: &[CriterionReport], serializer: S) -> Result<S::Ok, S::Error> {
    let of_scene = reports.iter().map(|report| (report.name, Some(&report.values)));
    let is_there = |kind: &Kind| reports.iter().any(|report| report.name == kind.name);
    let others = known().into_iter().filter(|kind| !is_there(kind)).map(|kind| (kind.name, None));
    serializer.collect_map(of_scene.chain(others))
}
