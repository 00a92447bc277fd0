//! Geometric stiffness: a body that is pulled turns into the direction of the pull (Tournier,
//! Nesme, Gilles and Faure, *Stable constrained dynamics*, 2015).
//!
//! A force keeps its direction while the body on which it acts turns. So its torque changes: for a
//! force `f` at an arm `r` and a small rotation `θ` across the force by `−(f · r) θ`. The rows of a
//! step know the torque at one pose only. Then a light link that is pulled from both sides turns
//! too far, and back in the next step. So a step gets the energy `½ h² K |ω − ω₀|²` for each body,
//! where `K` is the sum of `f · r`, and `h ω₀` leads to the pose that the rows were found at.
//!
//! A rotation about the force has no such torque at a point, but links touch in several. Without a
//! stiffness for this rotation, a chain whose end weighs a hundred times as much as its links
//! broke. The stiffness of pushes is negative and left out, so the problem stays convex.
use glam::DVec3;
use nalgebra::{Matrix3, Matrix6, Vector6};

use super::rows::{FreeBody, Resistance, Row};

/// Stiffness below this share of a body's moment of inertia is left out: a minimisation without it
/// predicts such a body well enough, and needs no repetition.
const NO_STIFFNESS: f64 = 0.1;

/// The motion of the free bodies without rows: `½ |v − target|²` in the norm of the inertia.
#[derive(Clone, Debug)]
pub struct Motion {
    /// As [`FreeBody::inertia`], with the geometric stiffness.
    pub inertia: Vec<Matrix6<f64>>,
    /// Linear velocity of the centre of mass, m/s, then angular velocity, rad/s.
    pub target: Vec<Vector6<f64>>,
}

impl Motion {
    /// Without geometric stiffness. `target` has the velocities at the end of the step without
    /// rows.
    pub fn new(free: &[FreeBody], target: &[Vector6<f64>]) -> Self {
        Self { inertia: free.iter().map(|body| body.inertia).collect(), target: target.to_vec() }
    }

    /// The same motion with the geometric stiffness of `forces` along `rows`, N or N m, in a step
    /// of `h` seconds. The rows were found at the poses that the velocities of `found_at` lead to.
    /// Returns `None` where the stiffness of no body matters.
    pub fn stiffened(&self, rows: &[Row], forces: &[f64], found_at: &[Vector6<f64>], h: f64) -> Option<Self> {
        let mut stiffness = vec![0.0; self.inertia.len()];
        // Springs are motors, and the contacts of bodies that overlap deeply: their forces are no
        // loads.
        for (row, force) in rows.iter().zip(forces).filter(|(row, _)| row.resistance == Resistance::Rigid) {
            for (side, arm) in row.sides.iter().zip(row.arms) {
                if let Some((body, j)) = side {
                    stiffness[*body] += force * DVec3::new(j[0], j[1], j[2]).dot(arm);
                }
            }
        }
        let mut motion = self.clone();
        let mut is_stiffer = false;
        for (k, stiffness) in stiffness.into_iter().enumerate() {
            let inertia = self.inertia[k].fixed_view::<3, 3>(3, 3).into_owned();
            let added = h * h * stiffness;
            if added <= NO_STIFFNESS * inertia.trace() / 3.0 {
                continue;
            }
            is_stiffer = true;
            // Two squares around different velocities are, up to a constant, one square around
            // their mean.
            let all = inertia + Matrix3::from_diagonal_element(added);
            let angular = |v: &Vector6<f64>| v.fixed_rows::<3>(3).into_owned();
            let momentum = inertia * angular(&self.target[k]) + added * angular(&found_at[k]);
            let Some(mean) = all.cholesky().map(|all| all.solve(&momentum)) else { continue };
            motion.inertia[k].fixed_view_mut::<3, 3>(3, 3).copy_from(&all);
            motion.target[k].fixed_rows_mut::<3>(3).copy_from(&mean);
        }
        is_stiffer.then_some(motion)
    }
}

#[cfg(test)]
mod tests {
    use glam::{DMat3, DQuat};

    use super::*;
    use crate::MassProperties;

    fn pull(arm: DVec3, resistance: Resistance) -> Row {
        let side = Some((0, Vector6::new(0.0, 0.0, 1.0, arm.y, -arm.x, 0.0)));
        Row {
            sides: [side, None],
            arms: [arm, DVec3::ZERO],
            gap: 0.0,
            relaxed_gap: 0.0,
            stiffness: 1.0,
            bounds: [0.0, f64::INFINITY],
            resistance,
            friction: None,
        }
    }

    /// A pendulum of length l, implicitly: (I + h² m g l) ω = I ω*.
    #[test]
    fn a_pull_turns_a_body_back() {
        let inertia = DMat3::from_diagonal(DVec3::new(2e-3, 3e-3, 4e-3));
        let mass = MassProperties { mass: 2.0, center: DVec3::ZERO, inertia };
        let free = [FreeBody::new(0, &mass, DQuat::IDENTITY)];
        let plain = Motion::new(&free, &[Vector6::new(1.0, 2.0, 3.0, 4.0, 5.0, 6.0)]);
        let (h, at_start) = (5e-3, [Vector6::zeros()]);
        let arm = DVec3::new(0.0, 0.0, 0.1);
        let motion =
            |arm, force, resistance| plain.stiffened(&[pull(arm, resistance)], &[force], &at_start, h);
        let stiff = motion(arm, 1e3, Resistance::Rigid).expect("a pull of 1 kN matters");
        let added = h * h * 1e3 * 0.1;
        let expected = Vector6::new(
            1.0,
            2.0,
            3.0,
            4.0 * 2e-3 / (2e-3 + added),
            5.0 * 3e-3 / (3e-3 + added),
            6.0 * 4e-3 / (4e-3 + added),
        );
        assert!((stiff.target[0] - expected).norm() < 1e-14, "{}", stiff.target[0]);
        let force = stiff.inertia[0] * stiff.target[0];
        assert!((force - plain.inertia[0] * plain.target[0]).norm() < 1e-14, "the momentum has changed");
        // From rows that were found where the body goes without them, nothing changes.
        let there = plain.stiffened(&[pull(arm, Resistance::Rigid)], &[1e3], &plain.target, h);
        assert!((there.expect("a pull of 1 kN matters").target[0] - plain.target[0]).norm() < 1e-14);
        // Small pulls, pushes, and springs.
        assert!(motion(arm, 1.0, Resistance::Rigid).is_none());
        assert!(motion(-arm, 1e3, Resistance::Rigid).is_none());
        assert!(motion(arm, 1e3, Resistance::Spring).is_none());
    }
}
