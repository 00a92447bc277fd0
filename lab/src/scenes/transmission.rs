//! A gearbox turns its output shaft at the ratio of each gear.
use std::f64::consts::TAU;

use serde::{Deserialize, Serialize};
use tesdf_sim::criterion::measure::{Checks, Hinge, Penetration, clearance_row, positive};
use tesdf_sim::criterion::{Criterion, Report, Rows, Tracker};
use tesdf_sim::{Drive, Mass, Motor, System};

/// A gearbox turns its output shaft at the ratio of each gear in turn, by contact alone, and not in
/// neutral.
///
/// The *transmission error* is the difference between the angle of the output shaft and the angle
/// that the input shaft and the ratio give, as a length along the pitch circle of the driven gear.
/// The penetration is measured by the exact clearance of all pairs, not by the detector of the run.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TransmissionCriterion {
    /// Name of the hinge of the input shaft.
    pub input: String,
    /// Name of the hinge of the output shaft. No other joint holds its body. Its motor, if it has
    /// one, is a load: a torque, or a brake that drives the velocity 0.
    pub output: String,
    /// The times in which a gear is engaged.
    pub gears: Vec<EngagedGear>,
    /// The times, s, from and to, in which the gearbox is in neutral.
    pub neutral: Vec<[f64; 2]>,
    /// Maximum difference between a measured ratio and the ratio, as a fraction of the ratio.
    #[serde(default = "a_thousandth")]
    pub max_ratio_error: f64,
    /// Minimum number of turns of the output shaft in each gear.
    pub min_turns: f64,
    /// Maximum number of turns of the output shaft in neutral, in each of the times.
    pub max_neutral_turns: f64,
    /// Maximum transmission error, peak to peak, m.
    pub max_transmission_error: f64,
    /// Maximum penetration, m.
    pub max_penetration: f64,
    /// Time between two measurements of the exact clearance, s.
    pub check_every: f64,
}

/// A time in which a gear is engaged.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct EngagedGear {
    /// Turns of the output shaft for each turn of the input shaft; negative when the two turn in
    /// opposite directions about their axes.
    pub ratio: f64,
    /// The time from which the motion is measured, s. The shift is complete by then.
    pub from: f64,
    /// The time until which the motion is measured, s.
    pub to: f64,
    /// Radius of the pitch circle of the driven gear, m.
    pub pitch_radius: f64,
}

fn a_thousandth() -> f64 {
    1e-3
}

/// Result of a transmission criterion.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct TransmissionReport {
    /// For each gear what was measured.
    pub gears: Vec<EngagedReport>,
    /// The turns of the input and the output shaft in each time in neutral.
    pub neutral: Vec<[f64; 2]>,
    /// The greatest penetration by the exact clearance, m; 0 when none was found.
    pub penetration: f64,
    /// Number of measurements of the exact clearance.
    pub measurements: usize,
    /// The requirements that the run did not meet; empty when it passed. Each begins with the name
    /// of the failure and a colon: `turns`, `ratio`, `transmission error`, `neutral` or
    /// `penetration`.
    pub failures: Vec<String>,
}

/// What was measured of a gear.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct EngagedReport {
    /// Turns of the output shaft.
    pub turns: f64,
    /// Turns of the output shaft for each turn of the input shaft; `None` when that did not turn.
    pub ratio: Option<f64>,
    /// The transmission error, peak to peak, m.
    pub transmission_error: f64,
}

impl Criterion for TransmissionCriterion {
    const NAME: &str = "transmission";
    type Tracker = TransmissionTracker;

    /// Checks the values, that the joints are hinges, and that nothing but a load acts on the
    /// output shaft. Returns the name of its body.
    fn check(&self, system: &System) -> Result<Vec<String>, String> {
        positive([
            ("max_ratio_error", self.max_ratio_error),
            ("min_turns", self.min_turns),
            ("max_neutral_turns", self.max_neutral_turns),
            ("max_transmission_error", self.max_transmission_error),
            ("max_penetration", self.max_penetration),
            ("check_every", self.check_every),
        ])?;
        if self.gears.is_empty() {
            return Err("gears is empty; expected at least one".into());
        }
        let gears = self.gears.iter().map(|gear| ("gears", [gear.from, gear.to]));
        for (key, [from, to]) in gears.chain(self.neutral.iter().map(|&times| ("neutral", times))) {
            if !(from >= 0.0 && to > from && to.is_finite()) {
                return Err(format!("{key}: from {from} to {to} s; expected a later end than beginning"));
            }
        }
        for EngagedGear { ratio, pitch_radius, .. } in &self.gears {
            positive([("pitch_radius", *pitch_radius)])?;
            if !(*ratio != 0.0 && ratio.is_finite()) {
                return Err(format!("ratio is {ratio}; expected a finite number other than 0"));
            }
        }
        let [input, output] = self.find(system)?;
        let body = &system.bodies()[output.child(system)];
        if !matches!(body.mass, Mass::Free(_)) {
            return Err(format!("body {} is not free; no contact can turn it", body.name));
        }
        if input.child(system) == output.child(system) {
            return Err(format!("both hinges turn body {}; expected two shafts", body.name));
        }
        if let Some(other) = output.others(system).next() {
            return Err(format!(
                "joint {other} holds body {} too; expected the hinge {} alone",
                body.name, self.output
            ));
        }
        match output.motor(system) {
            None | Some(Motor { drive: Drive::Force(_) | Drive::Velocity(0.0), .. }) => {
                Ok(vec![body.name.clone()])
            }
            Some(Motor { drive, .. }) => Err(format!(
                "the motor of joint {} has the drive {drive:?}; expected none, a torque, or the velocity 0 of a brake",
                self.output
            )),
        }
    }

    fn track(&self, system: &System) -> Result<TransmissionTracker, String> {
        TransmissionTracker::new(self, system)
    }
}

impl TransmissionCriterion {
    fn find(&self, system: &System) -> Result<[Hinge; 2], String> {
        Ok([Hinge::new(system, &self.input)?, Hinge::new(system, &self.output)?])
    }
}

/// Records the angles of two shafts during a run.
#[derive(Clone, Debug)]
pub struct TransmissionTracker {
    criterion: TransmissionCriterion,
    hinges: [Hinge; 2],
    time: f64,
    gears: Vec<Engaged>,
    /// Angles of input and output in each time in neutral, rad.
    neutral: Vec<[f64; 2]>,
    checks: Checks,
    penetration: Penetration,
}

/// Angles of input and output while a gear is engaged, rad, and the bounds of the transmission
/// error, rad of the output.
#[derive(Clone, Copy, Debug, Default)]
struct Engaged {
    angles: [f64; 2],
    error: [f64; 2],
}

impl TransmissionTracker {
    /// A tracker that starts from the current state of `system`.
    ///
    /// # Errors
    /// The same errors as [`TransmissionCriterion::check`].
    pub fn new(criterion: &TransmissionCriterion, system: &System) -> Result<Self, String> {
        criterion.check(system)?;
        Ok(Self {
            hinges: criterion.find(system)?,
            time: 0.0,
            gears: vec![Engaged::default(); criterion.gears.len()],
            neutral: vec![[0.0; 2]; criterion.neutral.len()],
            checks: Checks::new(criterion.check_every),
            penetration: Penetration::default(),
            criterion: criterion.clone(),
        })
    }
}

impl Tracker for TransmissionTracker {
    type Report = TransmissionReport;

    fn observe(&mut self, system: &System, time_step: f64) {
        let begin = self.time;
        self.time += time_step;
        let end = self.time;
        let is_within = |from: f64, to: f64| begin >= from - 1e-9 && end <= to + 1e-9;
        let [input, output] = &mut self.hinges;
        let turned = [input.turned(system, time_step), output.turned(system, time_step)];
        for (gear, found) in self.criterion.gears.iter().zip(&mut self.gears) {
            if is_within(gear.from, gear.to) {
                found.angles = [0, 1].map(|k| found.angles[k] + turned[k]);
                let error = found.angles[1] - gear.ratio * found.angles[0];
                found.error = [found.error[0].min(error), found.error[1].max(error)];
            }
        }
        for ([from, to], angles) in self.criterion.neutral.iter().zip(&mut self.neutral) {
            if is_within(*from, *to) {
                *angles = [0, 1].map(|k| angles[k] + turned[k]);
            }
        }
        if self.checks.due(time_step) {
            self.penetration.measure_all(system, 1e-2 * self.criterion.max_penetration);
        }
    }

    fn report(&self, _: &System) -> TransmissionReport {
        let TransmissionCriterion { max_ratio_error, min_turns, max_neutral_turns, .. } = self.criterion;
        let allowed_error = self.criterion.max_transmission_error;
        let mut failures = self.penetration.failures(self.criterion.max_penetration);
        let mut demand = |met: bool, text: String| {
            if !met {
                failures.push(text);
            }
        };
        let mut gears = Vec::new();
        for (k, (gear, found)) in self.criterion.gears.iter().zip(&self.gears).enumerate() {
            let number = k + 1;
            let [input, output] = found.angles.map(|angle| angle / TAU);
            let ratio = (input != 0.0).then_some(output / input);
            let transmission_error = gear.pitch_radius * (found.error[1] - found.error[0]);
            let forward = output * (gear.ratio * input).signum();
            demand(
                forward >= min_turns,
                format!(
                    "turns: {forward:.4} turns of the output in gear {number}; expected at least {min_turns}"
                ),
            );
            demand(
                ratio.is_some_and(|ratio| (ratio / gear.ratio - 1.0).abs() <= max_ratio_error),
                match ratio {
                    Some(ratio) => format!(
                        "ratio: {ratio:.6} in gear {number}; expected {:.6} within a fraction of {max_ratio_error}",
                        gear.ratio
                    ),
                    None => format!("ratio: the input does not turn in gear {number}"),
                },
            );
            demand(
                transmission_error <= allowed_error,
                format!(
                    "transmission error: {transmission_error:.3e} m from peak to peak in gear {number}; expected at most \
                     {allowed_error:.3e} m"
                ),
            );
            gears.push(EngagedReport { turns: output, ratio, transmission_error });
        }
        let neutral: Vec<[f64; 2]> = self.neutral.iter().map(|angles| angles.map(|a| a / TAU)).collect();
        for (k, [input, output]) in neutral.iter().enumerate() {
            demand(
                output.abs() <= max_neutral_turns && input.abs() > output.abs(),
                format!(
                    "neutral: {output:.5} turns of the output and {input:.5} of the input, the {}. time; expected at most \
                     {max_neutral_turns} of the output, and more of the input",
                    k + 1
                ),
            );
        }
        TransmissionReport {
            gears,
            neutral,
            penetration: self.penetration.depth,
            measurements: self.penetration.measurements,
            failures,
        }
    }
}

impl Report for TransmissionReport {
    fn failures(&mut self) -> &mut Vec<String> {
        &mut self.failures
    }

    fn rows(&self) -> Rows {
        let TransmissionReport { gears, neutral, penetration, measurements, .. } = self;
        let of_gear = |gear: &EngagedReport| {
            let ratio = gear.ratio.map_or("none".into(), |ratio| format!("{ratio:.6}"));
            format!("{ratio} in {:.2} turns, error {:.1} µm", gear.turns, 1e6 * gear.transmission_error)
        };
        let mut rows: Vec<_> = gears.iter().map(|gear| ("ratio", of_gear(gear))).collect();
        rows.extend(neutral.iter().map(|[input, output]| {
            ("neutral", format!("{output:.5} turns of the output, {input:.2} of the input"))
        }));
        rows.push(clearance_row(*penetration, *measurements));
        rows
    }
}
