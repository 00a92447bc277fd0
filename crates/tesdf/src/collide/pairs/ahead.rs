//! How far a detection looks ahead: by how much velocities can change the distance between two
//! instances within a time.
use glam::DVec3;

use crate::collide::scene::error::CollideError;
use crate::collide::scene::ids::InstanceId;
use crate::collide::scene::shape::Shape;
use crate::collide::scene::{Instance, Scene, Velocity};
use crate::geometry::Aabb;

/// The motion of an instance within a time. As in [`Motion::Linear`](crate::collide::Motion::Linear), the
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
    /// The normal of a plane that does not turn.
    pub normal: Option<DVec3>,
}

impl Ahead {
    /// The motion of an instance in `time`. `shape` is its shape.
    pub fn new(instance: &Instance, shape: &Shape, time: f64) -> Self {
        let Velocity { linear, angular } = instance.velocity;
        let (reach, turn) = (reach(shape.bounds()) * instance.scale, time * angular);
        let is_level = matches!(shape, Shape::Plane) && turn == DVec3::ZERO;
        let normal = is_level.then(|| instance.pose.rotation * DVec3::Z);
        Self { origin: instance.pose.translation, way: time * linear, turn, reach, normal }
    }

    /// The motions of two instances of a scene in `time`.
    pub fn of_both(scene: &Scene, [a, b]: [InstanceId; 2], time: f64) -> Result<[Self; 2], CollideError> {
        let of = |id| {
            let instance = scene.instance(id)?;
            Ok(Self::new(instance, scene.shape(instance.shape)?, time))
        };
        Ok([of(a)?, of(b)?])
    }

    /// Greatest distance that one of its points moves.
    pub fn motion(&self) -> f64 {
        self.way.length() + arc(self.turn, self.reach)
    }

    /// By at most this, a gap can close: [`change`](Self::change), or of a plane that does not turn,
    /// what counts of it. Proof: `docs/math.md`, section 16.
    ///
    /// It does not depend on the velocity that both have in common: bodies that move together as
    /// one rigid body have a bound of nearly zero.
    pub fn closing(&self, other: &Self) -> f64 {
        match (self.normal, other.normal) {
            (_, Some(normal)) => self.onto(other, normal),
            (Some(normal), None) => other.onto(self, normal),
            (None, None) => self.change(other),
        }
    }

    /// Upper bound of the change of the distance between any point of this instance and any point of
    /// the other one.
    pub fn change(&self, other: &Self) -> f64 {
        (self.motion() + other.motion()).min(self.around(other)).min(other.around(self))
    }

    /// How much nearer a point of this instance can come to a plane that does not turn.
    fn onto(&self, plane: &Self, normal: DVec3) -> f64 {
        let down = (plane.way - self.way).dot(normal);
        (down + arc(self.turn.reject_from_normalized(normal), self.reach)).max(0.0)
    }

    /// The motion of the points of this instance as the other one sees it.
    pub fn approach(&self, other: &Self) -> Approach {
        let (way, turn) = (self.way - other.way, self.turn - other.turn);
        let at_origin = way - other.turn.cross(self.origin - other.origin);
        let tilt = other.normal.map_or(turn, |normal| turn.reject_from_normalized(normal));
        let bends = other.turn.cross(way).length() + arc(self.turn, self.reach) * tilt.length();
        // A plane that turns has points at which there is no bound.
        let rest = if bends.is_nan() { f64::INFINITY } else { 0.5 * bends };
        Approach { about: self.origin, way: at_origin, turn, normal: other.normal, rest }
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

/// The motion of the points of an instance as another one sees it, within a time. Proof of the
/// bounds: `docs/math.md`, section 16.
#[derive(Clone, Copy, Debug)]
pub struct Approach {
    /// Where the instance's origin is at the beginning.
    pub about: DVec3,
    /// The way of the origin against the points of the other instance that are there.
    pub way: DVec3,
    /// The rotation against the other instance, in radians.
    pub turn: DVec3,
    /// The normal of the other instance, where it is a plane that does not turn: only motion against
    /// it counts.
    pub normal: Option<DVec3>,
    /// How much farther a point can move, because velocities change on the way.
    pub rest: f64,
}

impl Approach {
    /// By at most this, the gap of any point of the instance that is within `radius` of `center` at
    /// the beginning can close.
    pub fn around(&self, center: DVec3, radius: f64) -> f64 {
        let (way, turn) = self.at(center);
        (self.closing(way) + arc(turn, radius)).max(0.0) + self.rest
    }

    /// What counts of the way of the point at `center`, and of the rotation about it.
    fn at(&self, center: DVec3) -> (DVec3, DVec3) {
        let way = self.way + self.turn.cross(center - self.about);
        match self.normal {
            Some(n) => (way.dot(n) * n, self.turn.reject_from_normalized(n)),
            None => (way, self.turn),
        }
    }

    /// How much nearer a point comes on a way that counts. Negative where it leaves a plane.
    fn closing(&self, way: DVec3) -> f64 {
        self.normal.map_or(way.length(), |n| -way.dot(n))
    }

    /// Whether, within `radius` of `center`, no other approach of the same instance is greater than
    /// this one by more than `slack`. `true` is certain.
    pub fn covers(&self, other: &Self, center: DVec3, radius: f64, slack: f64) -> bool {
        // A plane that turned in one of the two.
        if self.normal.is_some() != other.normal.is_some() {
            return false;
        }
        let [own, its] = [self, other].map(|a| a.at(center));
        let slack = slack + self.rest - other.rest;
        // The share of the own motion that is most like the other one. What is left of it must be
        // small.
        let weight = if radius.is_finite() { radius * radius } else { 0.0 };
        let product = |x: (DVec3, DVec3), y: (DVec3, DVec3)| x.0.dot(y.0) + weight * x.1.dot(y.1);
        let square = product(own, own);
        let share = if square > 0.0 { (product(own, its) / square).clamp(0.0, 1.0) } else { 0.0 };
        let differs = (its.0 - share * own.0).length() + arc(its.1 - share * own.1, radius);
        let least = (self.closing(own.0) - arc(own.1, radius)).max(0.0);
        differs <= slack || self.closing(its.0) + arc(its.1, radius) <= slack + least
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
