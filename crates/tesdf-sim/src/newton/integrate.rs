//! The motion of one body: its velocity without contacts, and its pose after moving at a velocity.
use glam::{DMat3, DQuat, DVec3};
use nalgebra::Vector6;
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
    /// As [`Body::angular_damping`](crate::Body::angular_damping).
    pub angular_damping: f64,
}

/// The velocity after a step of `h` seconds without contacts: what acts from outside, with implicit
/// damping, and an implicit gyroscopic term.
pub fn free_velocity(mass: &MassProperties, state: &State, outside: &Outside, h: f64) -> Vector6<f64> {
    let Outside { gravity, wrench, angular_damping } = *outside;
    let rotation = state.pose.rotation;
    let before = rotation.inverse() * state.angular;
    let inertia = mass.inertia;
    let mut spin = before;
    // Newton's method from ω₀ solves I (ω − ω₀) + h ω × I ω = 0 in the body's frame. The gyroscopic
    // term is small compared with I for any step that resolves the rotation, so a few iterations
    // reach rounding.
    for _ in 0..8 {
        let momentum = inertia * spin;
        let residual = inertia * (spin - before) + h * spin.cross(momentum);
        let jacobian = inertia + h * (cross_matrix(spin) * inertia - cross_matrix(momentum));
        let change = jacobian.inverse() * residual;
        if !change.is_finite() {
            break;
        }
        spin -= change;
        if change.length() <= 1e-15 * spin.length() {
            break;
        }
    }
    let spin = spin / (1.0 + angular_damping * h);
    let turn = rotation * spin + h * (mass.inertia_in_world(state.pose).inverse() * wrench.torque);
    pack(state.linear + h * (gravity + wrench.force / mass.mass), turn)
}

/// The pose after moving for `h` seconds with a constant velocity of `center`, a point of the body
/// in its frame, and a constant angular velocity.
pub fn moved(center: DVec3, pose: Pose, v: &Vector6<f64>, h: f64) -> Pose {
    let (linear, angular) = unpack(v);
    let moved = pose.to_world(center) + h * linear;
    let rotation = (DQuat::from_scaled_axis(h * angular) * pose.rotation).normalize();
    Pose { translation: moved - rotation * center, rotation }
}

fn cross_matrix(a: DVec3) -> DMat3 {
    DMat3::from_cols(DVec3::new(0.0, a.z, -a.y), DVec3::new(-a.z, 0.0, a.x), DVec3::new(a.y, -a.x, 0.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_implicit_gyroscopic_term_solves_its_equation() {
        let mass = MassProperties {
            mass: 2.0,
            center: DVec3::new(0.1, 0.2, 0.3),
            inertia: DMat3::from_diagonal(DVec3::new(1.0, 2.0, 3.0)),
        };
        let rotation = DQuat::from_scaled_axis(DVec3::new(0.2, 0.5, -0.3));
        let mut state = State::at_rest(Pose { translation: DVec3::ONE, rotation });
        state.angular = DVec3::new(3.0, -5.0, 8.0);
        let h = 0.01;
        let mut outside = Outside { gravity: DVec3::NEG_Z, ..Outside::default() };
        let (linear, angular) = unpack(&free_velocity(&mass, &state, &outside, h));
        assert_eq!(linear, DVec3::new(0.0, 0.0, -0.01));
        let i = mass.inertia_in_world(state.pose);
        let residual = i * (angular - state.angular) + h * angular.cross(i * angular);
        assert!(residual.length() < 1e-13, "{residual}");
        outside.angular_damping = 100.0;
        let (same, slower) = unpack(&free_velocity(&mass, &state, &outside, h));
        assert_eq!(same, linear);
        assert!(slower.distance(angular / 2.0) < 1e-15, "{slower} instead of half of {angular}");
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
