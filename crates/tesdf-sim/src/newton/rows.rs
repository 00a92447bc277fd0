//! From contacts to rows.
use glam::DVec3;
use nalgebra::{Matrix6, Vector6};
use tesdf::collide::{Contact, Pose};

use super::integrate::pack;
use crate::{Mass, MassProperties, State, System};

/// Inertia of a free body in a step: that of its pose at the beginning.
#[derive(Clone, Debug)]
pub struct FreeBody {
    /// The body of the system.
    pub body: usize,
    /// Mass and inertia in the world.
    pub inertia: Matrix6<f64>,
    /// Its inverse.
    pub inverse: Matrix6<f64>,
}

impl FreeBody {
    /// Of a body in a state.
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

/// A gap between bodies that must not close: `gap + h Σ jacobian · v ≥ 0`, by a spring.
#[derive(Clone, Debug)]
pub struct Row {
    /// Up to two free bodies, as numbers of the list of free bodies, and how their velocities open the gap.
    pub sides: [Option<(usize, Vector6<f64>)>; 2],
    /// Gap at the beginning of the step, m.
    pub gap: f64,
    /// The same without what pushes penetrating bodies apart.
    pub relaxed_gap: f64,
    /// K, N/m.
    pub stiffness: f64,
}

impl Row {
    /// Rate of the gap.
    #[inline]
    pub fn rate(&self, velocity: &[Vector6<f64>]) -> f64 {
        self.sides.iter().flatten().map(|(free, jacobian)| jacobian.dot(&velocity[*free])).sum()
    }

    /// A contact without its gap; `None` when neither body is free.
    ///
    /// `free_of` maps bodies to free bodies; `poses` are those that the contact was detected at; `softness` is h² / κ.
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
            // One point for both: the witnesses lie on one line along the normal, so the rate is that of the distance.
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
        })
    }
}
