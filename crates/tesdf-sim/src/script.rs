//! Keyframes in time: poses of kinematic bodies, targets of motors and wrenches.
use glam::{DQuat, DVec3};
use serde::{Deserialize, Serialize};
use tesdf::base::elementary;
use tesdf::collide::Pose;

use crate::joint::rotation_between;
use crate::{Drive, Dynamics, DynamicsError, Joint, Mass, Motor, State, System, Wrench};

/// What a script drives, and its keyframes. Before the first and after the last keyframe their
/// values hold.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Script {
    /// Name of a kinematic body; its keyframes have `translation`, and `rotation` or `turn`. Of a
    /// free body they have `force` and `torque`.
    #[serde(default)]
    pub body: Option<String>,
    /// Name of a joint with a motor; its keyframes have `target`.
    #[serde(default)]
    pub joint: Option<String>,
    /// How values change between keyframes.
    #[serde(default)]
    pub interpolation: Interpolation,
    /// The keyframes, in the order of their times.
    pub keyframes: Vec<Keyframe>,
}

/// The values at a time. A value that is missing is that of the keyframe before, of the first one
/// its default.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Keyframe {
    /// Time, s.
    pub time: f64,
    /// Position of the body's origin, m, world frame [default: where the body starts].
    #[serde(default)]
    pub translation: Option<[f64; 3]>,
    /// Orientation of the body: a unit quaternion x y z w [default: that in which the body starts].
    /// Between keyframes it turns the short way, so a whole turn needs `turn`.
    #[serde(default)]
    pub rotation: Option<[f64; 4]>,
    /// Rotation from the keyframe before, or from where the body starts, in place of `rotation`: a
    /// rotation vector, rad, world frame. It may have any number of turns.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub turn: Option<[f64; 3]>,
    /// Target of the motor, in the unit of its drive: rad/s or m/s, rad or m, N m or N [default:
    /// that of the motor].
    #[serde(default)]
    pub target: Option<f64>,
    /// Force on the centre of mass, N, world frame [default: 0].
    #[serde(default)]
    pub force: Option<[f64; 3]>,
    /// Torque about the centre of mass, N m, world frame [default: 0].
    #[serde(default)]
    pub torque: Option<[f64; 3]>,
}

/// How values change between two keyframes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Interpolation {
    /// By 3 s² − 2 s³ of the time s between them, so that the motion stops at each keyframe.
    #[default]
    Smooth,
    /// Evenly. The velocity jumps at keyframes.
    Linear,
    /// Not until the next keyframe, where they jump.
    Step,
}

/// A way that is no more than rounding, as part of the distance from the origin, and an angle, rad.
const ROUNDING: f64 = 8.0 * f64::EPSILON;

/// The scripts of a scene, whose bodies and joints are found.
#[derive(Clone, Debug, Default)]
pub(crate) struct Scripts(Vec<Track>);

#[derive(Clone, Debug)]
struct Track {
    interpolation: Interpolation,
    times: Vec<f64>,
    values: Values,
}

/// One value for each keyframe.
#[derive(Clone, Debug)]
enum Values {
    Poses { body: usize, poses: Vec<Waypoint> },
    Wrenches { body: usize, wrenches: Vec<Wrench> },
    Targets { joint: usize, motor: Motor, targets: Vec<f64> },
}

/// A pose, and the rotation vector by which the body turns on its way there, rad.
#[derive(Clone, Copy, Debug)]
struct Waypoint {
    pose: Pose,
    turn: DVec3,
}

impl Scripts {
    /// The scripts, for a system in its state at time 0.
    ///
    /// # Errors
    /// A message that names the script, what was found and what was expected.
    pub(crate) fn new(scripts: &[Script], system: &System) -> Result<Self, String> {
        let track = |(k, script): (usize, &Script)| {
            script.track(system).map_err(|reason| format!("script {}{}: {reason}", k + 1, script.name()))
        };
        scripts.iter().enumerate().map(track).collect::<Result<_, _>>().map(Self)
    }

    /// Sets the velocities, wrenches and motors for the step from `time` to `time + h`.
    pub(crate) fn drive(&self, engine: &mut dyn Dynamics, time: f64, h: f64) -> Result<(), DynamicsError> {
        for track in &self.0 {
            match &track.values {
                Values::Poses { body, poses } => {
                    let target = track.at(time + h, poses, between).pose;
                    let state = engine.system().states()[*body];
                    let way = target.translation - state.pose.translation;
                    let turn = rotation_between(state.pose, target);
                    // What rounding has left of the way is no motion: the body rests.
                    let rounding = ROUNDING * target.translation.abs().max_element();
                    let rests = way.abs().max_element() <= rounding && turn.length() <= ROUNDING;
                    let [linear, angular] =
                        if rests { [DVec3::ZERO; 2] } else { [way, turn].map(|way| way / h) };
                    engine.set_state(*body, State { linear, angular, ..state })?;
                }
                Values::Wrenches { body, wrenches } => {
                    engine.set_wrench(*body, track.wrench(wrenches, time))?
                }
                Values::Targets { joint, motor, targets } => {
                    engine.set_motor(*joint, Some(track.motor(*motor, targets, time, h)))?;
                }
            }
        }
        Ok(())
    }

    /// Sets the wrenches and motors of `system` for the step from `time` to `time + h`, whose states
    /// are known.
    pub(crate) fn load(&self, system: &mut System, time: f64, h: f64) -> Result<(), DynamicsError> {
        for track in &self.0 {
            match &track.values {
                Values::Poses { .. } => {}
                Values::Wrenches { body, wrenches } => {
                    system.set_wrench(*body, track.wrench(wrenches, time))?
                }
                Values::Targets { joint, motor, targets } => {
                    system.set_motor(*joint, Some(track.motor(*motor, targets, time, h)))?;
                }
            }
        }
        Ok(())
    }
}

impl Track {
    fn wrench(&self, wrenches: &[Wrench], time: f64) -> Wrench {
        self.at(time, wrenches, |a: Wrench, b: Wrench, s| Wrench {
            force: a.force.lerp(b.force, s),
            torque: a.torque.lerp(b.torque, s),
        })
    }

    /// The motor in the step from `time` to `time + h`.
    fn motor(&self, motor: Motor, targets: &[f64], time: f64, h: f64) -> Motor {
        // A position is reached at the end of the step.
        let at = if matches!(motor.drive, Drive::Position(_)) { time + h } else { time };
        with_target(motor, self.at(at, targets, |a: f64, b: f64, s| a + (b - a) * s))
    }

    fn at<T: Copy>(&self, time: f64, values: &[T], between: impl Fn(T, T, f64) -> T) -> T {
        // There is at least one keyframe.
        let after = self.times.partition_point(|&t| t <= time);
        if after == 0 || after == self.times.len() {
            return values[after.max(1) - 1];
        }
        let s = (time - self.times[after - 1]) / (self.times[after] - self.times[after - 1]);
        let s = match self.interpolation {
            Interpolation::Smooth => s * s * (3.0 - 2.0 * s),
            Interpolation::Linear => s,
            Interpolation::Step => 0.0,
        };
        between(values[after - 1], values[after], s)
    }
}

impl Script {
    fn name(&self) -> String {
        match self.body.as_ref().or(self.joint.as_ref()) {
            Some(name) => format!(" ({name})"),
            None => String::new(),
        }
    }

    fn track(&self, system: &System) -> Result<Track, String> {
        let times: Vec<f64> = self.keyframes.iter().map(|k| k.time).collect();
        if times.is_empty() {
            return Err("it has no keyframes; give at least one".into());
        }
        if !times.iter().all(|t| t.is_finite()) || !times.is_sorted_by(|a, b| a < b) {
            return Err(format!(
                "its keyframes are at {times:?} s; expected finite times, each after the one before"
            ));
        }
        self.check_keys(system)?;
        let values = match (&self.body, &self.joint) {
            (Some(name), None) => {
                let body = body(system, name)?;
                match system.bodies()[body].mass {
                    Mass::Kinematic => self.poses(body, system.states()[body].pose)?,
                    Mass::Free(_) => self.wrenches(body)?,
                    Mass::Fixed => return Err(fixed()),
                }
            }
            (None, Some(name)) => {
                let joint = joint_named(system, name)?;
                self.targets(joint, &system.joints()[joint])?
            }
            _ => return Err("expected either body or joint".into()),
        };
        Ok(Track { interpolation: self.interpolation, times, values })
    }

    /// Refuses values that have no meaning for what the script drives.
    fn check_keys(&self, system: &System) -> Result<(), String> {
        let mass =
            self.body.as_ref().map(|name| body(system, name)).transpose()?.map(|b| system.bodies()[b].mass);
        let expected: &[&str] = match mass {
            Some(Mass::Kinematic) => &["translation", "rotation", "turn"],
            Some(Mass::Free(_)) => &["force", "torque"],
            Some(Mass::Fixed) => return Err(fixed()),
            None => &["target"],
        };
        for keyframe in &self.keyframes {
            let given = [
                ("translation", keyframe.translation.is_some()),
                ("rotation", keyframe.rotation.is_some()),
                ("turn", keyframe.turn.is_some()),
                ("target", keyframe.target.is_some()),
                ("force", keyframe.force.is_some()),
                ("torque", keyframe.torque.is_some()),
            ];
            if let Some((key, _)) = given.into_iter().find(|(key, given)| *given && !expected.contains(key)) {
                let expected = expected.join(" and ");
                return Err(format!("the keyframe at {} s has {key}; expected {expected}", keyframe.time));
            }
        }
        Ok(())
    }

    fn poses(&self, body: usize, start: Pose) -> Result<Values, String> {
        let (mut poses, mut last) = (Vec::new(), start);
        for keyframe in &self.keyframes {
            let translation = keyframe.translation.map_or(last.translation, DVec3::from_array);
            let at = |reason: String| format!("the keyframe at {} s: {reason}", keyframe.time);
            let given = match (keyframe.rotation, keyframe.turn.map(DVec3::from_array)) {
                (Some(_), Some(_)) => return Err(at("it has a rotation and a turn; keep one".into())),
                (_, Some(turn)) if !turn.is_finite() => {
                    return Err(at(format!("turn {turn}; expected finite numbers, rad")));
                }
                (rotation, turn) => (rotation.map(DQuat::from_array), turn),
            };
            let rotation = match given {
                (Some(rotation), _) => rotation,
                (None, Some(turn)) => (elementary::from_scaled_axis(turn) * last.rotation).normalize(),
                (None, None) => last.rotation,
            };
            let pose = Pose::new(translation, rotation).map_err(|e| at(e.to_string()))?;
            poses.push(Waypoint { pose, turn: given.1.unwrap_or_else(|| rotation_between(last, pose)) });
            last = pose;
        }
        Ok(Values::Poses { body, poses })
    }

    fn wrenches(&self, body: usize) -> Result<Values, String> {
        let (mut wrenches, mut last) = (Vec::new(), Wrench::default());
        for keyframe in &self.keyframes {
            last.force = keyframe.force.map_or(last.force, DVec3::from_array);
            last.torque = keyframe.torque.map_or(last.torque, DVec3::from_array);
            for (key, value, unit) in [("force", last.force, "N"), ("torque", last.torque, "N m")] {
                if !value.is_finite() {
                    return Err(format!(
                        "the keyframe at {} s has {key} {value}; expected finite numbers, {unit}",
                        keyframe.time
                    ));
                }
            }
            wrenches.push(last);
        }
        Ok(Values::Wrenches { body, wrenches })
    }

    fn targets(&self, number: usize, joint: &Joint) -> Result<Values, String> {
        let motor = joint.motor.ok_or("the joint has no motor; give it one, with its limit")?;
        let mut last = match motor.drive {
            Drive::Velocity(x) | Drive::Position(x) | Drive::Force(x) => x,
            Drive::Spring { rest, .. } => rest,
        };
        let mut targets = Vec::new();
        for keyframe in &self.keyframes {
            last = keyframe.target.unwrap_or(last);
            if !last.is_finite() {
                return Err(format!(
                    "the keyframe at {} s has target {last}; expected a finite number",
                    keyframe.time
                ));
            }
            targets.push(last);
        }
        Ok(Values::Targets { joint: number, motor, targets })
    }
}

fn fixed() -> String {
    "the body is fixed; give it kinematic = true to move it".into()
}

fn body(system: &System, name: &str) -> Result<usize, String> {
    let found = system.bodies().iter().position(|body| body.name == name);
    found.ok_or_else(|| format!("there is no body {name}; give the name of one of the scene's bodies"))
}

/// The number of the joint of this name.
pub(crate) fn joint_named(system: &System, name: &str) -> Result<usize, String> {
    let found = system.joints().iter().position(|joint| joint.name == name);
    found.ok_or_else(|| format!("there is no joint {name}; give the name of one of the scene's joints"))
}

/// The pose at the share `s` of the way.
fn between(a: Waypoint, b: Waypoint, s: f64) -> Waypoint {
    let turn = elementary::from_scaled_axis(s * b.turn);
    let rotation = (turn * a.pose.rotation).normalize();
    Waypoint {
        pose: Pose { translation: a.pose.translation.lerp(b.pose.translation, s), rotation },
        turn: b.turn,
    }
}

fn with_target(motor: Motor, target: f64) -> Motor {
    let drive = match motor.drive {
        Drive::Velocity(_) => Drive::Velocity(target),
        Drive::Position(_) => Drive::Position(target),
        Drive::Force(_) => Drive::Force(target),
        Drive::Spring { stiffness, damping, velocity, force, .. } => {
            Drive::Spring { rest: target, stiffness, damping, velocity, force }
        }
    };
    Motor { drive, ..motor }
}
