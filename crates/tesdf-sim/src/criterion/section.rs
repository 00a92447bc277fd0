//! The criteria of a scene, whichever they are.
use std::collections::BTreeMap;
use std::sync::Arc;

use serde::de::Error;
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use serde_json::Value;

use super::any::{AnyCriterion, AnyTracker, CriterionReport};
use super::{Criteria, Criterion};
use crate::System;

/// The success criteria of a run, by the names of their tables. Every criterion that is given must
/// hold.
#[derive(Clone, Debug, Default)]
pub struct CriterionSection(BTreeMap<&'static str, Arc<dyn AnyCriterion>>);

impl PartialEq for CriterionSection {
    /// Whether both have the same criteria with the same values.
    fn eq(&self, other: &Self) -> bool {
        let values =
            |section: &Self| section.0.iter().map(|(name, criterion)| (*name, criterion.value())).collect();
        let [one, two]: [Vec<_>; 2] = [self, other].map(values);
        one == two
    }
}

impl Serialize for CriterionSection {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_map(self.0.iter().map(|(name, criterion)| (name, criterion.value())))
    }
}

impl<'de> Deserialize<'de> for CriterionSection {
    /// Reads criteria of this crate. [`LoadedScene`](crate::scene_file::LoadedScene) reads those of
    /// other crates, too.
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let tables = BTreeMap::<String, Value>::deserialize(deserializer)?;
        Self::of_json(tables, &Criteria::standard()).map_err(D::Error::custom)
    }
}

impl CriterionSection {
    /// The criterion `C`, if the scene has it.
    pub fn get<C: Criterion>(&self) -> Option<&C> {
        self.0.get(C::NAME).and_then(|criterion| criterion.as_any().downcast_ref())
    }

    /// Gives the scene the criterion `C`, in place of the one that it may have.
    pub fn set<C: Criterion>(&mut self, criterion: C) {
        self.insert(C::NAME, Arc::new(criterion));
    }

    /// Changes the criterion `C`; `None` when the scene does not have it.
    pub fn edit<C: Criterion, R>(&mut self, change: impl FnOnce(&mut C) -> R) -> Option<R> {
        let mut criterion = self.get::<C>()?.clone();
        let changed = change(&mut criterion);
        self.set(criterion);
        Some(changed)
    }

    /// Takes the criterion `C` out of the scene, if it has it.
    pub fn remove<C: Criterion>(&mut self) {
        self.0.remove(C::NAME);
    }

    /// Reads the tables of `criteria`.
    ///
    /// # Errors
    /// A message that names the criterion.
    pub(crate) fn of_json(
        tables: impl IntoIterator<Item = (String, Value)>,
        criteria: &Criteria,
    ) -> Result<Self, String> {
        let read = |(name, table): (String, Value)| {
            let reader = criteria.reader(&name)?;
            let criterion = (reader.json)(table).map_err(|e| format!("{name}: {e}"))?;
            Ok((reader.name, criterion))
        };
        tables.into_iter().map(read).collect::<Result<_, String>>().map(Self)
    }

    /// Adds a criterion that was read.
    pub(crate) fn insert(&mut self, name: &'static str, criterion: Arc<dyn AnyCriterion>) {
        self.0.insert(name, criterion);
    }

    /// Checks that the criteria match the bodies and joints. `free` says why a body is driven by
    /// more than contacts. Errors are the name of a criterion and a message.
    pub(crate) fn check(
        &self,
        system: &System,
        free: impl Fn(&str) -> Result<(), String>,
    ) -> Result<(), (String, String)> {
        for (&name, criterion) in &self.0 {
            let bodies = criterion.check(system);
            bodies
                .and_then(|all| all.iter().try_for_each(|body| free(body)))
                .map_err(|e| (name.into(), e))?;
        }
        Ok(())
    }
}

/// Follows the criteria of a scene along a run.
#[derive(Debug)]
pub(crate) struct Trackers(Vec<(&'static str, Box<dyn AnyTracker>)>);

impl Clone for Trackers {
    fn clone(&self) -> Self {
        Self(self.0.iter().map(|(name, tracker)| (*name, tracker.copy())).collect())
    }
}

impl Trackers {
    /// Trackers that start from the current state of `system`.
    pub(crate) fn new(section: &CriterionSection, system: &System) -> Result<Self, String> {
        let followed = section.0.iter().map(|(&name, criterion)| Ok((name, criterion.follow(system)?)));
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

/// Writes reports as fields with the names of their criteria. Criteria of this crate that the scene
/// does not have are null.
pub(crate) fn by_name<S: Serializer>(reports: &[CriterionReport], serializer: S) -> Result<S::Ok, S::Error> {
    let of_scene = reports.iter().map(|report| (report.name, Some(&report.values)));
    let is_there = |name: &str| reports.iter().any(|report| report.name == name);
    let standard = Criteria::standard();
    let others = standard.names().filter(|name| !is_there(name)).map(|name| (name, None));
    serializer.collect_map(of_scene.chain(others))
}
