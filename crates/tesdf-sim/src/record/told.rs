//! Warnings in a run: those of hidden overlaps follow from their rows, and the others are kept.
use super::RunRecord;
use crate::warning::of_hidden;
use crate::{HiddenPair, Warning, WarningKind};

impl RunRecord {
    /// What the steps so far did not do as the scene asks, as in [`Summary`](crate::Summary). While
    /// a run grows, its overlaps are told by [`Run::into_record`](crate::Run::into_record) only.
    pub fn warnings(&self) -> Vec<Warning> {
        let mut warnings = self.hidden_warnings(&self.hidden_pairs());
        warnings.extend_from_slice(&self.told);
        warnings
    }

    /// One warning for each of these pairs of this record.
    pub(crate) fn hidden_warnings(&self, pairs: &[HiddenPair]) -> Vec<Warning> {
        let time = |step: u64| self.times.get(step as usize).copied().unwrap_or(0.0);
        pairs.iter().map(|pair| of_hidden(pair, time(pair.first_step))).collect()
    }

    /// Replaces all warnings but those of hidden overlaps.
    pub(crate) fn tell(&mut self, mut warnings: Vec<Warning>) {
        // JSON has no infinite numbers.
        for warning in &mut warnings {
            warning.value = warning.value.min(f64::MAX);
        }
        self.told = warnings;
    }
}

/// Checks warnings that a file has beside those of hidden overlaps, for a run of these bodies: at
/// most one of each kind, so that their number is bounded.
///
/// # Errors
/// A message that names the warning, what was found and what was expected.
pub(super) fn check(told: &[Warning], bodies: &[String]) -> Result<(), String> {
    for (k, warning) in told.iter().enumerate() {
        let Warning { kind, names, time, value, count, .. } = warning;
        let at = |found: String| Err(format!("warnings[{k}] {found}"));
        let expected = match kind {
            WarningKind::Hidden => {
                return at("is of the kind hidden; expected these overlaps in the tensors hidden.…".into());
            }
            WarningKind::Overlap => 2,
            WarningKind::Joint => 1,
            WarningKind::Energy | WarningKind::NotConverged => 0,
        };
        if told[..k].iter().any(|before| before.kind == *kind) {
            return at(format!("is a second one of the kind {kind:?}; expected at most one of each"));
        }
        if names.len() != expected {
            return at(format!("of the kind {kind:?} has {} names; expected {expected}", names.len()));
        }
        let unknown = names.iter().find(|name| !bodies.contains(name));
        if let (WarningKind::Overlap, Some(name)) = (kind, unknown) {
            return at(format!("names {name:?}; expected bodies of the run"));
        }
        // A number that is not one is refused, too.
        if !(*time >= 0.0 && *value >= 0.0 && *count > 0) {
            return at(format!(
                "has the time {time}, the value {value} and the count {count}; expected none below 0, and a count from 1 on"
            ));
        }
    }
    Ok(())
}
