//! How far a detection looks ahead, as `Ahead` of `tesdf::collide`. This file defines the layout of
//! the motions for the host, which writes them, and for the kernels, which read them.
//!
//! Mirrors `collide/pairs/ahead.rs` of `tesdf`.
use cubecl::prelude::*;
use glam::DVec3;
use tesdf::collide::internal::Ahead as HostAhead;

use crate::kernels::geometry::vector::{Row, V3, last, xyz};
use crate::kernels::query::nearest::FAR;
use crate::kernels::scene::pose::{FarPoint, Pose};

/// Rows of a motion: way and reach; turn and greatest distance that a point moves; origin of the
/// body relative to that of its field.
pub const ROWS: u32 = 3;

/// The motion of an instance within the speculative time.
#[derive(CubeType, Clone, Copy)]
#[expand(derive(Clone, Copy))]
pub struct Ahead {
    /// The origin of the body.
    pub origin: FarPoint,
    /// The way of the origin.
    pub way: V3,
    /// The rotation, in radians.
    pub turn: V3,
    /// Greatest distance from the origin to a point of the body; [`FAR`] for a plane.
    pub reach: f32,
    /// Greatest distance that a point moves.
    pub motion: f32,
}

/// The rows of a motion. `field` is the origin of the instance's field in the world.
pub fn rows(ahead: &HostAhead, field: DVec3) -> [[f32; 4]; 3] {
    let row = |v: DVec3, w: f64| v.extend(w.min(FAR.into())).as_vec4().to_array();
    [row(ahead.way, ahead.reach), row(ahead.turn, ahead.motion()), row(ahead.origin - field, 0.0)]
}

/// Reads the motion in row `at` of an instance whose field has this origin.
#[cube]
pub fn ahead(rows: &[Row], at: u32, field: FarPoint) -> Ahead {
    let at = at as usize;
    let (p, q, r) = (rows[at], rows[at + 1], rows[at + 2]);
    Ahead {
        origin: FarPoint { high: field.high, low: field.low + xyz(r) },
        way: xyz(p),
        turn: xyz(q),
        reach: last(p),
        motion: last(q),
    }
}

/// The motion of the points of an instance as another one sees it, as `Approach` of
/// `tesdf::collide`. A point p moves by `way` + `turn` × p, up to `rest`.
#[derive(CubeType, Clone, Copy)]
#[expand(derive(Clone, Copy))]
pub struct Approach {
    pub way: V3,
    pub turn: V3,
    pub rest: f32,
}

#[cube]
impl Approach {
    /// Upper bound of the change of the distance between any point of the instance within `radius`
    /// of `p`, and any point of the other one.
    pub fn around(self, p: V3, radius: f32) -> f32 {
        (self.way + self.turn.cross(p)).length() + self.turn.length() * radius + self.rest
    }
}

/// The greatest distance that a point moves, from the motion in row `at`.
#[cube]
pub fn motion(rows: &[Row], at: u32) -> f32 {
    last(rows[(at + 1u32) as usize])
}

#[cube]
impl Ahead {
    /// Upper bound of the change of the distance between any two points of the instances.
    pub fn closing(self, other: Ahead) -> f32 {
        (self.motion + other.motion).min(self.around(other)).min(other.around(self))
    }

    /// The motion of the points of this instance as the other one sees it, in the frame of a field
    /// with the pose `to`.
    pub fn approach(self, other: Ahead, to: Pose) -> Approach {
        let (way, turn) = (self.way - other.way, self.turn - other.turn);
        let at_origin = way - other.turn.cross(self.origin.from(other.origin));
        let bends = other.turn.cross(way).length() + self.turn.length() * turn.length() * self.reach;
        let unit = 1.0f32 / to.unit;
        let turn = to.rotation.rotate_back(turn);
        let way = to.rotation.rotate_back(at_origin) * unit - turn.cross(to.to_local(self.origin));
        Approach { way, turn, rest: 0.5f32 * bends * unit }
    }

    /// The bound by the motion of this instance as the other one sees it, split into that of the
    /// origin and the rotation about it.
    fn around(self, other: Ahead) -> f32 {
        let way = self.way - other.way;
        let from_other = self.origin.from(other.origin);
        let begin = (way - other.turn.cross(from_other)).length();
        let end = (way - other.turn.cross(from_other + way)).length();
        0.5f32 * (begin + end) + (self.turn - other.turn).length() * self.reach
    }
}

#[cfg(test)]
mod tests {
    use glam::{DQuat, Vec3};

    use super::*;
    use crate::collide::scene::placed::split;
    use crate::kernels::geometry::vector::v3;
    use crate::kernels::scene::pose::Rotation;

    /// The bounds are those of the host, for motions of every size and for planes.
    #[test]
    fn bounds_are_those_of_the_host() {
        let mut random = fastrand::Rng::with_seed(4);
        let mut vector = |size: f64| size * DVec3::from_array(std::array::from_fn(|_| random.f64() - 0.5));
        let of = |v: Vec3| v3(v.x, v.y, v.z);
        let far = |p: DVec3| {
            let (high, low) = split(p);
            FarPoint { high: of(high), low: of(low) }
        };
        let device = |host: &HostAhead, field: DVec3| {
            let [p, q, r] = rows(host, field).map(|[x, y, z, w]| (v3(x, y, z), w));
            let FarPoint { high, low } = far(field);
            let origin = FarPoint { high, low: low + r.0 };
            Ahead { origin, way: p.0, turn: q.0, reach: p.1, motion: q.1 }
        };
        for k in 0..5000 {
            let size = 10f64.powi(k % 5 - 3);
            let common = (vector(size), vector(size));
            let mut body = |k: i32| HostAhead {
                origin: vector(4.0),
                way: common.0 + vector(if k % 3 == 0 { 0.0 } else { 0.1 * size }),
                turn: common.1 + vector(if k % 2 == 0 { 0.0 } else { 0.1 * size }),
                reach: 1.0,
            };
            let (mut a, b) = (body(k), body(k / 2));
            if k % 7 == 0 {
                (a.reach, a.turn) = (f64::INFINITY, if k % 2 == 0 { DVec3::ZERO } else { a.turn });
            }
            let (x, y) = (device(&a, a.origin + vector(1.0)), device(&b, b.origin + vector(1.0)));
            let (expected, found) = (a.closing(&b), x.closing(y));
            let bound = 2e-6 * (1.0 + 10.0 * size) * (1.0 + 10.0 * size);
            assert!(
                (f64::from(found) - expected).abs() < bound,
                "{found} instead of {expected}: {a:?} {b:?}"
            );
            assert_eq!(found, y.closing(x));
            // A field with another origin and unit than its body.
            let rotation = DQuat::from_scaled_axis(vector(4.0));
            let q = rotation.as_quat();
            let to = Pose {
                origin: far(b.origin + vector(1.0)),
                rotation: Rotation { axis: v3(q.x, q.y, q.z), scalar: q.w },
                unit: 2.0,
            };
            let (p, radius) = (a.origin + vector(2.0), vector(1.0).length());
            let expected = a.approach(&b).around(p, radius);
            let found = x.approach(y, to).around(to.to_local(far(p)), 0.5 * radius as f32);
            assert!(
                (2.0 * f64::from(found) - expected).abs() < 4.0 * bound || expected > 1e20,
                "{found} instead of half of {expected} at {p}: {a:?} {b:?}"
            );
        }
    }
}
