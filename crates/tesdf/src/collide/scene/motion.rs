use std::f64::consts::TAU;

use glam::{DQuat, DVec3};

use crate::base::elementary;
use crate::collide::scene::Velocity;
use crate::collide::scene::pose::Pose;

/// The motion of a body from its initial pose, in the world.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Motion {
    /// No motion.
    #[default]
    Rest,
    /// Constant velocity of the body's origin, and rotation about the origin at a constant rate.
    Linear {
        /// Velocity per unit of time; the angular part in radians, about the body's origin.
        velocity: Velocity,
    },
    /// Constant velocity of a point of the body, and rotation about this point at a constant rate.
    About {
        /// The point at time 0, in the world; for example the centre of mass.
        point: DVec3,
        /// Velocity per unit of time; the angular part in radians, about the point.
        velocity: Velocity,
    },
    /// Rotation about a line and translation along it.
    Screw {
        /// A point of the line.
        point: DVec3,
        /// Direction of the line; any length except 0.
        axis: DVec3,
        /// Radians per unit of time; the right-hand rule about `axis`.
        angular_speed: f64,
        /// Translation along `axis` per turn, in the world's unit.
        pitch: f64,
    },
}

/// A motion as a drift, equal at all points, and a rotation about a line that drifts along.
#[derive(Clone, Copy, Debug)]
pub struct Twist {
    /// Velocity of the line.
    pub drift: DVec3,
    /// Angular velocity, in radians per unit of time.
    pub spin: DVec3,
    /// A point of the line at the start.
    pub center: DVec3,
}

/// Largest accepted absolute value in motions. Squares and products of such numbers stay within the
/// range of 64-bit floats.
const LARGEST: f64 = 1e50;
const EXPECTED: &str = "expected absolute values up to 1e50";

fn in_range(v: DVec3) -> bool {
    // The comparison is false for NaN.
    v.abs().cmple(DVec3::splat(LARGEST)).all()
}

impl Velocity {
    /// Checks the numbers. The error describes the fault.
    pub(in crate::collide) fn validate(&self) -> Result<(), String> {
        let Self { linear, angular } = *self;
        match in_range(linear) && in_range(angular) {
            true => Ok(()),
            false => Err(format!("velocity {linear:?}, angular {angular:?}; {EXPECTED}")),
        }
    }
}

impl Motion {
    /// Checks the numbers. The error describes the fault.
    pub(in crate::collide) fn validate(&self) -> Result<(), String> {
        match *self {
            Self::Linear { velocity } => velocity.validate(),
            Self::About { point, .. } if !in_range(point) => Err(format!("motion about {point}; {EXPECTED}")),
            Self::About { velocity, .. } => velocity.validate(),
            Self::Screw { point, angular_speed, pitch, .. }
                if !(in_range(point) && in_range(DVec3::new(angular_speed, pitch, 0.0))) =>
            {
                Err(format!(
                    "screw about {point} with angular speed {angular_speed:e} and pitch {pitch:e}; {EXPECTED}"
                ))
            }
            Self::Screw { axis, .. } if axis.try_normalize().is_none() => {
                Err(format!("screw axis {axis}; expected a direction: finite numbers, not all 0"))
            }
            _ => Ok(()),
        }
    }

    /// The pose at time `t` of a body that is at `start` at time 0, in closed form.
    pub fn pose_at(&self, start: Pose, t: f64) -> Pose {
        match *self {
            Self::Rest => start,
            Self::Linear { velocity } => Pose {
                translation: start.translation + t * velocity.linear,
                rotation: rotated(elementary::from_scaled_axis(t * velocity.angular), start.rotation),
            },
            Self::About { point, velocity } => {
                let rotation = elementary::from_scaled_axis(t * velocity.angular);
                Pose {
                    translation: point + t * velocity.linear + rotation * (start.translation - point),
                    rotation: rotated(rotation, start.rotation),
                }
            }
            Self::Screw { point, axis, angular_speed, pitch } => {
                let (axis, angle) = (axis.normalize_or_zero(), t * angular_speed);
                let rotation = elementary::from_axis_angle(axis, angle);
                Pose {
                    translation: point
                        + rotation * (start.translation - point)
                        + pitch * (angle / TAU) * axis,
                    rotation: rotated(rotation, start.rotation),
                }
            }
        }
    }

    /// Decomposes the motion of a body that is at `start` at time 0.
    pub(in crate::collide) fn twist(&self, start: Pose) -> Twist {
        match *self {
            Self::Rest => Twist { drift: DVec3::ZERO, spin: DVec3::ZERO, center: start.translation },
            Self::Linear { velocity } => {
                Twist { drift: velocity.linear, spin: velocity.angular, center: start.translation }
            }
            Self::About { point, velocity } => {
                Twist { drift: velocity.linear, spin: velocity.angular, center: point }
            }
            Self::Screw { point, axis, angular_speed, pitch } => {
                let axis = axis.normalize_or_zero();
                let drift = pitch * (angular_speed / TAU) * axis;
                Twist { drift, spin: angular_speed * axis, center: point }
            }
        }
    }
}

fn rotated(by: DQuat, rotation: DQuat) -> DQuat {
    (by * rotation).normalize()
}

impl Twist {
    /// Whether it rotates.
    pub fn rotates(&self) -> bool {
        self.spin != DVec3::ZERO
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_motion_about_the_origin_of_the_body_is_linear() {
        let start = Pose::new(DVec3::new(3.0, -1.0, 2.0), DQuat::from_rotation_x(0.3)).expect("a pose");
        let velocity = Velocity { linear: DVec3::new(0.5, 0.0, -2.0), angular: DVec3::new(1.0, 2.0, 3.0) };
        let about = |point| Motion::About { point, velocity }.pose_at(start, 0.7);
        assert_eq!(about(start.translation), Motion::Linear { velocity }.pose_at(start, 0.7));
        // Any other point of the body stays at its place in it.
        let point = DVec3::new(1.0, 1.0, 0.0);
        let moved = about(point).to_world(start.to_body(point));
        assert!(moved.distance(point + 0.7 * velocity.linear) < 1e-14, "{moved}");
    }

    #[test]
    fn a_screw_advances_one_pitch_per_turn() {
        let start = Pose::new(DVec3::new(3.0, -1.0, 2.0), DQuat::from_rotation_x(0.3)).expect("a pose");
        let screw = Motion::Screw {
            point: DVec3::new(1.0, 1.0, 0.0),
            axis: DVec3::new(0.0, 0.0, 5.0),
            angular_speed: -2.0,
            pitch: 0.5,
        };
        let back = screw.pose_at(start, -TAU / 2.0);
        assert!(back.translation.distance(start.translation - DVec3::new(0.0, 0.0, -0.5)) < 1e-14);
        assert!(back.rotation.angle_between(start.rotation) < 1e-7);
        let quarter = screw.pose_at(start, -TAU / 8.0);
        assert!(quarter.translation.distance(DVec3::new(3.0, 3.0, 2.125)) < 1e-14);
    }
}
