//! How far a detection looks ahead, as `Ahead` of `tesdf::collide`. This file defines the layout of
//! the motions for the host, which writes them, and for the kernels, which read them.
//!
//! Mirrors `collide/pairs/ahead.rs` of `tesdf`.
use cubecl::prelude::*;
use glam::DVec3;
use tesdf::collide::internal::Ahead as HostAhead;

use crate::kernels::geometry::vector::{Row, V3, last, v3, xyz};
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
    /// The axis z of the body, the normal of a plane.
    pub normal: V3,
}

/// The rows of a motion. `field` is the origin of the instance's field in the world.
pub fn rows(ahead: &HostAhead, field: DVec3) -> [[f32; 4]; 3] {
    let row = |v: DVec3, w: f64| v.extend(w.min(FAR.into())).as_vec4().to_array();
    [row(ahead.way, ahead.reach), row(ahead.turn, ahead.motion()), row(ahead.origin - field, 0.0)]
}

/// Reads the motion in row `at` of an instance whose field has this pose.
#[cube]
pub fn ahead(rows: &[Row], at: u32, field: Pose) -> Ahead {
    let at = at as usize;
    let (p, q, r) = (rows[at], rows[at + 1], rows[at + 2]);
    Ahead {
        origin: FarPoint { high: field.origin.high, low: field.origin.low + xyz(r) },
        way: xyz(p),
        turn: xyz(q),
        reach: last(p),
        motion: last(q),
        normal: field.rotation.rotate(v3(0.0f32, 0.0f32, 1.0f32)),
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
    /// 1 where the other one is a plane that does not turn, z = 0: only motion against it counts.
    pub is_over_plane: f32,
}

#[cube]
impl Approach {
    /// By at most this, the gap of any point of the instance within `radius` of `p` can close.
    pub fn around(self, p: V3, radius: f32) -> f32 {
        let way = self.way + self.turn.cross(p);
        let tilt = v3(self.turn.x, self.turn.y, 0.0f32).length();
        let fall = (tilt * radius - way.z).max(0.0f32);
        let closing = way.length() + self.turn.length() * radius;
        select(self.is_over_plane == 1.0f32, fall, closing) + self.rest
    }
}

/// The greatest distance that a point moves, from the motion in row `at`.
#[cube]
pub fn motion(rows: &[Row], at: u32) -> f32 {
    last(rows[(at + 1u32) as usize])
}

#[cube]
impl Ahead {
    /// By at most this, a gap between the instances can close.
    pub fn closing(self, other: Ahead) -> f32 {
        let mut closing = (self.motion + other.motion).min(self.around(other)).min(other.around(self));
        if other.is_level() {
            closing = self.onto(other);
        } else if self.is_level() {
            closing = other.onto(self);
        }
        closing
    }

    /// Whether it is a plane that does not turn.
    fn is_level(self) -> bool {
        self.reach == FAR && self.turn.length() == 0.0f32
    }

    /// How much nearer a point of this instance can come to a plane that does not turn.
    fn onto(self, plane: Ahead) -> f32 {
        let down = (plane.way - self.way).dot(plane.normal);
        (down + self.turn.cross(plane.normal).length() * self.reach).max(0.0f32)
    }

    /// The motion of the points of this instance as the other one sees it, in the frame of a field
    /// with the pose `to`.
    pub fn approach(self, other: Ahead, to: Pose) -> Approach {
        let (way, turn) = (self.way - other.way, self.turn - other.turn);
        let at_origin = way - other.turn.cross(self.origin.from(other.origin));
        let is_over_plane = select(other.is_level(), 1.0f32, 0.0f32);
        let counts = select(other.is_level(), turn.cross(other.normal).length(), turn.length());
        let bends = other.turn.cross(way).length() + self.turn.length() * counts * self.reach;
        let unit = 1.0f32 / to.unit;
        let turn = to.rotation.rotate_back(turn);
        let way = to.rotation.rotate_back(at_origin) * unit - turn.cross(to.to_local(self.origin));
        Approach { way, turn, rest: 0.5f32 * bends * unit, is_over_plane }
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
            let normal = of(host.normal.unwrap_or(DVec3::Z).as_vec3());
            Ahead { origin, way: p.0, turn: q.0, reach: p.1, motion: q.1, normal }
        };
        for k in 0..5000 {
            let size = 10f64.powi(k % 5 - 3);
            let common = (vector(size), vector(size));
            let mut body = |k: i32| HostAhead {
                origin: vector(4.0),
                way: common.0 + vector(if k % 3 == 0 { 0.0 } else { 0.1 * size }),
                turn: common.1 + vector(if k % 2 == 0 { 0.0 } else { 0.1 * size }),
                reach: 1.0,
                normal: None,
            };
            let (mut a, b) = (body(k), body(k / 2));
            if k % 7 == 0 {
                a.reach = f64::INFINITY;
                if k % 2 == 0 {
                    (a.turn, a.normal) = (DVec3::ZERO, Some(vector(1.0).normalize()));
                }
            }
            let (x, y) = (device(&a, a.origin + vector(1.0)), device(&b, b.origin + vector(1.0)));
            let (expected, found) = (a.closing(&b), x.closing(y));
            let bound = 2e-6 * (1.0 + 10.0 * size) * (1.0 + 10.0 * size);
            assert!(
                (f64::from(found) - expected).abs() < bound,
                "{found} instead of {expected}: {a:?} {b:?}"
            );
            assert_eq!(found, y.closing(x));
            // A field with another origin and unit than its body, and with the axes of a plane.
            let (a, b, x, y) = if a.normal.is_some() { (b, a, y, x) } else { (a, b, x, y) };
            let rotation = match b.normal {
                Some(normal) => DQuat::from_rotation_arc(DVec3::Z, normal),
                None => DQuat::from_scaled_axis(vector(4.0)),
            };
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
