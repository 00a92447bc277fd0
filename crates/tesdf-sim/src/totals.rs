//! Sums over the steps of a run.
use std::time::Duration;

use crate::{Residual, StepReport};

/// Sums over the steps of a run.
#[derive(Clone, Debug, Default)]
pub(crate) struct Totals {
    pub(crate) steps: u64,
    pub(crate) contacts: usize,
    pub(crate) most: usize,
    pub(crate) deepest: f64,
    pub(crate) iterations: u64,
    pub(crate) unconverged: u64,
    /// Bodies that were asleep after the last step.
    pub(crate) asleep: usize,
    /// The first step that did not converge.
    pub(crate) first_unconverged: Option<u64>,
    /// The greatest of these steps.
    pub(crate) residual: Residual,
    pub(crate) detection: Duration,
    pub(crate) solution: Duration,
}

impl Totals {
    pub(crate) fn add(&mut self, report: &StepReport) {
        if !report.converged {
            self.first_unconverged.get_or_insert(self.steps);
        }
        self.steps += 1;
        self.contacts += report.contacts;
        self.most = self.most.max(report.contacts);
        self.deepest = self.deepest.max(-report.deepest.unwrap_or(0.0));
        self.iterations += u64::from(report.iterations);
        self.unconverged += u64::from(!report.converged);
        self.residual = self.residual.max(report.residual);
        self.asleep = report.asleep;
        self.detection += report.detection;
        self.solution += report.solution;
    }
}
