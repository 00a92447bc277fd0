//! What criteria look up and measure.
//!
//! Errors are messages for people: they name what was found and what was expected.
use tesdf::Length;
use tesdf::collide::{
    ClearanceOptions, CollideError, InstanceId, PenetrationOptions, clearance, deepest_penetration,
    instance_pairs,
};
use tesdf::glam::DVec3;

pub use crate::joint::{relative, rotation_between, wrapped};
use crate::{Joint, JointKind, Mass, MassProperties, Motor, System};

/// The number of the body of this name.
///
/// # Errors
/// There is no such body.
pub fn body(system: &System, name: &str) -> Result<usize, String> {
    let names = || system.bodies().iter().map(|b| b.name.as_str()).collect::<Vec<_>>().join(", ");
    let found = system.bodies().iter().position(|b| b.name == name);
    found.ok_or_else(|| format!("there is no body {name}; the bodies are {}", names()))
}

/// The number and mass of the free body of this name. `verb` says what no contact could do to it
/// otherwise: `stop`, for example.
///
/// # Errors
/// There is no such body, or it is fixed or kinematic.
pub fn free_body(system: &System, name: &str, verb: &str) -> Result<(usize, MassProperties), String> {
    let body = body(system, name)?;
    match system.bodies()[body].mass {
        Mass::Free(mass) => Ok((body, mass)),
        Mass::Fixed => Err(format!("body {name} is fixed; no contact can {verb} it")),
        Mass::Kinematic => Err(format!("body {name} is kinematic; no contact can {verb} it")),
    }
}

/// The axis, when its length is 1.
///
/// # Errors
/// It has another length.
pub fn unit(axis: [f64; 3]) -> Result<DVec3, String> {
    let axis = DVec3::from_array(axis);
    match (axis.length() - 1.0).abs() <= 1e-6 {
        true => Ok(axis),
        false => Err(format!("axis has length {}; expected 1", axis.length())),
    }
}

/// Checks that each of these values is finite and greater than 0.
///
/// # Errors
/// The name and value of the first one that is not.
pub fn positive<const N: usize>(values: [(&str, f64); N]) -> Result<(), String> {
    match values.into_iter().find(|&(_, value)| !(value > 0.0 && value.is_finite())) {
        Some((key, value)) => Err(format!("{key} is {value}; expected a positive number")),
        None => Ok(()),
    }
}

/// Measurements of the exact clearance at regular times.
#[derive(Clone, Copy, Debug)]
pub struct Checks {
    every: f64,
    time: f64,
}

impl Checks {
    /// A check for each `every` seconds.
    pub fn new(every: f64) -> Self {
        Self { every, time: 0.0 }
    }

    /// Whether a check is due within the next `time_step` seconds.
    pub fn due(&mut self, time_step: f64) -> bool {
        let number = |time: f64| (time / self.every + 1e-9).floor();
        let before = number(self.time);
        self.time += time_step;
        number(self.time) > before
    }
}

/// What exact measurements of the clearance found.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Penetration {
    /// The greatest penetration, m; 0 when none was found.
    pub depth: f64,
    /// Number of measurements.
    pub measurements: usize,
    /// Reasons of measurements that failed.
    pub unmeasured: Vec<String>,
}

impl Penetration {
    /// Measures the penetration of pairs of instances at the current states, to `tolerance` metres.
    /// What cannot be deeper than all before is not searched.
    pub fn measure(&mut self, system: &System, pairs: &[[InstanceId; 2]], tolerance: f64) {
        let measured = at_states(system, |system| self.deepen(system, pairs, tolerance));
        self.unmeasured.extend(measured.err());
    }

    /// As [`measure`](Self::measure), of all pairs whose bounds overlap at the current states.
    pub fn measure_all(&mut self, system: &System, tolerance: f64) {
        let measured = at_states(system, |system| {
            let pairs = pairs_within(system, 0.0)?;
            self.deepen(system, &pairs, tolerance)
        });
        self.unmeasured.extend(measured.err());
    }

    fn deepen(&mut self, system: &System, pairs: &[[InstanceId; 2]], tolerance: f64) -> Result<(), String> {
        let options = PenetrationOptions { above: self.depth, tolerance };
        let found = deepest_penetration(system.scene(), pairs, &options).map_err(|e| e.to_string())?;
        self.measurements += 1;
        if let Some((_, clearance)) = found.deepest {
            self.depth = self.depth.max(-clearance.distance);
        }
        match found.converged {
            true => Ok(()),
            false => Err(format!(
                "the search was cut short: two bodies may be {:.3e} m deep in each other",
                found.upper_bound
            )),
        }
    }

    /// The failures, when at most `allowed` metres of penetration are.
    pub fn failures(&self, allowed: f64) -> Vec<String> {
        let mut failures: Vec<String> =
            self.unmeasured.iter().map(|e| format!("penetration: not measured: {e}")).collect();
        if self.depth > allowed {
            let depth = self.depth;
            failures.push(format!(
                "penetration: {depth:.3e} m by the exact clearance; expected at most {allowed:.3e} m"
            ));
        }
        if self.measurements == 0 && failures.is_empty() {
            failures
                .push("penetration: the run is too short for a measurement of the exact clearance".into());
        }
        failures
    }
}

/// The least exact clearance of pairs of instances at the current states, m, to `tolerance` metres;
/// infinite without pairs.
///
/// # Errors
/// A clearance cannot be measured.
pub fn least_distance(system: &System, pairs: &[[InstanceId; 2]], tolerance: f64) -> Result<f64, String> {
    let options = ClearanceOptions { tolerance: Length::Absolute(tolerance) };
    at_states(system, |system| {
        let distance = |&[a, b]: &[InstanceId; 2]| Ok(clearance(system.scene(), a, b, &options)?.distance);
        let least = pairs.iter().map(distance).try_fold(f64::INFINITY, |least, d| Ok(least.min(d?)));
        least.map_err(|e: CollideError| e.to_string())
    })
}

/// The pairs of instances whose bounds come within `distance` metres at the current states.
///
/// # Errors
/// The states are not those of the scene.
pub fn near(system: &System, distance: f64) -> Result<Vec<[InstanceId; 2]>, String> {
    at_states(system, |system| pairs_within(system, distance))
}

/// The same, where the instances have the poses of those states.
fn pairs_within(system: &System, distance: f64) -> Result<Vec<[InstanceId; 2]>, String> {
    let pairs = instance_pairs(system.scene(), distance, 0.0).map_err(|e| e.to_string())?;
    Ok(pairs.iter().map(|pair| [pair.first, pair.second]).collect())
}

/// Measures a system whose instances have the poses of its states: otherwise they have those of the
/// last detection.
fn at_states<T>(system: &System, measure: impl FnOnce(&System) -> Result<T, String>) -> Result<T, String> {
    let mut system = system.clone();
    let states = system.states().to_vec();
    system.scene_at(&states).map_err(|e| e.to_string())?;
    measure(&system)
}

/// A hinge whose turns are counted.
#[derive(Clone, Debug)]
pub struct Hinge {
    /// The number of the joint.
    joint: usize,
    /// The angle within ±π at the last step, rad.
    last: f64,
}

impl Hinge {
    /// The hinge of this name, from the current state on.
    ///
    /// # Errors
    /// There is no such joint, or it is no hinge.
    pub fn new(system: &System, name: &str) -> Result<Self, String> {
        let joints = system.joints();
        let names = || joints.iter().map(|j| j.name.as_str()).collect::<Vec<_>>().join(", ");
        let joint = joints.iter().position(|j| j.name == name);
        let joint = joint.ok_or_else(|| format!("there is no joint {name}; the joints are {}", names()))?;
        match joints[joint].kind {
            JointKind::Hinge => Ok(Self { joint, last: angle(system, joint) }),
            kind => Err(format!("joint {name} is a {kind:?}; expected a hinge").to_lowercase()),
        }
    }

    /// The body that it turns.
    pub fn child(&self, system: &System) -> usize {
        system.joints()[self.joint].child
    }

    /// What drives it.
    pub fn motor(&self, system: &System) -> Option<Motor> {
        system.joints()[self.joint].motor
    }

    /// The names of the other joints that hold the body that it turns.
    pub fn others<'a>(&self, system: &'a System) -> impl Iterator<Item = &'a str> {
        let (own, body) = (self.joint, self.child(system));
        let holds = move |joint: &Joint| joint.child == body || joint.parent == Some(body);
        let others = system.joints().iter().enumerate().filter(move |&(k, joint)| k != own && holds(joint));
        others.map(|(_, joint)| joint.name.as_str())
    }

    /// The speed, rad/s.
    pub fn speed(&self, system: &System) -> f64 {
        let joint = &system.joints()[self.joint];
        let states = system.states();
        let [parent, child] = [joint.parent, Some(joint.child)]
            .map(|body| body.map_or(DVec3::ZERO, |body| states[body].angular));
        let [_, frame] = joint.frames_in_world(System::poses_of(joint, states));
        (frame.rotation * DVec3::Z).dot(child - parent)
    }

    /// The angle by which it has turned in a step of `time_step` seconds, rad. Whole turns are
    /// those of the speed: without contacts, a load makes a shaft fast.
    pub fn turned(&mut self, system: &System, time_step: f64) -> f64 {
        let now = angle(system, self.joint);
        let way = self.speed(system) * time_step;
        let turned = way + wrapped(now - self.last - way);
        self.last = now;
        turned
    }
}

/// The angle of a hinge, rad within ±π.
fn angle(system: &System, joint: usize) -> f64 {
    let joint = &system.joints()[joint];
    joint.coordinate(System::poses_of(joint, system.states()))
}

/// The row of the exact clearance in the text of a report.
pub fn clearance_row(penetration: f64, measurements: usize) -> (&'static str, String) {
    let plural = if measurements == 1 { "" } else { "s" };
    let penetration = 1e6 * penetration;
    (
        "clearance",
        format!("at most {penetration:.3} µm of penetration, in {measurements} exact measurement{plural}"),
    )
}
