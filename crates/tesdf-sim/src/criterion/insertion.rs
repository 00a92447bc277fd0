//! A body slides into another body and seats on its floor.
use serde::{Deserialize, Serialize};
use tesdf::base::elementary;
use tesdf::collide::{InstanceId, Pose};
use tesdf::glam::DVec3;

use super::measure::{Checks, Penetration, body, clearance_row, free_body, positive, unit};
use super::{Criterion, Report, Rows, Tracker};
use crate::{MassProperties, System};

/// The body moves along the axis until it seats, stays within its clearance on the way, and comes
/// to rest.
///
/// The penetration is measured by the exact clearance of the two bodies, not by the detector of the
/// run.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct InsertionCriterion {
    /// Name of the body that moves.
    pub body: String,
    /// Name of the body that it moves into.
    pub into: String,
    /// Direction of the expected motion: a unit vector in the world frame.
    pub axis: [f64; 3],
    /// Travel along the axis until the body seats, m.
    pub depth: f64,
    /// Maximum difference between the travel of the seated body and the depth, m.
    pub depth_tolerance: f64,
    /// Time until which the body must seat, s.
    pub within: f64,
    /// Time from which the body must be at rest, s.
    pub settled: f64,
    /// Clearance between the bodies, m.
    pub clearance: f64,
    /// Maximum penetration, as a fraction of the clearance.
    #[serde(default = "a_fifth")]
    pub max_penetration: f64,
    /// Maximum angle between the axis of the body and its direction at the beginning, rad. Turns
    /// about the axis do not count.
    pub max_tilt: f64,
    /// Maximum distance that the centre of mass moves across the axis, m.
    pub max_offset: f64,
    /// Maximum kinetic energy of the settled body, as a fraction of the energy that the whole
    /// insertion releases.
    #[serde(default = "at_rest")]
    pub max_jitter: f64,
    /// Maximum energy that the body gains, kinetic and potential together, as a fraction of the
    /// energy that the whole insertion releases.
    #[serde(default = "no_gain")]
    pub max_energy_gain: f64,
    /// Time between two measurements of the exact clearance, s.
    pub check_every: f64,
}

fn a_fifth() -> f64 {
    0.2
}

/// A seated peg without friction still slides from wall to wall in its play, with 1e-4 of the
/// energy where it leans by 5°. A body that falls by 10 mm and keeps 1e-3 of its energy moves at 14
/// mm/s.
fn at_rest() -> f64 {
    1e-3
}

/// Allows for rounding and for the energy that the springs of the contacts store.
fn no_gain() -> f64 {
    1e-3
}

/// Result of an insertion criterion.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct InsertionReport {
    /// Travel of the centre of mass along the axis at the end, m.
    pub travel: f64,
    /// Time at which the body first was at its depth, s; `None` when it never was.
    pub seated_at: Option<f64>,
    /// The greatest travel at any step, m.
    pub farthest: f64,
    /// The greatest distance that the centre of mass moved across the axis, m.
    pub offset: f64,
    /// The greatest angle between the axis of the body and its direction at the beginning, rad.
    pub tilt: f64,
    /// The greatest penetration by the exact clearance, m; 0 when none was found.
    pub penetration: f64,
    /// Number of measurements of the exact clearance.
    pub measurements: usize,
    /// The greatest kinetic energy of the settled body, J.
    pub jitter: f64,
    /// The most energy that the body had gained at a step, J.
    pub energy_gain: f64,
    /// The requirements that the run did not meet; empty when it passed. Each begins with the name
    /// of the failure and a colon: `sticking`, `tunnelling`, `penetration`, `jitter` or
    /// `energy gain`.
    pub failures: Vec<String>,
}

impl Criterion for InsertionCriterion {
    const NAME: &str = "insertion";
    type Tracker = InsertionTracker;

    /// Checks the values, and that the two bodies exist and the first one is free.
    fn check(&self, system: &System) -> Result<Vec<String>, String> {
        unit(self.axis)?;
        positive([
            ("depth", self.depth),
            ("depth_tolerance", self.depth_tolerance),
            ("within", self.within),
            ("settled", self.settled),
            ("clearance", self.clearance),
            ("max_penetration", self.max_penetration),
            ("max_tilt", self.max_tilt),
            ("max_offset", self.max_offset),
            ("max_jitter", self.max_jitter),
            ("max_energy_gain", self.max_energy_gain),
            ("check_every", self.check_every),
        ])?;
        self.find(system).map(|_| Vec::new())
    }

    fn track(&self, system: &System) -> Result<InsertionTracker, String> {
        InsertionTracker::new(self, system)
    }
}

impl InsertionCriterion {
    fn find(&self, system: &System) -> Result<(usize, MassProperties, InstanceId), String> {
        let (moving, mass) = free_body(system, &self.body, "stop")?;
        let into = body(system, &self.into)?;
        match moving == into {
            true => Err(format!("body {} cannot move into itself", self.body)),
            false => Ok((moving, mass, system.bodies()[into].instance)),
        }
    }
}

/// Records the way of one body into another during a run.
#[derive(Clone, Debug)]
pub struct InsertionTracker {
    criterion: InsertionCriterion,
    axis: DVec3,
    body: usize,
    into: InstanceId,
    mass: MassProperties,
    /// Energy at the beginning, J.
    energy: f64,
    /// Energy that the whole insertion releases, J.
    released: f64,
    start: Pose,
    time: f64,
    settled: bool,
    checks: Checks,
    penetration: Penetration,
    /// What was found so far, without the penetration and failures.
    found: InsertionReport,
}

impl InsertionTracker {
    /// A tracker that starts from the current state of `system`.
    ///
    /// # Errors
    /// The same errors as [`InsertionCriterion::check`].
    pub fn new(criterion: &InsertionCriterion, system: &System) -> Result<Self, String> {
        criterion.check(system)?;
        let (body, mass, into) = criterion.find(system)?;
        let axis = unit(criterion.axis)?;
        Ok(Self {
            criterion: criterion.clone(),
            axis,
            body,
            into,
            mass,
            energy: system.kinetic_energy() + system.potential_energy(),
            released: mass.mass * system.gravity.dot(axis).abs() * criterion.depth,
            start: system.states()[body].pose,
            time: 0.0,
            settled: false,
            checks: Checks::new(criterion.check_every),
            penetration: Penetration::default(),
            found: InsertionReport {
                travel: 0.0,
                seated_at: None,
                farthest: 0.0,
                offset: 0.0,
                tilt: 0.0,
                penetration: 0.0,
                measurements: 0,
                jitter: 0.0,
                energy_gain: 0.0,
                failures: Vec::new(),
            },
        })
    }
}

impl Tracker for InsertionTracker {
    type Report = InsertionReport;

    fn observe(&mut self, system: &System, time_step: f64) {
        let InsertionCriterion { depth, depth_tolerance, settled, .. } = self.criterion;
        self.time += time_step;
        let pose = system.states()[self.body].pose;
        let moved = pose.to_world(self.mass.center) - self.start.to_world(self.mass.center);
        let turned = pose.rotation * (self.start.rotation.inverse() * self.axis);
        let kinetic = system.kinetic_energy();
        let found = &mut self.found;
        found.travel = moved.dot(self.axis);
        found.farthest = found.farthest.max(found.travel);
        found.offset = found.offset.max(moved.reject_from_normalized(self.axis).length());
        // The arc sine keeps small angles, which the arc cosine rounds away.
        let sine = elementary::asin(turned.cross(self.axis).length().min(1.0));
        let tilt = if turned.dot(self.axis) < 0.0 { std::f64::consts::PI - sine } else { sine };
        found.tilt = found.tilt.max(tilt);
        found.energy_gain = found.energy_gain.max(kinetic + system.potential_energy() - self.energy);
        if found.seated_at.is_none() && found.travel >= depth - depth_tolerance {
            found.seated_at = Some(self.time);
        }
        if self.time >= settled - 1e-9 {
            self.settled = true;
            found.jitter = found.jitter.max(kinetic);
        }
        if self.checks.due(time_step) {
            let pair = [system.bodies()[self.body].instance, self.into];
            self.penetration.measure(system, &[pair], 1e-3 * self.criterion.clearance);
        }
    }

    fn report(&self, _: &System) -> InsertionReport {
        let mut report = InsertionReport {
            penetration: self.penetration.depth,
            measurements: self.penetration.measurements,
            ..self.found.clone()
        };
        let InsertionReport { travel, seated_at, farthest, offset, tilt, .. } = report;
        let InsertionCriterion { depth, depth_tolerance, within, max_tilt, max_offset, .. } = self.criterion;
        let mut demand = |met: bool, text: String| {
            if !met {
                report.failures.push(text);
            }
        };
        demand(
            seated_at.is_some_and(|time| time <= within + 1e-9) && travel >= depth - depth_tolerance,
            match seated_at {
                None => {
                    format!("sticking: {farthest:.3e} m of travel; expected {depth:.3e} m within {within} s")
                }
                Some(time) => format!(
                    "sticking: seated at {time:.4} s and {travel:.3e} m of travel at the end; expected {depth:.3e} m \
                     within {within} s"
                ),
            },
        );
        demand(
            farthest <= depth + depth_tolerance,
            format!("tunnelling: {farthest:.3e} m of travel; the floor is at {depth:.3e} m"),
        );
        demand(
            offset <= max_offset,
            format!(
                "tunnelling: the body moves across the axis by {offset:.3e} m; expected at most {max_offset:.3e} m"
            ),
        );
        demand(
            tilt <= max_tilt,
            format!("tunnelling: the body tilts by {tilt:.3e} rad; expected at most {max_tilt:.3e} rad"),
        );
        let allowed = self.criterion.max_penetration * self.criterion.clearance;
        self.penetration.failures(allowed).into_iter().for_each(|text| demand(false, text));
        let (jitter, allowed) = (report.jitter, self.criterion.max_jitter * self.released);
        demand(
            self.settled && jitter <= allowed,
            match self.settled {
                true => format!(
                    "jitter: {jitter:.3e} J after {} s; expected at most {allowed:.3e} J",
                    self.criterion.settled
                ),
                false => format!("jitter: the run ends before {} s", self.criterion.settled),
            },
        );
        let (gain, allowed) = (report.energy_gain, self.criterion.max_energy_gain * self.released);
        demand(gain <= allowed, format!("energy gain: {gain:.3e} J; expected at most {allowed:.3e} J"));
        report
    }
}

impl Report for InsertionReport {
    fn failures(&mut self) -> &mut Vec<String> {
        &mut self.failures
    }

    fn rows(&self) -> Rows {
        let seated = self.seated_at.map_or("not seated".into(), |time| format!("seated at {time:.4} s"));
        vec![
            ("insertion", format!("{:.4} mm, {seated}", self.travel * 1e3)),
            (
                "play",
                format!(
                    "at most {:.1} µm across the axis and {:.2} mrad of tilt",
                    self.offset * 1e6,
                    self.tilt * 1e3
                ),
            ),
            clearance_row(self.penetration, self.measurements),
            (
                "energy gain",
                format!("{:.2e} J; {:.2e} J kinetic when settled", self.energy_gain, self.jitter),
            ),
        ]
    }
}
