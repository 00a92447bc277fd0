//! Fingers lift a body and hold it.
use serde::{Deserialize, Serialize};
use tesdf::collide::{InstanceId, Pose};
use tesdf::glam::DVec3;

use super::measure::{Checks, Penetration, body, clearance_row, free_body, positive, unit};
use super::{Criterion, Report, Rows, Tracker};
use crate::joint::{relative, rotation_between};
use crate::{Mass, MassProperties, State, System};

/// Fingers lift a body by a height, by friction alone, and hold it without creep.
///
/// The penetration is measured by the exact clearance of the body and each finger, not by the
/// detector of the run.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LiftCriterion {
    /// Name of the body that is lifted. No joint and no script may drive it.
    pub body: String,
    /// Names of the bodies that hold it.
    pub fingers: Vec<String>,
    /// Direction of the lift: a unit vector in the world frame.
    #[serde(default = "up")]
    pub axis: [f64; 3],
    /// Height by which the centre of mass rises along the axis, m.
    pub height: f64,
    /// Maximum difference between the height and that of the held body, m.
    pub height_tolerance: f64,
    /// Time from which the body is held at its height until the end of the run, s.
    pub held_from: f64,
    /// Maximum speed, m/s, at which a point of the held body creeps relative to a finger: its
    /// greatest distance from where it was at `held_from`, divided by the time from then to the
    /// end.
    #[serde(default = "no_creep")]
    pub max_creep: f64,
    /// Maximum penetration, m.
    pub max_penetration: f64,
    /// Maximum speed of a point of the held body relative to a finger at any step, m/s.
    #[serde(default = "at_rest")]
    pub max_jitter: f64,
    /// Maximum energy that the bodies gain while they hold, kinetic and potential together, as a
    /// fraction of the work that lifts the body.
    #[serde(default = "no_gain")]
    pub max_energy_gain: f64,
    /// Time between two measurements of the exact clearance, s.
    pub check_every: f64,
}

fn up() -> [f64; 3] {
    [0.0, 0.0, 1.0]
}

fn no_creep() -> f64 {
    1e-5
}

/// A body that moves at 0.1 mm/s and turns back each step of 5 ms moves by 0.5 µm.
fn at_rest() -> f64 {
    1e-4
}

/// Allows for rounding, and for the creep that the criterion allows.
fn no_gain() -> f64 {
    1e-3
}

/// Result of a lift criterion.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct LiftReport {
    /// Height by which the centre of mass has risen at the end, m.
    pub rise: f64,
    /// The greatest difference between the expected height and that of the held body at any step,
    /// m.
    pub height_error: f64,
    /// Upper bound of the speed at which a point of the held body creeps, m/s: the way of its
    /// centre of mass, plus its rotation times the diagonal of its bounding box.
    pub creep: f64,
    /// The greatest penetration by the exact clearance, m; 0 when none was found.
    pub penetration: f64,
    /// Number of measurements of the exact clearance.
    pub measurements: usize,
    /// Upper bound of the speed of a point of the held body relative to a finger, m/s.
    pub jitter: f64,
    /// The most energy that the bodies had gained at a step while they held, J.
    pub energy_gain: f64,
    /// The requirements that the run did not meet; empty when it passed. Each begins with the name
    /// of the failure and a colon: `lift`, `creep`, `penetration`, `jitter` or `energy gain`.
    pub failures: Vec<String>,
}

impl Criterion for LiftCriterion {
    const NAME: &str = "lift";
    type Tracker = LiftTracker;

    /// Checks the values, that the bodies exist, and that the lifted one is free and has no joint.
    fn check(&self, system: &System) -> Result<Vec<String>, String> {
        unit(self.axis)?;
        positive([
            ("height", self.height),
            ("height_tolerance", self.height_tolerance),
            ("held_from", self.held_from),
            ("max_creep", self.max_creep),
            ("max_penetration", self.max_penetration),
            ("max_jitter", self.max_jitter),
            ("max_energy_gain", self.max_energy_gain),
            ("check_every", self.check_every),
        ])?;
        self.find(system).map(|_| vec![self.body.clone()])
    }

    fn track(&self, system: &System) -> Result<LiftTracker, String> {
        LiftTracker::new(self, system)
    }
}

impl LiftCriterion {
    /// The lifted body, its mass, and the fingers.
    fn find(&self, system: &System) -> Result<(usize, MassProperties, Vec<usize>), String> {
        let (lifted, mass) = free_body(system, &self.body, "lift")?;
        if self.fingers.is_empty() {
            return Err("fingers is empty; name the bodies that hold the body".into());
        }
        let fingers: Vec<usize> =
            self.fingers.iter().map(|name| body(system, name)).collect::<Result<_, _>>()?;
        if fingers.contains(&lifted) {
            return Err(format!("body {} cannot hold itself", self.body));
        }
        let holds = system.joints().iter().find(|j| j.child == lifted || j.parent == Some(lifted));
        match holds {
            Some(joint) => Err(format!(
                "joint {} holds body {}; only the fingers may, so take it out",
                joint.name, self.body
            )),
            None => Ok((lifted, mass, fingers)),
        }
    }
}

/// Records how fingers hold one body during a run.
#[derive(Clone, Debug)]
pub struct LiftTracker {
    criterion: LiftCriterion,
    axis: DVec3,
    body: usize,
    mass: MassProperties,
    fingers: Vec<usize>,
    pairs: Vec<[InstanceId; 2]>,
    /// Diagonal of the bounding box of the lifted body, m.
    size: f64,
    /// Position of the centre of mass at the beginning.
    start: DVec3,
    time: f64,
    checks: Checks,
    /// The held body as each finger sees it, and the energy, J, when the hold began.
    held: Option<(Vec<Pose>, f64)>,
    /// The greatest distance that a point of the held body moved, m.
    drift: f64,
    rise: f64,
    height_error: f64,
    jitter: f64,
    energy_gain: f64,
    penetration: Penetration,
}

impl LiftTracker {
    /// A tracker that starts from the current state of `system`.
    ///
    /// # Errors
    /// The same errors as [`LiftCriterion::check`].
    pub fn new(criterion: &LiftCriterion, system: &System) -> Result<Self, String> {
        criterion.check(system)?;
        let (body, mass, fingers) = criterion.find(system)?;
        let instance = system.bodies()[body].instance;
        let size = system.diagonal(&system.bodies()[body]).map_err(|e| e.to_string())?;
        Ok(Self {
            axis: unit(criterion.axis)?,
            body,
            mass,
            pairs: fingers.iter().map(|&finger| [instance, system.bodies()[finger].instance]).collect(),
            fingers,
            size,
            start: system.states()[body].pose.to_world(mass.center),
            time: 0.0,
            checks: Checks::new(criterion.check_every),
            held: None,
            drift: 0.0,
            rise: 0.0,
            height_error: 0.0,
            jitter: 0.0,
            energy_gain: 0.0,
            penetration: Penetration::default(),
            criterion: criterion.clone(),
        })
    }
}

impl Tracker for LiftTracker {
    type Report = LiftReport;

    fn observe(&mut self, system: &System, time_step: f64) {
        self.time += time_step;
        let states = system.states();
        let lifted = &states[self.body];
        let center = lifted.pose.to_world(self.mass.center);
        self.rise = (center - self.start).dot(self.axis);
        if self.checks.due(time_step) {
            self.penetration.measure(system, &self.pairs, 1e-2 * self.criterion.max_penetration);
        }
        if self.time < self.criterion.held_from - 1e-9 {
            return;
        }
        self.height_error = self.height_error.max((self.rise - self.criterion.height).abs());
        let energy = system.kinetic_energy() + system.potential_energy();
        let seen = |finger: &usize| relative(states[*finger].pose, lifted.pose);
        let seen: Vec<Pose> = self.fingers.iter().map(seen).collect();
        let (held, held_energy) = self.held.get_or_insert_with(|| (seen.clone(), energy));
        self.energy_gain = self.energy_gain.max(energy - *held_energy);
        for ((&finger, pose), held) in self.fingers.iter().zip(&seen).zip(held) {
            let way = pose.to_world(self.mass.center).distance(held.to_world(self.mass.center));
            let turn = rotation_between(*held, *pose).length();
            self.drift = self.drift.max(way + turn * self.size);
            let spin = (lifted.angular - states[finger].angular).length();
            let speed = (lifted.linear - velocity_at(system, finger, center)).length();
            self.jitter = self.jitter.max(speed + spin * self.size);
        }
    }

    fn report(&self, system: &System) -> LiftReport {
        let LiftCriterion { height, height_tolerance, held_from, max_creep, max_jitter, .. } = self.criterion;
        let seconds = self.time - held_from;
        let is_held = self.held.is_some() && seconds > 1e-9;
        let creep = if is_held { self.drift / seconds } else { 0.0 };
        let mut failures = self.penetration.failures(self.criterion.max_penetration);
        let mut demand = |met: bool, text: String| {
            if !met {
                failures.push(text);
            }
        };
        let Self { rise, height_error, jitter, energy_gain, .. } = *self;
        demand(
            is_held,
            format!("lift: the run ends before {held_from} s, from which the body is to be held"),
        );
        demand(
            height_error <= height_tolerance,
            format!(
                "lift: up to {height_error:.3e} m from the height of {height:.3e} m, {rise:.3e} m at the end; expected at \
                 most {height_tolerance:.3e} m"
            ),
        );
        demand(
            creep <= max_creep,
            format!("creep: {creep:.3e} m/s relative to a finger; expected at most {max_creep:.3e} m/s"),
        );
        demand(
            jitter <= max_jitter,
            format!("jitter: {jitter:.3e} m/s relative to a finger; expected at most {max_jitter:.3e} m/s"),
        );
        let work = self.mass.mass * system.gravity.dot(self.axis).abs() * height;
        let allowed = self.criterion.max_energy_gain * work;
        demand(
            energy_gain <= allowed,
            format!("energy gain: {energy_gain:.3e} J while held; expected at most {allowed:.3e} J"),
        );
        LiftReport {
            rise,
            height_error,
            creep,
            penetration: self.penetration.depth,
            measurements: self.penetration.measurements,
            jitter,
            energy_gain,
            failures,
        }
    }
}

/// Velocity of the point of a body that is at `point` in the world, m/s.
fn velocity_at(system: &System, body: usize, point: DVec3) -> DVec3 {
    let State { pose, linear, angular } = system.states()[body];
    let origin = match system.bodies()[body].mass {
        Mass::Free(mass) => pose.to_world(mass.center),
        Mass::Fixed | Mass::Kinematic => pose.translation,
    };
    linear + angular.cross(point - origin)
}

impl Report for LiftReport {
    fn failures(&mut self) -> &mut Vec<String> {
        &mut self.failures
    }

    fn rows(&self) -> Rows {
        vec![
            (
                "lift",
                format!(
                    "{:.4} mm, held within {:.2} µm of the height",
                    self.rise * 1e3,
                    self.height_error * 1e6
                ),
            ),
            (
                "creep",
                format!(
                    "{:.2e} mm/s relative to a finger; at most {:.2e} mm/s in a step",
                    self.creep * 1e3,
                    self.jitter * 1e3
                ),
            ),
            clearance_row(self.penetration, self.measurements),
            ("energy gain", format!("{:.2e} J while held", self.energy_gain)),
        ]
    }
}
