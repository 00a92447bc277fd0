//! One row of the convex problem: its force, and how the force changes.
use glam::{DMat3, DVec3};
use nalgebra::Vector6;

use super::integrate::{pack, unpack};
use super::linear::BlockMatrix;
use super::rows::{Friction, PUSHES, Resistance, Row};

/// A motor that exceeds its target by this share does not stall at first.
const FASTER: f64 = 0.1;

/// A row whose bodies are indices within the island. It has only what a minimisation reads, because
/// all springs are read many times.
#[derive(Clone, Debug)]
pub struct Spring {
    pub sides: [Option<(usize, Vector6<f64>)>; 2],
    /// As [`Row::arms`].
    pub arms: [DVec3; 2],
    /// The gap that counts: with the correction of a penetration, or without.
    pub gap: f64,
    /// The pair of the two bodies in the pattern of the matrix.
    pub pair: Option<usize>,
    pub stiffness: f64,
    pub bounds: [f64; 2],
    pub resistance: Resistance,
    pub friction: Option<Box<Friction>>,
}

/// How far a row is from the state in which its force is the one that it keeps.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Deflection {
    /// The gap at the end of the step, less `compression`.
    pub gap: f64,
    /// The compression of the spring when the gap is zero: the force that is kept, divided by the
    /// stiffness.
    compression: f64,
    /// The way that a contact slides in the step, less `drag`, m.
    slip: DVec3,
    /// The same as `compression`, for friction, m.
    drag: DVec3,
    /// The limit of the friction force, N. It lags: it follows from the push of the contact in the
    /// minimisation before.
    grip: f64,
    /// The force of a motor that stalls, N or N m; 0 for all others.
    stall: f64,
}

/// Whether the limits of friction follow the pushes of the contacts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Grips {
    Follow,
    Stay,
}

/// The change of a deflection by a change of the velocities.
#[derive(Clone, Copy, Debug)]
pub struct Change {
    gap: f64,
    slip: DVec3,
}

impl Spring {
    /// The spring of a row with this gap; the pattern is not known yet.
    pub fn new(row: &Row, gap: f64) -> Self {
        let Row { sides, arms, stiffness, bounds, resistance, friction, .. } = *row;
        Self { sides, arms, gap, pair: None, stiffness, bounds, resistance, friction: friction.map(Box::new) }
    }

    /// The deflection at `velocity`, when no force is kept yet.
    pub fn deflection(&self, velocity: &[Vector6<f64>], h: f64) -> Deflection {
        let change = self.change(velocity, h);
        let way = self.friction.as_ref().map_or(DVec3::ZERO, |friction| friction.way);
        Deflection { gap: self.gap + change.gap, slip: way + change.slip, ..Deflection::default() }
    }

    /// The deflection from which a minimisation starts at `velocity`. A motor stalls at first where
    /// its target is so slow that, as a spring, it would not reach its limit. Its force would build
    /// up over several minimisations, and a part that is held by this force alone would slip
    /// before.
    pub fn start(&self, velocity: &[Vector6<f64>], h: f64) -> Deflection {
        let at = self.deflection(velocity, h);
        let [_, limit] = self.bounds;
        let is_slow = self.stiffness * self.gap.abs() < limit;
        let is_faster = at.gap * self.gap <= -FASTER * self.gap * self.gap;
        let stalls = self.resistance == Resistance::Motor && is_slow && !is_faster;
        Deflection { stall: if stalls { limit.copysign(-self.gap) } else { 0.0 }, ..at }
    }

    /// What `velocity` adds to the deflection in `h` seconds.
    pub fn change(&self, velocity: &[Vector6<f64>], h: f64) -> Change {
        let slip = |friction: &Friction| {
            let of_side = |(side, arm): (&Option<(usize, Vector6<f64>)>, DVec3)| {
                side.map_or(DVec3::ZERO, |(body, _)| {
                    let (linear, angular) = unpack(&velocity[body]);
                    linear + angular.cross(arm)
                })
            };
            let [a, b] = [0, 1].map(|k| of_side((&self.sides[k], self.arms[k])));
            h * (a - b).reject_from_normalized(friction.normal)
        };
        Change { gap: h * self.rate(velocity), slip: self.friction.as_deref().map_or(DVec3::ZERO, slip) }
    }

    #[inline]
    pub fn rate(&self, velocity: &[Vector6<f64>]) -> f64 {
        self.sides.iter().flatten().map(|(body, j)| j.dot(&velocity[*body])).sum()
    }

    /// Whether the spring is a contact: it pushes only.
    pub fn is_contact(&self) -> bool {
        self.bounds == PUSHES
    }

    fn is_rigid(&self) -> bool {
        matches!(self.resistance, Resistance::Rigid | Resistance::Motor)
    }

    fn stiffening(&self, stiffening: f64) -> f64 {
        if self.is_rigid() { stiffening } else { 1.0 }
    }

    /// The force along the row's sides, N or N m, and its derivative by the deflection with the
    /// opposite sign.
    #[inline]
    pub fn force(&self, at: &Deflection, stiffening: f64) -> (f64, f64) {
        if at.is_stalled() {
            return (at.stall, 0.0);
        }
        let stiffness = self.stiffness * self.stiffening(stiffening);
        let [least, most] = self.bounds;
        match -stiffness * at.gap {
            force if force <= least => (least, 0.0),
            force if force >= most => (most, 0.0),
            force => (force, stiffness),
        }
    }

    /// The friction on the first side, N, and its derivative by the slip with the opposite sign.
    fn friction(&self, at: &Deflection, stiffening: f64) -> Option<(DVec3, DMat3)> {
        let friction = self.friction.as_ref().filter(|_| at.grip > 0.0)?;
        let stiffness = friction.stiffness * self.stiffening(stiffening);
        let slip = at.slip.length();
        let n = friction.normal;
        let tangent = DMat3::IDENTITY - outer(n);
        if stiffness * slip <= at.grip {
            return Some((-stiffness * at.slip, stiffness * tangent));
        }
        let along = at.slip / slip;
        Some((-at.grip * along, at.grip / slip * (tangent - outer(along))))
    }

    /// Whether the two deflections are in the same piece of the force, and it is linear there.
    pub fn is_linear_between(&self, from: &Deflection, to: &Deflection, stiffening: f64) -> bool {
        let sticks = |at: &Deflection| {
            let friction = self.friction.as_ref().filter(|_| at.grip > 0.0);
            friction.is_none_or(|friction| {
                friction.stiffness * self.stiffening(stiffening) * at.slip.length() <= at.grip
            })
        };
        let piece = |at: &Deflection| {
            let (force, stiffness) = self.force(at, stiffening);
            (stiffness > 0.0, stiffness == 0.0 && force > self.bounds[0])
        };
        piece(from) == piece(to) && sticks(from) && sticks(to)
    }

    /// Adds the force at a deflection to the generalised forces of the bodies, times `h`.
    pub fn push(&self, at: &Deflection, stiffening: f64, h: f64, forces: &mut [Vector6<f64>]) {
        let (force, _) = self.force(at, stiffening);
        if force != 0.0 {
            self.sides.iter().flatten().for_each(|(body, j)| forces[*body].axpy(h * force, j, 1.0));
        }
        if let Some((force, _)) = self.friction(at, stiffening) {
            for (k, sign) in [(0, h), (1, -h)] {
                if let Some((body, _)) = self.sides[k] {
                    forces[body] += pack(sign * force, self.arms[k].cross(sign * force));
                }
            }
        }
    }

    /// Adds the second derivative of the spring's energy by the velocities, times 1 / h².
    pub fn stiffen(&self, at: &Deflection, stiffening: f64, h2: f64, matrix: &mut BlockMatrix<'_>) {
        let (_, stiffness) = self.force(at, stiffening);
        if stiffness > 0.0 {
            matrix.add(&self.sides, self.pair, h2 * stiffness);
        }
        if let Some((_, derivative)) = self.friction(at, stiffening) {
            let point = |k: usize| self.sides[k].map(|(body, _)| (body, self.arms[k]));
            matrix.add_point([point(0), point(1)], self.pair, h2 * derivative);
        }
    }

    /// The power of the force against a change of the deflection, and how it grows along it.
    #[inline]
    pub fn resist(&self, at: &Deflection, change: &Change, stiffening: f64) -> (f64, f64) {
        let (force, stiffness) = self.force(at, stiffening);
        let (mut value, mut slope) = (-force * change.gap, stiffness * change.gap * change.gap);
        if let Some((force, derivative)) = self.friction(at, stiffening) {
            value -= force.dot(change.slip);
            slope += change.slip.dot(derivative * change.slip);
        }
        (value, slope)
    }

    /// The distance by which a rigid row gives way or keeps a force that it should not, and the
    /// distance that corresponds to its force.
    pub fn error(&self, at: &Deflection, stiffening: f64) -> [f64; 2] {
        if !self.is_rigid() {
            return [0.0; 2];
        }
        let force = self.force(at, stiffening).0 / (self.stiffness * stiffening);
        if at.is_stalled() {
            return [self.excess(at), force.abs()];
        }
        let mut error = [(force - at.compression).abs(), force.abs()];
        if let (Some(friction), Some((force, _))) = (&self.friction, self.friction(at, stiffening)) {
            let force = force / (friction.stiffness * stiffening);
            error = [error[0].max((force - at.drag).length()), error[1].max(force.length())];
        }
        error
    }

    /// The limit of the friction force, N, that follows from the contact's push, and the present
    /// one.
    pub fn grips(&self, at: &Deflection, stiffening: f64) -> Option<[f64; 2]> {
        let friction = self.friction.as_ref()?;
        Some([friction.coefficient * self.force(at, stiffening).0, at.grip])
    }

    /// The way by which a stalled motor exceeds its target, m or rad; 0 for all others.
    pub fn excess(&self, at: &Deflection) -> f64 {
        if at.is_stalled() { ((at.gap + at.compression) * at.stall.signum()).max(0.0) } else { 0.0 }
    }

    /// Keeps the present forces of a rigid row as the forces at zero deflection when all rigid rows
    /// become `factor` times as stiff. Where limits of friction follow, the limit becomes that of
    /// the present push.
    pub fn keep(&self, at: &mut Deflection, stiffening: f64, factor: f64, grips: Grips) {
        let grip = match grips {
            Grips::Stay => at.grip,
            Grips::Follow => self.grips(at, stiffening).map_or(0.0, |[next, _]| next),
        };
        if self.is_rigid() {
            let next = self.force(at, stiffening).0 / (self.stiffness * stiffening * factor);
            at.gap += at.compression - next;
            at.compression = next;
            if let Some(friction) = &self.friction {
                let force = self.friction(at, stiffening).map_or(DVec3::ZERO, |(force, _)| force);
                // More than the limit cannot be kept.
                let next = force.clamp_length_max(grip) / (friction.stiffness * stiffening * factor);
                at.slip += at.drag - next;
                at.drag = next;
            }
        }
        at.grip = grip;
    }
}

impl Deflection {
    /// The deflection after a share of a change.
    #[inline]
    pub fn after(&self, change: &Change, share: f64) -> Self {
        Self { gap: self.gap + share * change.gap, slip: self.slip + share * change.slip, ..*self }
    }

    /// Whether this is a motor that pushes with its limit, whatever its rate.
    #[inline]
    pub fn is_stalled(&self) -> bool {
        self.stall != 0.0
    }

    /// Makes a stalled motor a row again.
    pub fn release(&mut self) {
        self.stall = 0.0;
    }

    /// The force that the row keeps, as a compression; used by tests.
    #[cfg(test)]
    pub fn compression(&self) -> f64 {
        self.compression
    }
}

fn outer(a: DVec3) -> DMat3 {
    DMat3::from_cols(a * a.x, a * a.y, a * a.z)
}
