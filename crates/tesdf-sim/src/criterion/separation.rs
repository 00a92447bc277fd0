//! Bodies that begin deep in each other come apart.
use serde::{Deserialize, Serialize};

use super::measure::{Penetration, positive};
use super::{Criterion, Report, Rows, Tracker};
use crate::{Mass, System};

/// Bodies that overlap come apart within a time, and without a kick.
///
/// The penetration of all pairs is measured after each step by the exact clearance, not by the
/// detector of the run.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SeparationCriterion {
    /// Pairs of a time, s, and the maximum penetration from then on, m.
    pub limits: Vec<[f64; 2]>,
    /// Maximum kinetic energy, as a fraction of that which all free bodies would have if they had
    /// fallen freely. Corrections of the poses lift bodies without giving them energy, so the
    /// potential energy is no measure.
    #[serde(default = "as_in_free_fall")]
    pub max_kinetic_energy: f64,
    /// Error of the exact clearance, m.
    #[serde(default = "tenth_of_a_micrometre")]
    pub tolerance: f64,
}

/// Allows for the energy that the springs of the contacts store.
fn as_in_free_fall() -> f64 {
    1.001
}

fn tenth_of_a_micrometre() -> f64 {
    1e-7
}

/// Result of a separation criterion.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct SeparationReport {
    /// The greatest penetration of two bodies after each step by the exact clearance, m; 0 when
    /// none was found. The first value is that of the beginning.
    pub penetration: Vec<f64>,
    /// The greatest kinetic energy, as a fraction of that of free fall.
    pub kinetic_energy: f64,
    /// The requirements that the run did not meet; empty when it passed. Each begins with the name
    /// of the failure and a colon: `penetration` or `kick`.
    pub failures: Vec<String>,
}

impl Criterion for SeparationCriterion {
    const NAME: &str = "separation";
    type Tracker = SeparationTracker;

    /// Checks the values.
    fn check(&self, system: &System) -> Result<Vec<String>, String> {
        positive([("max_kinetic_energy", self.max_kinetic_energy), ("tolerance", self.tolerance)])?;
        for (k, [time, depth]) in self.limits.iter().enumerate() {
            if !(time.is_finite() && *time >= 0.0 && depth.is_finite() && *depth > 0.0) {
                return Err(format!(
                    "limits: entry {} is [{time}, {depth}]; expected a time from 0 on and a positive depth",
                    k + 1
                ));
            }
        }
        match (self.limits.is_empty(), system.gravity.length() > 0.0) {
            (true, _) => Err("limits is empty; expected at least one pair of a time and a depth".into()),
            (_, false) => Err("gravity is 0; without it there is no energy to compare with".into()),
            _ => Ok(Vec::new()),
        }
    }

    fn track(&self, system: &System) -> Result<SeparationTracker, String> {
        SeparationTracker::new(self, system)
    }
}

/// Records the penetration of all pairs during a run.
#[derive(Clone, Debug)]
pub struct SeparationTracker {
    criterion: SeparationCriterion,
    time: f64,
    /// For each step from the beginning on: its time and what was measured.
    measured: Vec<(f64, Penetration)>,
    kinetic_energy: f64,
}

impl SeparationTracker {
    /// A tracker that starts from the current state of `system`.
    ///
    /// # Errors
    /// The same errors as [`SeparationCriterion::check`].
    pub fn new(criterion: &SeparationCriterion, system: &System) -> Result<Self, String> {
        criterion.check(system)?;
        let criterion = criterion.clone();
        let mut tracker = Self { criterion, time: 0.0, measured: Vec::new(), kinetic_energy: 0.0 };
        tracker.measure(system);
        Ok(tracker)
    }

    fn measure(&mut self, system: &System) {
        let mut penetration = Penetration::default();
        penetration.measure_all(system, self.criterion.tolerance);
        self.measured.push((self.time, penetration));
    }
}

impl Tracker for SeparationTracker {
    type Report = SeparationReport;

    fn observe(&mut self, system: &System, time_step: f64) {
        self.time += time_step;
        let masses = system.bodies().iter().map(|body| match body.mass {
            Mass::Free(mass) => mass.mass,
            Mass::Fixed | Mass::Kinematic => 0.0,
        });
        let speed = system.gravity.length() * self.time;
        let falling = 0.5 * masses.sum::<f64>() * speed * speed;
        self.kinetic_energy = self.kinetic_energy.max(system.kinetic_energy() / falling);
        self.measure(system);
    }

    fn report(&self, _: &System) -> SeparationReport {
        let mut report = SeparationReport {
            penetration: self.measured.iter().map(|(_, found)| found.depth).collect(),
            kinetic_energy: self.kinetic_energy,
            failures: Vec::new(),
        };
        for &[from, allowed] in &self.criterion.limits {
            let mut since = Penetration::default();
            for (_, found) in self.measured.iter().filter(|(time, _)| *time >= from - 1e-9) {
                since.depth = since.depth.max(found.depth);
                since.measurements += found.measurements;
                since.unmeasured.extend_from_slice(&found.unmeasured);
            }
            let failures = since.failures(allowed).into_iter();
            report.failures.extend(failures.map(|text| format!("{text}, from {from} s on")));
        }
        let (found, allowed) = (self.kinetic_energy, self.criterion.max_kinetic_energy);
        if found > allowed {
            report.failures.push(format!(
                "kick: {found:.3} of the kinetic energy of free fall; expected at most {allowed:.3}"
            ));
        }
        report
    }
}

impl Report for SeparationReport {
    fn failures(&mut self) -> &mut Vec<String> {
        &mut self.failures
    }

    fn rows(&self) -> Rows {
        let micrometres = |depth: &f64| format!("{:.1}", 1e6 * depth);
        let found = &self.penetration;
        let shown: Vec<String> =
            found.iter().step_by(found.len().div_ceil(8).max(1)).map(micrometres).collect();
        let last = found.last().map_or("none".into(), micrometres);
        vec![
            ("separation", format!("{} µm deep over the run, {last} µm at the end", shown.join(", "))),
            ("kinetic", format!("at most {:.3} of the energy of free fall", self.kinetic_energy)),
        ]
    }
}
