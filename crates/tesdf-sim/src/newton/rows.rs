//! Converts contacts to rows of the convex problem.
use glam::DVec3;
use nalgebra::{Matrix6, Vector6};
use tesdf::collide::{Contact, Pose};

use super::integrate::pack;
use crate::{Mass, MassProperties, State, System};

/// A free body and its inertia, in the pose at the beginning of a step.
#[derive(Clone, Debug)]
pub struct FreeBody {
    /// Index of the body in the system.
    pub body: usize,
    /// Mass and inertia in the world frame: linear components first, then angular.
    pub inertia: Matrix6<f64>,
    /// Inverse of `inertia`.
    pub inverse: Matrix6<f64>,
}

impl FreeBody {
    /// The free body of index `body` in `state`.
    pub fn new(body: usize, mass: &MassProperties, state: &State) -> Self {
        let world = mass.inertia_in_world(state.pose);
        let blocks = |linear: f64, angular: glam::DMat3| {
            let mut m = Matrix6::zeros();
            for k in 0..3 {
                m[(k, k)] = linear;
                for l in 0..3 {
                    m[(3 + k, 3 + l)] = angular.col(l)[k];
                }
            }
            m
        };
        Self { body, inertia: blocks(mass.mass, world), inverse: blocks(1.0 / mass.mass, world.inverse()) }
    }
}

/// A gap between two bodies. A spring keeps `gap + h Σ jacobian · v ≥ 0`.
#[derive(Clone, Debug)]
pub struct Row {
    /// Up to two free bodies: the index of each in the list of free bodies, and the derivative of
    /// the gap by its velocity.
    pub sides: [Option<(usize, Vector6<f64>)>; 2],
    /// Gap at the beginning of the step, m.
    pub gap: f64,
    /// The gap without the correction that pushes penetrating bodies apart, m.
    pub relaxed_gap: f64,
    /// Stiffness K, N/m.
    pub stiffness: f64,
    /// How the contact resists in an island that does not overlap deeply.
    pub resistance: Resistance,
}

/// How a contact resists.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Resistance {
    /// As a spring, which gives way under load.
    Spring,
    /// With the force under which it does not give way.
    Rigid,
}

impl Row {
    /// Rate of change of the gap at `velocity`, m/s.
    #[inline]
    pub fn rate(&self, velocity: &[Vector6<f64>]) -> f64 {
        self.sides.iter().flatten().map(|(free, jacobian)| jacobian.dot(&velocity[*free])).sum()
    }

    /// The row of a contact, with the contact's distance as its gap. Returns `None` when neither
    /// body is free.
    ///
    /// `poses` are the poses at which the contact was detected, `free_of` maps bodies to free
    /// bodies, and `softness` is h² / κ, s².
    pub fn of_contact(
        contact: &Contact,
        system: &System,
        poses: &[Pose],
        free: &[FreeBody],
        free_of: &[Option<usize>],
        softness: f64,
    ) -> Option<Self> {
        let side = |instance, direction: DVec3| {
            let body = system.body_of(instance)?;
            let free = free_of[body]?;
            let Mass::Free(mass) = system.bodies()[body].mass else { return None };
            // Both sides use one point. The closest points lie on a line along the normal, so the
            // rate is the rate of the distance.
            let arm = contact.point_a - poses[body].to_world(mass.center);
            Some((free, pack(direction, arm.cross(direction))))
        };
        let sides = [side(contact.instance_a, contact.normal), side(contact.instance_b, -contact.normal)];
        let weight: f64 = sides.iter().flatten().map(|(k, j)| j.dot(&(free[*k].inverse * j))).sum();
        (weight > 0.0).then(|| Self {
            sides,
            gap: contact.distance,
            relaxed_gap: contact.distance,
            stiffness: 1.0 / (weight * softness),
            resistance: Resistance::Spring,
        })
    }
}
