//! Geometric stiffness: a body that is pulled turns into the direction of the pull (Tournier,
//! Nesme, Gilles and Faure, *Stable constrained dynamics*, 2015).
//!
//! A force keeps its direction while the body on which it acts turns. So its torque changes: for a
//! force `f` at an arm `r` and a small rotation `θ` across the force by `−(f · r) θ`. The rows of a
//! step know the torque at one pose only. Then a light link that is pulled from both sides turns
//! too far, and back in the next step, from h² ω² = 4 on for the frequency ω of its oscillation.
//! That of a link of 50 g and 5 cm under 600 N is 24 at 5 ms.
//!
//! So a step gets the energy `½ J |ω − ω₀|²` for each body, where `J` is a time squared times `K`,
//! the sum of `f · r` over its rows.
//!
//! *Contacts*: J = h² K, and h ω₀ leads to the pose that the contacts were found at.
//!
//! *Joints*: J = β s² K, and ω₀ is the velocity at the start. Where `s` is the time step, this is
//! the method of Newmark (*A method of computation for structural dynamics*, 1959) for that
//! oscillation, linearly implicit: θ₁ − 2 θ₀ + θ₋₁ = −h² ω² (θ₀ + β (θ₁ − 2 θ₀ + θ₋₁)). With β ≥ ¼
//! it is stable for every pull, and takes no energy. J works as an inertia that resists changes of
//! the angular velocity only.
//!
//! The time `s` is the whole step, also for its parts. With the duration of each part, that inertia
//! would come and go with the parts, and bring the energy of its motion: a swinging chain with an
//! end of 400 times the mass of a link gained 3 %, and with 20,000 times it flew apart. But a link
//! that turns far in a step, as the last one of a whip, would feel an inertia that is none: such a
//! chain gained 12 %. So `s` is the time in which a body turns by 0.1 rad, where this is shorter;
//! parts are as short as that. It then loses a third of its energy when it cracks, and none with
//! the duration of each part.
//!
//! A rotation about the force has no such torque at a point, but links touch in several. Without a
//! stiffness for this rotation, a chain whose end weighs a hundred times as much as its links
//! broke. The stiffness of pushes is negative and left out, so the problem stays convex.
use std::ops::Range;

use glam::DVec3;
use nalgebra::{Matrix3, Matrix6, Vector6};

use super::rows::{FreeBody, Resistance, Row, RowForce};

/// A stiffness of contacts below this share of a body's moment of inertia is left out: a
/// minimisation without it predicts such a body well enough, and needs no repetition.
const OF_CONTACTS: f64 = 0.1;

/// The same for joints. With 0.1 a chain with an end of 20,000 times the mass of a link flew apart
/// in steps of 2.5 ms.
const OF_JOINTS: f64 = 0.01;

/// β of Newmark's method.
const BETA: f64 = 0.5;

/// An arm of a joint turns by at most this in a part of a step, rad.
pub const ARM_TURN: f64 = 0.1;

/// What a step starts from.
#[derive(Clone, Copy, Debug)]
pub struct Start<'a> {
    /// Velocities of the free bodies.
    pub velocities: &'a [Vector6<f64>],
    /// Duration of the part of the step, s.
    pub h: f64,
    /// Duration of the whole step, s.
    pub whole: f64,
}

impl Start<'_> {
    /// The inertia of free body `k` per stiffness, s².
    fn inertia_per_stiffness(&self, k: usize) -> f64 {
        let rate = self.velocities[k].fixed_rows::<3>(3).norm();
        let time = (ARM_TURN / rate).min(self.whole).max(self.h);
        BETA * time * time
    }
}

/// The geometric stiffness of each free body, N m.
#[derive(Clone, Debug)]
pub struct Loads {
    contacts: Vec<f64>,
    joints: Vec<f64>,
}

impl Loads {
    /// Of `count` free bodies under `forces` along `rows`, N or N m. The last rows, from
    /// `of_joints` on, are those of joints.
    pub fn new(count: usize, rows: &[Row], forces: &[RowForce], of_joints: usize) -> Self {
        let of = |range: Range<usize>| stiffness(count, &rows[range.clone()], &forces[range]);
        Self { contacts: of(0..of_joints), joints: of(of_joints..rows.len()) }
    }
}

fn stiffness(count: usize, rows: &[Row], forces: &[RowForce]) -> Vec<f64> {
    let mut stiffness = vec![0.0; count];
    // Springs are motors, and the contacts of bodies that overlap deeply: their forces are no
    // loads.
    for (row, force) in rows.iter().zip(forces).filter(|(row, _)| row.resistance == Resistance::Rigid) {
        for (side, arm) in row.sides.iter().zip(row.arms) {
            if let Some((body, j)) = side {
                stiffness[*body] += force.along * DVec3::new(j[0], j[1], j[2]).dot(arm);
            }
        }
    }
    stiffness
}

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

    /// The same motion with the geometric stiffness of `loads`. The contacts were found at the
    /// poses that the velocities of `found_at` lead to. Returns `None` where the stiffness of no
    /// body matters.
    pub fn stiffened(&self, loads: &Loads, found_at: &[Vector6<f64>], start: &Start<'_>) -> Option<Self> {
        let (mut motion, mut is_stiffer) = (self.clone(), false);
        for (k, found_at) in found_at.iter().enumerate() {
            let inertia = self.inertia[k].fixed_view::<3, 3>(3, 3).trace() / 3.0;
            let of_contacts = start.h * start.h * loads.contacts[k];
            let of_joints = start.inertia_per_stiffness(k) * loads.joints[k];
            if of_contacts > OF_CONTACTS * inertia {
                is_stiffer |= motion.hold(k, of_contacts, found_at);
            }
            if of_joints > OF_JOINTS * inertia {
                is_stiffer |= motion.hold(k, of_joints, &start.velocities[k]);
            }
        }
        is_stiffer.then_some(motion)
    }

    /// Whether the stiffness of a body differs from that of `other` by as much as matters; `plain` is
    /// the motion without it.
    pub fn differs(&self, other: &Self, plain: &Self) -> bool {
        let size = |m: &Matrix6<f64>| m.fixed_view::<3, 3>(3, 3).trace();
        let sizes = self.inertia.iter().zip(&other.inertia).zip(&plain.inertia);
        sizes.into_iter().any(|((a, b), m)| (size(a) - size(b)).abs() > OF_JOINTS * size(m))
    }

    /// Adds `½ added |ω − around|²` of body `k`. Two squares around different velocities are, up to
    /// a constant, one square around their mean.
    fn hold(&mut self, k: usize, added: f64, around: &Vector6<f64>) -> bool {
        let inertia = self.inertia[k].fixed_view::<3, 3>(3, 3).into_owned();
        let angular = |v: &Vector6<f64>| v.fixed_rows::<3>(3).into_owned();
        let momentum = inertia * angular(&self.target[k]) + added * angular(around);
        let all = inertia + Matrix3::from_diagonal_element(added);
        let Some(mean) = all.cholesky().map(|all| all.solve(&momentum)) else { return false };
        self.inertia[k].fixed_view_mut::<3, 3>(3, 3).copy_from(&all);
        self.target[k].fixed_rows_mut::<3>(3).copy_from(&mean);
        true
    }
}

#[cfg(test)]
mod tests {
    use glam::{DMat3, DQuat};

    use super::*;
    use crate::MassProperties;
    use crate::newton::rows::{RowId, Stiffness};

    fn pull(arm: DVec3, resistance: Resistance) -> Row {
        let side = Some((0, Vector6::new(0.0, 0.0, 1.0, arm.y, -arm.x, 0.0)));
        Row {
            id: RowId::Joint(0),
            sides: [side, None],
            coupled: Vec::new(),
            point: DVec3::ZERO,
            arms: [arm, DVec3::ZERO],
            gap: 0.0,
            relaxed_gap: 0.0,
            stiffness: Stiffness::Relative(1.0),
            bounds: [0.0, f64::INFINITY],
            resistance,
            friction: None,
        }
    }

    const INERTIA: DVec3 = DVec3::new(2e-3, 3e-3, 4e-3);

    /// A body whose velocities without rows are 1 to 3 m/s and 4 to 6 rad/s.
    fn plain() -> Motion {
        let inertia = DMat3::from_diagonal(INERTIA);
        let mass = MassProperties { mass: 2.0, center: DVec3::ZERO, inertia };
        Motion::new(
            &[FreeBody::new(0, &mass, DQuat::IDENTITY)],
            &[Vector6::new(1.0, 2.0, 3.0, 4.0, 5.0, 6.0)],
        )
    }

    const H: f64 = 5e-3;

    /// The body under 1 kN, which matters, or another force along a row.
    fn stiffened(row: Row, force: f64, of_joints: usize, around: &Vector6<f64>) -> Option<Motion> {
        let loads = Loads::new(1, &[row], &[RowForce { along: force, ..RowForce::default() }], of_joints);
        let (around, other) = ([*around], [Vector6::repeat(7.0)]);
        let [found_at, velocities] = if of_joints == 0 { [&other, &around] } else { [&around, &other] };
        plain().stiffened(&loads, found_at, &Start { velocities, h: H, whole: H })
    }

    /// (I + J) ω = I ω* + J ω₀, with J = h² m g l of contacts and β h² m g l of joints.
    #[test]
    fn a_pull_holds_the_angular_velocity() {
        let (plain, arm, force) = (plain(), DVec3::new(0.0, 0.0, 0.1), 1e3);
        let around = Vector6::new(0.0, 0.0, 0.0, 3.0, -2.0, 1.0);
        for (of_joints, beta, weak) in [(0, BETA, 0.1), (1, 1.0, 1.0)] {
            let motion =
                |arm, force, resistance, around| stiffened(pull(arm, resistance), force, of_joints, around);
            let stiff = motion(arm, force, Resistance::Rigid, &around).unwrap();
            let added = beta * H * H * force * arm.z;
            let mean = |k: usize, inertia: f64| {
                (inertia * plain.target[0][k] + added * around[k]) / (inertia + added)
            };
            let expected =
                Vector6::new(1.0, 2.0, 3.0, mean(3, INERTIA.x), mean(4, INERTIA.y), mean(5, INERTIA.z));
            assert!((stiff.target[0] - expected).norm() < 1e-14, "{}", stiff.target[0]);
            // Where the velocity does not change, nothing does.
            let same = motion(arm, force, Resistance::Rigid, &plain.target[0]).unwrap();
            assert!((same.target[0] - plain.target[0]).norm() < 1e-14);
            // Small pulls, pushes, and springs.
            assert!(motion(arm, weak, Resistance::Rigid, &around).is_none());
            assert!(motion(-arm, force, Resistance::Rigid, &around).is_none());
            assert!(motion(arm, force, Resistance::Spring, &around).is_none());
        }
    }

    /// The inertia of a joint's pull is that of the whole step, and less where a body turns far in
    /// it.
    #[test]
    fn parts_of_a_step_have_the_inertia_of_the_step() {
        let plain = plain();
        let loads = Loads { contacts: vec![0.0], joints: vec![1e4] };
        let time = |rate: f64, h: f64| {
            let velocities = [Vector6::new(0.0, 0.0, 0.0, 0.0, 0.0, rate)];
            let start = Start { velocities: &velocities, h, whole: H };
            let motion = plain.stiffened(&loads, &velocities, &start).unwrap();
            ((motion.inertia[0] - plain.inertia[0])[(5, 5)] / (BETA * 1e4)).sqrt()
        };
        for (rate, h, expected) in [(0.0, H, H), (10.0, 1e-3, H), (50.0, 1e-3, 2e-3), (500.0, 1e-3, 1e-3)] {
            let found = time(rate, h);
            assert!((found - expected).abs() < 1e-12, "{rate} rad/s, {h} s: {found} s");
        }
    }
}
