//! A gear turns another one.
use std::f64::consts::TAU;

use serde::{Deserialize, Serialize};
use tesdf::collide::InstanceId;

use super::measure::{Checks, Hinge, Penetration, clearance_row, positive};
use super::{Criterion, Report, Rows, Tracker};
use crate::{Drive, Mass, Motor, System};

/// A gear on a hinge turns a gear on another hinge at the ratio of their teeth, by contact alone.
///
/// The *transmission error* is the difference between the angle of the driven gear and the angle
/// that the driver and the ratio give, as a length along the pitch circle of the driven gear. The
/// penetration is measured by the exact clearance of the two gears, not by the detector of the run.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct GearRatioCriterion {
    /// Name of the hinge of the driver.
    pub driver: String,
    /// Name of the hinge of the driven gear. It has no motor, or one that drives by a torque: the
    /// load.
    pub driven: String,
    /// Turns of the driven hinge for each turn of the driver; negative when the two turn in
    /// opposite directions about their axes.
    pub ratio: f64,
    /// Maximum difference between the measured ratio and the ratio, as a fraction of the ratio.
    #[serde(default = "a_thousandth")]
    pub max_ratio_error: f64,
    /// Minimum number of turns of the driven gear from `settled` to the end, in the direction that
    /// the driver and the ratio give.
    pub min_turns: f64,
    /// Time from which the motion is measured, s. The motor may start before, and the flanks may
    /// meet.
    pub settled: f64,
    /// Radius of the pitch circle of the driven gear, m.
    pub pitch_radius: f64,
    /// Maximum transmission error, peak to peak, m.
    pub max_transmission_error: f64,
    /// Maximum penetration, m.
    pub max_penetration: f64,
    /// Maximum difference between the speeds of the two pitch circles, as a fraction of the speed
    /// of the driver's, at any step.
    pub max_speed_error: f64,
    /// Time between two measurements of the exact clearance, s.
    pub check_every: f64,
}

fn a_thousandth() -> f64 {
    1e-3
}

/// Result of a gear ratio criterion. Angles and speeds count from the time `settled` on.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct GearRatioReport {
    /// Turns of the driver about the axis of its hinge.
    pub driver_turns: f64,
    /// Turns of the driven gear about the axis of its hinge.
    pub driven_turns: f64,
    /// Driven turns for each turn of the driver; `None` when the driver did not turn.
    pub ratio: Option<f64>,
    /// The transmission error, peak to peak, m.
    pub transmission_error: f64,
    /// The greatest difference between the speeds of the two pitch circles, as a fraction of the
    /// speed of the driver's.
    pub speed_error: f64,
    /// The greatest penetration by the exact clearance, m; 0 when none was found.
    pub penetration: f64,
    /// Number of measurements of the exact clearance.
    pub measurements: usize,
    /// The requirements that the run did not meet; empty when it passed. Each begins with the name
    /// of the failure and a colon: `turns`, `ratio`, `transmission error`, `speed`, `penetration`
    /// or `load`.
    pub failures: Vec<String>,
}

impl Criterion for GearRatioCriterion {
    const NAME: &str = "gear_ratio";
    type Tracker = GearRatioTracker;

    /// Checks the values, that the joints are hinges, and that nothing but a load acts on the
    /// driven one. Returns the name of the body of the driven gear.
    fn check(&self, system: &System) -> Result<Vec<String>, String> {
        if !(self.ratio != 0.0 && self.ratio.is_finite()) {
            return Err(format!("ratio is {}; expected a finite number other than 0", self.ratio));
        }
        positive([
            ("max_ratio_error", self.max_ratio_error),
            ("min_turns", self.min_turns),
            ("settled", self.settled),
            ("pitch_radius", self.pitch_radius),
            ("max_transmission_error", self.max_transmission_error),
            ("max_penetration", self.max_penetration),
            ("max_speed_error", self.max_speed_error),
            ("check_every", self.check_every),
        ])?;
        let [_, driven] = self.find(system)?;
        Ok(vec![system.bodies()[driven.child(system)].name.clone()])
    }

    fn track(&self, system: &System) -> Result<GearRatioTracker, String> {
        GearRatioTracker::new(self, system)
    }
}

impl GearRatioCriterion {
    /// The two hinges.
    fn find(&self, system: &System) -> Result<[Hinge; 2], String> {
        let hinges @ [driver, driven] =
            &[Hinge::new(system, &self.driver)?, Hinge::new(system, &self.driven)?];
        let body = &system.bodies()[driven.child(system)];
        if driver.child(system) == driven.child(system) {
            return Err(format!("both hinges turn body {}; expected two gears", body.name));
        }
        if !matches!(body.mass, Mass::Free(_)) {
            return Err(format!("body {} is not free; no contact can turn it", body.name));
        }
        if let Some(other) = driven.others(system).next() {
            return Err(format!(
                "joint {other} holds body {} too; expected the hinge {} alone",
                body.name, self.driven
            ));
        }
        match driven.motor(system) {
            None | Some(Motor { drive: Drive::Force(_), .. }) => Ok(hinges.clone()),
            Some(Motor { drive, .. }) => Err(format!(
                "the motor of joint {} has the drive {drive:?}; expected none, or the torque of the load",
                self.driven
            )),
        }
    }
}

/// Records the angles of two gears during a run.
#[derive(Clone, Debug)]
pub struct GearRatioTracker {
    criterion: GearRatioCriterion,
    hinges: [Hinge; 2],
    pair: [InstanceId; 2],
    /// Torque of the load, N m.
    load: f64,
    /// Angles of the hinges since `settled`, rad; `None` before.
    angles: Option<[f64; 2]>,
    /// Bounds of the transmission error, rad of the driven gear.
    error: [f64; 2],
    /// The greatest difference of speeds, and the greatest speed of the driver, rad/s of the driven
    /// gear.
    speeds: [f64; 2],
    time: f64,
    checks: Checks,
    penetration: Penetration,
}

impl GearRatioTracker {
    /// A tracker that starts from the current state of `system`.
    ///
    /// # Errors
    /// The same errors as [`GearRatioCriterion::check`].
    pub fn new(criterion: &GearRatioCriterion, system: &System) -> Result<Self, String> {
        criterion.check(system)?;
        let hinges = criterion.find(system)?;
        let load = match hinges[1].motor(system) {
            Some(Motor { drive: Drive::Force(torque), .. }) => torque,
            _ => 0.0,
        };
        Ok(Self {
            pair: hinges.each_ref().map(|hinge| system.bodies()[hinge.child(system)].instance),
            hinges,
            load,
            angles: None,
            error: [0.0; 2],
            speeds: [0.0; 2],
            time: 0.0,
            checks: Checks::new(criterion.check_every),
            penetration: Penetration::default(),
            criterion: criterion.clone(),
        })
    }
}

impl Tracker for GearRatioTracker {
    type Report = GearRatioReport;

    fn observe(&mut self, system: &System, time_step: f64) {
        self.time += time_step;
        let [driver, driven] = self.hinges.each_ref().map(|hinge| hinge.speed(system));
        let turned = self.hinges.each_mut().map(|hinge| hinge.turned(system, time_step));
        if self.checks.due(time_step) {
            self.penetration.measure(system, &[self.pair], 1e-2 * self.criterion.max_penetration);
        }
        if self.time < self.criterion.settled - 1e-9 {
            return;
        }
        let ratio = self.criterion.ratio;
        let angles = self.angles.map_or([0.0; 2], |angles| [0, 1].map(|k| angles[k] + turned[k]));
        self.angles = Some(angles);
        let error = angles[1] - ratio * angles[0];
        self.error = [self.error[0].min(error), self.error[1].max(error)];
        let expected = ratio * driver;
        self.speeds = [self.speeds[0].max((driven - expected).abs()), self.speeds[1].max(expected.abs())];
    }

    fn report(&self, _: &System) -> GearRatioReport {
        let GearRatioCriterion { ratio, min_turns, settled, pitch_radius, .. } = self.criterion;
        let [driver_turns, driven_turns] = self.angles.unwrap_or_default().map(|angle| angle / TAU);
        let transmission_error = pitch_radius * (self.error[1] - self.error[0]);
        let speed_error = if self.speeds[1] > 0.0 { self.speeds[0] / self.speeds[1] } else { 0.0 };
        let mut failures = self.penetration.failures(self.criterion.max_penetration);
        let mut demand = |met: bool, text: String| {
            if !met {
                failures.push(text);
            }
        };
        let forward = driven_turns * (ratio * driver_turns).signum();
        demand(
            forward >= min_turns,
            format!(
                "turns: {forward:.4} turns of the driven gear after {settled} s; expected at least {min_turns}"
            ),
        );
        let measured = (driver_turns != 0.0).then_some(driven_turns / driver_turns);
        let allowed = self.criterion.max_ratio_error;
        demand(
            measured.is_some_and(|measured| (measured / ratio - 1.0).abs() <= allowed),
            match measured {
                Some(measured) => {
                    format!("ratio: {measured:.6}; expected {ratio:.6} within a fraction of {allowed}")
                }
                None => "ratio: the driver does not turn".into(),
            },
        );
        let allowed = self.criterion.max_transmission_error;
        demand(
            transmission_error <= allowed,
            format!(
                "transmission error: {transmission_error:.3e} m from peak to peak; expected at most {allowed:.3e} m"
            ),
        );
        let allowed = self.criterion.max_speed_error;
        demand(
            speed_error <= allowed,
            format!(
                "speed: the driven gear differs by {speed_error:.4} of the driver's speed; expected at most {allowed}"
            ),
        );
        demand(
            self.load * driven_turns <= 0.0,
            format!("load: the torque of {} N m on the driven gear drives it", self.load),
        );
        GearRatioReport {
            driver_turns,
            driven_turns,
            ratio: measured,
            transmission_error,
            speed_error,
            penetration: self.penetration.depth,
            measurements: self.penetration.measurements,
            failures,
        }
    }
}

impl Report for GearRatioReport {
    fn failures(&mut self) -> &mut Vec<String> {
        &mut self.failures
    }

    fn rows(&self) -> Rows {
        let ratio = self.ratio.map_or("none".into(), |ratio| format!("{ratio:.6}"));
        vec![
            (
                "gear ratio",
                format!("{ratio}, {:.4} turns for {:.4} of the driver", self.driven_turns, self.driver_turns),
            ),
            (
                "transmission",
                format!(
                    "error {:.2} µm peak to peak, {:.2} % of the speed",
                    self.transmission_error * 1e6,
                    100.0 * self.speed_error
                ),
            ),
            clearance_row(self.penetration, self.measurements),
        ]
    }
}
