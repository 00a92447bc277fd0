use std::f64::consts::TAU;

use glam::{DQuat, DVec3};

use super::{Pose, Shape, Velocity};
use crate::collide::Placement;

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
    drift: DVec3,
    /// Angular velocity, in radians per unit of time.
    spin: DVec3,
    /// A point of the line at the start.
    center: DVec3,
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
    pub(super) fn validate(&self) -> Result<(), String> {
        let Self { linear, angular } = *self;
        match in_range(linear) && in_range(angular) {
            true => Ok(()),
            false => Err(format!("velocity {linear:?}, angular {angular:?}; {EXPECTED}")),
        }
    }
}

impl Motion {
    /// Checks the numbers. The error describes the fault.
    pub(super) fn validate(&self) -> Result<(), String> {
        match *self {
            Self::Linear { velocity } => velocity.validate(),
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
                rotation: rotated(DQuat::from_scaled_axis(t * velocity.angular), start.rotation),
            },
            Self::Screw { point, axis, angular_speed, pitch } => {
                let (axis, angle) = (axis.normalize_or_zero(), t * angular_speed);
                let rotation = DQuat::from_axis_angle(axis, angle);
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
    pub(super) fn twist(&self, start: Pose) -> Twist {
        match *self {
            Self::Rest => Twist { drift: DVec3::ZERO, spin: DVec3::ZERO, center: start.translation },
            Self::Linear { velocity } => {
                Twist { drift: velocity.linear, spin: velocity.angular, center: start.translation }
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

    /// The greatest speed that the rotation gives a point of a shape placed at the start. For a
    /// rounded shape, a point of its core: the ball around a point moves with the point.
    fn rotation_speed(&self, shape: &Shape, placement: Placement) -> f64 {
        let axis = self.spin.normalize_or_zero();
        if axis == DVec3::ZERO {
            return 0.0;
        }
        let from_axis = |p: DVec3| (placement.to_world(p) - self.center).cross(axis).length();
        let greatest = |points: &mut dyn Iterator<Item = DVec3>| points.map(from_axis).fold(0.0, f64::max);
        let arm = match *shape {
            // Only corners of faces; a file may have other vertices.
            Shape::Mesh(ref asset) => {
                let corner = |v: &u32| DVec3::from_array(asset.vertices[*v as usize]);
                greatest(&mut asset.faces.as_flattened().iter().map(corner))
            }
            Shape::Box { half_extents } => greatest(&mut (0..8u32).map(|k| {
                let sign = |bit: u32| if k >> bit & 1 == 0 { -1.0 } else { 1.0 };
                half_extents * DVec3::new(sign(0), sign(1), sign(2))
            })),
            Shape::Sphere { .. } => from_axis(DVec3::ZERO),
            Shape::Capsule { half_height, .. } => {
                greatest(&mut [-half_height, half_height].into_iter().map(|z| DVec3::new(0.0, 0.0, z)))
            }
            Shape::Plane => f64::INFINITY,
        };
        self.spin.length() * arm
    }
}

/// Upper bound of the speed at which any point of one body can approach any point of the other, at
/// any time.
///
/// The speed of a point is its body's drift plus a part perpendicular to the axis, which is at most
/// the rotation speed. When both bodies rotate about one direction (or one does not rotate), the
/// drift along the axis is perpendicular to the rotation. In general the parts add up.
pub fn closing_speed(bodies: [(Twist, &Shape, Placement); 2]) -> f64 {
    let [rotation_a, rotation_b] =
        bodies.map(|(twist, shape, placement)| twist.rotation_speed(shape, placement));
    let [a, b] = bodies.map(|(twist, ..)| twist);
    let (drift, rotation) = (a.drift - b.drift, rotation_a + rotation_b);
    let one_axis = a.spin.cross(b.spin) == DVec3::ZERO;
    let speed = if one_axis && rotation > 0.0 {
        let axis = if rotation_a > 0.0 { a.spin } else { b.spin }.normalize_or_zero();
        let along = drift.dot(axis);
        along.hypot((drift - along * axis).length() + rotation)
    } else {
        drift.length() + rotation
    };
    // Margin for rounding.
    speed * (1.0 + 1e-12)
}

#[cfg(test)]
mod tests {
    use super::*;

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

    #[test]
    fn no_point_is_faster_than_the_bound() {
        let shape = Shape::Box { half_extents: DVec3::new(1.0, 2.0, 0.5) };
        let start = Pose::new(DVec3::new(0.3, 0.1, -2.0), DQuat::from_rotation_y(1.1)).expect("a pose");
        let placement = Placement { pose: start, scale: 2.0 };
        let motions = [
            Motion::Linear {
                velocity: Velocity {
                    linear: DVec3::new(1.0, -2.0, 0.5),
                    angular: DVec3::new(0.2, 0.7, -0.4),
                },
            },
            Motion::Screw {
                point: DVec3::new(0.0, 1.0, 0.0),
                axis: DVec3::ONE,
                angular_speed: 3.0,
                pitch: 4.0,
            },
        ];
        for motion in motions {
            let rest = (Motion::Rest.twist(start), &shape, placement);
            let bound = closing_speed([(motion.twist(start), &shape, placement), rest]);
            let mut fastest = 0.0f64;
            for k in 0..8u32 {
                let corner =
                    DVec3::new(f64::from(k & 1), f64::from(k >> 1 & 1), f64::from(k >> 2)) * 2.0 - 1.0;
                let p = 2.0 * corner * DVec3::new(1.0, 2.0, 0.5);
                for i in 0..200 {
                    let (t, dt) = (0.01 * f64::from(i), 1e-6);
                    let at = |t: f64| motion.pose_at(start, t).to_world(p);
                    fastest = fastest.max((at(t + dt) - at(t - dt)).length() / (2.0 * dt));
                }
            }
            assert!(fastest <= bound * (1.0 + 1e-8), "{motion:?}: {fastest} {bound}");
            assert!(fastest >= 0.7 * bound, "{motion:?}: {fastest} {bound}");
        }
    }
}
