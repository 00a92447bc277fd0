//! How far a detection looks ahead: by how much velocities can change the distance between two
//! instances within a time.
use glam::DVec3;

use super::{Instance, Shape, Velocity};
use crate::geometry::Aabb;

/// The motion of an instance within a time. As in [`Motion::Linear`](super::Motion::Linear), the
/// velocity of its origin and its angular velocity are constant in the world.
#[derive(Clone, Copy, Debug)]
pub struct Ahead {
    /// Its origin at the beginning, in the world.
    pub origin: DVec3,
    /// The way of its origin: velocity times time.
    pub way: DVec3,
    /// Its rotation: angular velocity times time, in radians.
    pub turn: DVec3,
    /// Greatest distance from its origin to one of its points; infinite for a plane.
    pub reach: f64,
}

impl Ahead {
    /// The motion of an instance in `time`. `shape` is its shape.
    pub fn new(instance: &Instance, shape: &Shape, time: f64) -> Self {
        let Velocity { linear, angular } = instance.velocity;
        let reach = reach(shape.bounds()) * instance.scale;
        Self { origin: instance.pose.translation, way: time * linear, turn: time * angular, reach }
    }

    /// Greatest distance that one of its points moves.
    pub fn motion(&self) -> f64 {
        self.way.length() + arc(self.turn, self.reach)
    }

    /// Upper bound of the change of the distance between any point of this instance and any point
    /// of the other one: by this distance, a gap can close. Proof: `docs/math.md`, section 16.
    ///
    /// It does not depend on the velocity that both have in common: bodies that move together as
    /// one rigid body have a bound of nearly zero.
    pub fn closing(&self, other: &Self) -> f64 {
        (self.motion() + other.motion()).min(self.around(other)).min(other.around(self))
    }

    /// The bound by the motion of this instance as the other one sees it, split into that of the
    /// origin and the rotation about it.
    fn around(&self, other: &Self) -> f64 {
        let way = self.way - other.way;
        let from_other = self.origin - other.origin;
        let [begin, end] = [from_other, from_other + way].map(|at| (way - other.turn.cross(at)).length());
        0.5 * (begin + end) + arc(self.turn - other.turn, self.reach)
    }
}

/// Length of the arc of a rotation at a radius, which may be infinite.
fn arc(turn: DVec3, radius: f64) -> f64 {
    if turn == DVec3::ZERO { 0.0 } else { turn.length() * radius }
}

/// Greatest distance from the origin to a point of a box.
fn reach(bounds: Aabb) -> f64 {
    bounds.min.abs().max(bounds.max.abs()).length()
}
