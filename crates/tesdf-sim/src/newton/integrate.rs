//! The motion of one body: what acts on it from outside, and its pose after moving at a velocity.
use glam::DVec3;
use nalgebra::Vector6;
use tesdf::base::elementary;
use tesdf::collide::Pose;

use crate::{MassProperties, State, Wrench};

/// Linear velocity of the centre of mass, then angular velocity, both in the world frame.
pub fn velocity(state: &State) -> Vector6<f64> {
    pack(state.linear, state.angular)
}

/// Joins two vectors into one.
pub fn pack(a: DVec3, b: DVec3) -> Vector6<f64> {
    Vector6::new(a.x, a.y, a.z, b.x, b.y, b.z)
}

/// Splits a vector into its first three and last three components.
pub fn unpack(v: &Vector6<f64>) -> (DVec3, DVec3) {
    (DVec3::new(v[0], v[1], v[2]), DVec3::new(v[3], v[4], v[5]))
}

/// What acts on a body besides contacts and joints.
#[derive(Clone, Copy, Debug, Default)]
pub struct Outside {
    /// Acceleration, m/s².
    pub gravity: DVec3,
    /// Force and torque.
    pub wrench: Wrench,
    /// As [`Body::linear_damping`](crate::Body::linear_damping).
    pub linear_damping: f64,
    /// As [`Body::angular_damping`](crate::Body::angular_damping).
    pub angular_damping: f64,
}

/// The velocity of the centre of mass after a step of `h` seconds without contacts.
pub fn free_linear(mass: &MassProperties, state: &State, outside: &Outside, h: f64) -> DVec3 {
    state.linear / (1.0 + outside.linear_damping * h)
        + h * (outside.gravity + outside.wrench.force / mass.mass)
}

/// The pose after moving for `h` seconds with a constant velocity of `center`, a point of the body
/// in its frame, and a constant angular velocity.
pub fn moved(center: DVec3, pose: Pose, v: &Vector6<f64>, h: f64) -> Pose {
    let (linear, angular) = unpack(v);
    let moved = pose.to_world(center) + h * linear;
    let rotation = (elementary::from_scaled_axis(h * angular) * pose.rotation).normalize();
    Pose { translation: moved - rotation * center, rotation }
}

#[cfg(test)]
mod tests {
    use glam::DMat3;

    use glam::DQuat;

    use super::*;

    #[test]
    fn gravity_and_a_force_accelerate_the_centre_of_mass() {
        let (center, inertia) = (DVec3::new(0.1, 0.2, 0.3), DMat3::IDENTITY);
        let mass = MassProperties { mass: 2.0, center, inertia };
        let state = State { linear: DVec3::X, ..State::at_rest(Pose::IDENTITY) };
        let wrench = Wrench { force: DVec3::new(0.0, 4.0, 0.0), torque: DVec3::ONE };
        let outside = Outside { gravity: DVec3::NEG_Z, wrench, ..Outside::default() };
        let linear = free_linear(&mass, &state, &outside, 0.01);
        assert!(linear.distance(DVec3::new(1.0, 0.02, -0.01)) < 1e-15, "{linear}");
        let outside = Outside { linear_damping: 25.0, ..outside };
        let linear = free_linear(&mass, &state, &outside, 0.01);
        assert!(linear.distance(DVec3::new(0.8, 0.02, -0.01)) < 1e-15, "{linear}");
    }

    #[test]
    fn rotation_keeps_the_centre_of_mass_in_place() {
        let center = DVec3::new(0.1, 0.2, 0.3);
        let pose = Pose::at(DVec3::new(1.0, 2.0, 3.0));
        let turned = moved(center, pose, &pack(DVec3::ZERO, DVec3::new(0.0, 0.0, 100.0)), 0.01);
        assert!(turned.to_world(center).distance(pose.to_world(center)) < 1e-15);
        assert!(turned.rotation.angle_between(DQuat::from_rotation_z(1.0)) < 1e-7);
    }
}
