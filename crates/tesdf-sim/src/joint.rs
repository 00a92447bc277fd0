//! Joints between two bodies, or a body and the world, and the motors that drive them.
use std::f64::consts::{PI, TAU};
use std::fmt;

use glam::{DMat3, DVec3};
use serde::{Deserialize, Serialize};
use tesdf::base::elementary;
use tesdf::collide::Pose;

/// What a joint lets a body do relative to its parent.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum JointKind {
    /// Nothing.
    Weld,
    /// Rotate about the origin of the joint's frame.
    Ball,
    /// Rotate about the z axis of the joint's frame.
    Hinge,
    /// Move along the z axis of the joint's frame.
    Slider,
}

/// A joint: a frame of the child stays on a frame of its parent, up to the motion that the kind
/// allows.
#[derive(Clone, Debug, PartialEq)]
pub struct Joint {
    /// Name, for messages and files.
    pub name: String,
    /// What is free.
    pub kind: JointKind,
    /// Number of the parent body; `None` for the world.
    pub parent: Option<usize>,
    /// Number of the child body.
    pub child: usize,
    /// The joint's frame in the parent's frame (in the world without a parent), and in the child's
    /// frame.
    pub frames: [Pose; 2],
    /// Bounds of the coordinate of a hinge, rad, or of a slider, m. For a ball: the
    /// greatest angle between the z axes of the two frames, rad, as the second number; the first
    /// one is 0.
    pub limits: Option<[f64; 2]>,
    /// Drives the coordinate of a hinge or a slider.
    pub motor: Option<Motor>,
    /// Resists the motion of a hinge or a slider.
    pub resistance: JointResistance,
}

/// What resists the motion of a hinge or a slider besides its motor.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct JointResistance {
    /// Torque or force per rate of the coordinate, N m s/rad or N s/m.
    pub damping: f64,
    /// Dry friction: the greatest torque or force with which the joint resists motion, N m or N.
    pub friction: f64,
    /// Inertia of what turns or slides along with the coordinate, such as a rotor seen through its
    /// gear, kg m² or kg.
    pub armature: f64,
}

/// A motor of a hinge or a slider.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Motor {
    /// What the motor aims at.
    pub drive: Drive,
    /// Greatest force, N, or torque, N m, in either direction.
    pub limit: f64,
}

/// What a motor aims at. Coordinates are those of [`Joint::coordinate`].
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum Drive {
    /// A rate of the coordinate, rad/s or m/s.
    Velocity(f64),
    /// The coordinate at the end of the step, rad or m. For a hinge, whole turns do not count.
    Position(f64),
    /// A spring and a damper.
    Spring {
        /// The coordinate at which the spring is relaxed, rad or m.
        rest: f64,
        /// N m/rad or N/m.
        stiffness: f64,
        /// N m s/rad or N s/m.
        damping: f64,
        /// The rate that the damper aims at, rad/s or m/s.
        #[serde(default)]
        velocity: f64,
        /// Acts in addition to both (feed-forward), N m or N.
        #[serde(default)]
        force: f64,
    },
    /// A force, N, or torque, N m. Its magnitude is bounded by the motor's limit.
    Force(f64),
}

impl fmt::Display for Drive {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Velocity(x) => write!(f, "velocity {x}"),
            Self::Position(x) => write!(f, "position {x}"),
            Self::Force(x) => write!(f, "force {x}"),
            Self::Spring { rest, stiffness, damping, velocity, force } => write!(
                f,
                "a spring of rest {rest}, stiffness {stiffness}, damping {damping}, velocity {velocity}, force {force}"
            ),
        }
    }
}

impl Joint {
    /// A joint without limits and motor, whose frame is `frame` in the world while the two bodies
    /// are at `poses`. The pose of a missing parent is ignored.
    pub fn new(
        name: impl Into<String>,
        kind: JointKind,
        (parent, child): (Option<usize>, usize),
        poses: [Pose; 2],
        frame: Pose,
    ) -> Self {
        let parent_pose = if parent.is_some() { poses[0] } else { Pose::IDENTITY };
        let frames = [parent_pose, poses[1]].map(|body| relative(body, frame));
        Self {
            name: name.into(),
            kind,
            parent,
            child,
            frames,
            limits: None,
            motor: None,
            resistance: JointResistance::default(),
        }
    }

    /// Makes this the coordinate at the poses at which the frames agree.
    ///
    /// # Errors
    /// The joint has no coordinate, or the number is out of range.
    pub(crate) fn begin_at(&mut self, coordinate: f64) -> Result<(), String> {
        let [_, child] = &mut self.frames;
        match self.kind {
            _ if coordinate == 0.0 => {}
            JointKind::Hinge if coordinate.abs() <= PI => {
                child.rotation =
                    (child.rotation * elementary::from_axis_angle(DVec3::Z, coordinate)).normalize();
            }
            JointKind::Slider if coordinate.is_finite() => {
                child.translation += child.rotation * DVec3::Z * coordinate;
            }
            JointKind::Hinge | JointKind::Slider => {
                return Err(format!("coordinate {coordinate}; expected a travel, or an angle within ±π"));
            }
            JointKind::Weld | JointKind::Ball => {
                return Err("only hinges and sliders have a coordinate; take it out".into());
            }
        }
        Ok(())
    }

    /// The joint's frames in the world, when the parent and the child are at `poses`.
    pub fn frames_in_world(&self, poses: [Pose; 2]) -> [Pose; 2] {
        [0, 1].map(|k| {
            let Pose { translation, rotation } = self.frames[k];
            let body = poses[k];
            Pose { translation: body.to_world(translation), rotation: (body.rotation * rotation).normalize() }
        })
    }

    /// The angle of a hinge, rad within ±π, the travel of a slider, m, or the angle between the z
    /// axes of a ball's frames, rad; 0 for a weld. It is zero where the two frames agree.
    pub fn coordinate(&self, poses: [Pose; 2]) -> f64 {
        let [a, b] = self.frames_in_world(poses);
        match self.kind {
            JointKind::Weld => 0.0,
            JointKind::Ball => swing(a, b).length(),
            JointKind::Hinge => {
                let turned = a.rotation.inverse() * (b.rotation * DVec3::X);
                elementary::atan2(turned.y, turned.x)
            }
            JointKind::Slider => (a.rotation * DVec3::Z).dot(b.translation - a.translation),
        }
    }

    /// How far the joint is from what it must hold: the distance, m, and the angle, rad, by which
    /// the two frames are apart in the directions that are not free.
    pub fn error(&self, poses: [Pose; 2]) -> (f64, f64) {
        let [a, b] = self.frames_in_world(poses);
        let (way, turn) = (b.translation - a.translation, rotation_between(a, b));
        let z = a.rotation * DVec3::Z;
        match self.kind {
            JointKind::Weld => (way.length(), turn.length()),
            JointKind::Ball => (way.length(), 0.0),
            JointKind::Hinge => (way.length(), swing(a, b).length()),
            JointKind::Slider => (way.reject_from_normalized(z).length(), turn.length()),
        }
    }

    /// Checks the numbers and whether they fit the kind.
    ///
    /// # Errors
    /// A message that names what was found and what is expected.
    pub(crate) fn validate(&self) -> Result<(), String> {
        let has_coordinate = matches!(self.kind, JointKind::Hinge | JointKind::Slider);
        if self.parent == Some(self.child) {
            return Err("it connects a body to itself; give two bodies".into());
        }
        if let Some([low, high]) = self.limits {
            let range = match self.kind {
                JointKind::Weld => return Err("a weld has no limits; take them out".into()),
                JointKind::Hinge | JointKind::Slider if low.is_finite() && high.is_finite() => low <= high,
                JointKind::Ball if high <= PI => low == 0.0 && high > 0.0,
                _ => false,
            };
            if !range {
                let expected = match self.kind {
                    JointKind::Ball => "0 and an angle of at most π",
                    JointKind::Hinge | JointKind::Slider | JointKind::Weld => {
                        "two finite numbers, the lower one first"
                    }
                };
                return Err(format!("limits {low} to {high}; expected {expected}"));
            }
        }
        if let Some(Motor { drive, limit }) = self.motor {
            if !has_coordinate {
                return Err("only hinges and sliders have motors; take the motor out".into());
            }
            if limit.is_nan() || limit < 0.0 {
                return Err(format!("the limit of its motor is {limit}; expected a number, 0 or greater"));
            }
            let (values, positive) = match drive {
                Drive::Velocity(x) | Drive::Position(x) | Drive::Force(x) => ([x; 3], true),
                Drive::Spring { rest, stiffness, damping, velocity, force } => (
                    [rest + velocity + force, stiffness, damping],
                    stiffness >= 0.0 && damping >= 0.0 && stiffness + damping > 0.0,
                ),
            };
            if !values.iter().all(|x| x.is_finite()) || !positive {
                return Err(format!(
                    "its motor has {drive}; expected finite numbers, of a spring also 0 or greater, not both 0"
                ));
            }
        }
        let JointResistance { damping, friction, armature } = self.resistance;
        for (name, value) in [("damping", damping), ("friction", friction), ("armature", armature)] {
            if !(value >= 0.0 && value.is_finite()) {
                return Err(format!("{name} {value}; expected a finite number, 0 or greater"));
            }
            if value > 0.0 && !has_coordinate {
                return Err(format!("only hinges and sliders have {name}; take it out"));
            }
        }
        Ok(())
    }
}

/// `frame` as seen from `body`.
pub fn relative(body: Pose, frame: Pose) -> Pose {
    let inverse = body.rotation.inverse();
    Pose {
        translation: inverse * (frame.translation - body.translation),
        rotation: (inverse * frame.rotation).normalize(),
    }
}

/// The rotation vector, of at most half a turn, from the frame of `a` to that of `b`, in the world,
/// rad.
pub fn rotation_between(a: Pose, b: Pose) -> DVec3 {
    let q = (b.rotation * a.rotation.inverse()).normalize();
    let q = if q.w < 0.0 { -q } else { q };
    // Of small angles the sine keeps all digits.
    let sine = q.xyz().length();
    if sine == 0.0 { DVec3::ZERO } else { q.xyz() * (2.0 * elementary::atan2(sine, q.w) / sine) }
}

/// The smallest rotation that takes the z axis of `a` to that of `b`, as a rotation vector in the
/// world, rad.
pub(crate) fn swing(a: Pose, b: Pose) -> DVec3 {
    let [from, to] = [a, b].map(|pose| pose.rotation * DVec3::Z);
    let sine = from.cross(to);
    let angle = elementary::atan2(sine.length(), from.dot(to));
    match sine.try_normalize() {
        Some(axis) => axis * angle,
        None if angle > 1.0 => (a.rotation * DVec3::X) * PI,
        None => DVec3::ZERO,
    }
}

/// The same angle within ±π, rad.
pub fn wrapped(angle: f64) -> f64 {
    angle - TAU * (angle / TAU).round()
}

/// The angle, with all turns, that is nearest to `near`, rad.
pub(crate) fn nearest_turn(angle: f64, near: f64) -> f64 {
    angle + TAU * ((near - angle) / TAU).round()
}

/// The axes of a frame in the world.
pub(crate) fn axes(frame: Pose) -> [DVec3; 3] {
    let m = DMat3::from_quat(frame.rotation);
    [m.x_axis, m.y_axis, m.z_axis]
}

#[cfg(test)]
mod tests {
    use glam::DQuat;

    use super::*;

    #[test]
    fn coordinates_and_errors_are_those_of_the_motion() {
        let start = [
            Pose { translation: DVec3::new(1.0, 2.0, 3.0), rotation: DQuat::from_rotation_x(0.4) },
            Pose { translation: DVec3::new(-1.0, 0.5, 0.0), rotation: DQuat::from_rotation_y(1.4) },
        ];
        let frame = Pose { translation: DVec3::new(0.3, 0.2, 0.1), rotation: DQuat::from_rotation_y(0.7) };
        let z = frame.rotation * DVec3::Z;
        for kind in [JointKind::Weld, JointKind::Ball, JointKind::Hinge, JointKind::Slider] {
            let joint = Joint::new("joint", kind, (Some(0), 1), start, frame);
            assert!(joint.coordinate(start).abs() < 1e-15 && joint.error(start).0 < 1e-15, "{kind:?}");
            let turn = DQuat::from_axis_angle(z, 0.25);
            let turned = Pose {
                translation: frame.translation + turn * (start[1].translation - frame.translation),
                rotation: turn * start[1].rotation,
            };
            let moved = Pose { translation: start[1].translation + 0.125 * z, ..start[1] };
            let found = |pose: Pose| {
                let poses = [start[0], pose];
                let (way, angle) = joint.error(poses);
                [joint.coordinate(poses), way, angle]
            };
            let [expected_turned, expected_moved] = match kind {
                JointKind::Weld => [[0.0, 0.0, 0.25], [0.0, 0.125, 0.0]],
                JointKind::Ball => [[0.0, 0.0, 0.0], [0.0, 0.125, 0.0]],
                JointKind::Hinge => [[0.25, 0.0, 0.0], [0.0, 0.125, 0.0]],
                JointKind::Slider => [[0.0, 0.0, 0.25], [0.125, 0.0, 0.0]],
            };
            for (found, expected) in [(found(turned), expected_turned), (found(moved), expected_moved)] {
                let close = found.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-14);
                assert!(close, "{kind:?}: {found:?}, expected {expected:?}");
            }
        }
    }
}
