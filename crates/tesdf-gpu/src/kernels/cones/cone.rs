//! Cones of unit vectors.
//!
//! In `f32`, cosines do not tell small angles: angles are compared by the distance of unit vectors.
//!
//! Mirrors `collide/cones/cone.rs` of `tesdf`.
use cubecl::prelude::*;
use tesdf::collide::internal::limits;

use crate::kernels::geometry::vector::{LEAST_DIVISOR, V3, pick, v3, zero};

/// Normals that are nearer to each other are equal. Those of faces in one plane differ by 1.2e-7,
/// the rounding of their components.
const SAME: f32 = limits::SAME as f32;
/// A ray that is nearer to a cone is in it.
pub const NEAR: f32 = limits::NEAR as f32;
/// A normal may be farther out of a cone by a body that turns. A little more than the sine, which
/// the limit is: the angle of 0.1002 rad has the chord 0.1001.
pub const SLOPE: f32 = 1.001_26 * limits::SLOPE as f32;
/// Maximum number of normals of a cone.
pub const MOST: u32 = limits::MOST as u32;
const ALTERNATIONS: u32 = limits::ALTERNATIONS as u32;
/// Edges at a smaller angle are parallel.
pub const PARALLEL: f32 = limits::PARALLEL as f32;
/// Three rays with a smaller determinant are in a plane: ten times the rounding of it. What is near
/// to them is near to one of their pairs.
const LEAST_DETERMINANT: f32 = 1e-6;

/// The cone of *a*, of the directions opposite to normals, and that of *b*, in the frame of the
/// field. A cone is named by its number, 0 or 1, so that its code stands in a kernel once.
#[derive(CubeType)]
pub struct Cones {
    numbers: Array<f32>,
    /// The number of rays of each cone; 0 where there is no cone.
    counts: Array<u32>,
}

/// A direction, or none.
#[derive(CubeType, CubeTypeMut, Clone, Copy)]
#[expand(derive(Clone, Copy))]
pub struct Direction {
    pub vector: V3,
    pub is_known: bool,
}

/// The different rays of what two cones have in common.
#[derive(CubeType)]
struct Rays {
    numbers: Array<f32>,
    count: u32,
}

const MOST_COMMON: u32 = 4 * MOST;

#[cube]
pub fn no_cones() -> Cones {
    let mut counts = Array::<u32>::new(2usize);
    counts[0] = 0u32;
    counts[1] = 0u32;
    Cones { numbers: Array::<f32>::new(comptime!(6 * MOST as usize)), counts }
}

#[cube]
pub fn no_direction() -> Direction {
    Direction { vector: zero(), is_known: false.runtime() }
}

/// The direction of a vector that is not zero.
#[cube]
fn direction_of(v: V3, least: f32) -> Direction {
    let length = v.length();
    Direction { vector: v * (1.0f32 / length.max(LEAST_DIVISOR)), is_known: length > least }
}

/// Whether two points are nearer than this to each other.
#[cube]
pub fn is_close(p: V3, q: V3, distance: f32) -> bool {
    (p - q).dot(p - q) <= distance * distance
}

#[cube]
fn read(from: &Array<f32>, at: u32) -> V3 {
    let k = (3u32 * at) as usize;
    v3(from[k], from[k + 1usize], from[k + 2usize])
}

#[cube]
fn write(to: &mut Array<f32>, at: u32, v: V3) {
    let k = (3u32 * at) as usize;
    to[k] = v.x;
    to[k + 1usize] = v.y;
    to[k + 2usize] = v.z;
}

#[cube]
impl Cones {
    /// The number of rays.
    pub fn count(&self, cone: u32) -> u32 {
        self.counts[cone as usize]
    }

    /// Makes a cone empty.
    pub fn clear(&mut self, cone: u32) {
        self.counts[cone as usize] = 0u32;
    }

    pub fn ray(&self, cone: u32, i: u32) -> V3 {
        read(&self.numbers, cone * MOST + i)
    }

    pub fn set_ray(&mut self, cone: u32, i: u32, v: V3) {
        write(&mut self.numbers, cone * MOST + i, v);
    }

    /// Adds a normal that differs from all others. Zero, the normal of a flat face, is left out. Of
    /// too many, the count is [`MOST`] + 1.
    pub fn add(&mut self, cone: u32, normal: V3) {
        let count = self.count(cone);
        let held = count.min(MOST);
        let mut is_new = normal.dot(normal) > 0.5f32;
        let mut i = 0u32;
        while i < held {
            is_new = is_new && !is_close(self.ray(cone, i), normal, SAME);
            i += 1u32;
        }
        if is_new && count < MOST {
            self.set_ray(cone, count, normal);
        }
        self.counts[cone as usize] = select(is_new, held + 1u32, count);
    }

    /// Whether a direction is a sum of three rays that are not in a plane.
    fn is_inside(&self, cone: u32, v: V3) -> bool {
        let count = self.count(cone);
        let mut is_inside = false;
        let mut i = 0u32;
        while i < count && !is_inside {
            let p = self.ray(cone, i);
            let mut j = i + 1u32;
            while j < count && !is_inside {
                let q = self.ray(cone, j);
                let pq = p.cross(q);
                let mut k = j + 1u32;
                while k < count && !is_inside {
                    let r = self.ray(cone, k);
                    let det = pq.dot(r);
                    let side = select(det < 0.0f32, -1.0f32, 1.0f32);
                    is_inside = det.abs() > LEAST_DETERMINANT
                        && pq.dot(v) * side >= 0.0f32
                        && q.cross(r).dot(v) * side >= 0.0f32
                        && r.cross(p).dot(v) * side >= 0.0f32;
                    k += 1u32;
                }
                j += 1u32;
            }
            i += 1u32;
        }
        is_inside
    }

    /// The direction of a cone that is nearest to a direction.
    fn nearest(&self, cone: u32, v: V3) -> V3 {
        let mut best = v;
        if !self.is_inside(cone, v) {
            let count = self.count(cone);
            let mut cosine = (-2.0f32).runtime();
            let mut i = 0u32;
            while i < count {
                // The ray itself, and the arcs to the later ones.
                let p = self.ray(cone, i);
                let mut j = i;
                while j < count {
                    let foot = foot(p, self.ray(cone, j), v);
                    let offered = pick(j == i, p, foot.vector);
                    let own = offered.dot(v);
                    if (j == i || foot.is_known) && own > cosine {
                        cosine = own;
                        best = offered;
                    }
                    j += 1u32;
                }
                i += 1u32;
            }
        }
        best
    }

    /// Whether the nearest directions of both cones are nearer than this to a direction.
    pub fn are_within(&self, v: V3, distance: f32) -> bool {
        let mut are = true;
        let mut cone = 0u32;
        while cone < 2u32 && are {
            are = is_close(self.nearest(cone, v), v, distance);
            cone += 1u32;
        }
        are
    }

    /// A direction that is in both cones, near to `v`; none where none is found.
    pub fn clamped(&self, v: V3) -> Direction {
        let mut at = v;
        let mut is_known = false;
        let mut k = 0u32;
        while k < 2u32 * ALTERNATIONS && !is_known {
            let next = self.nearest(k % 2u32, at);
            is_known = k % 2u32 == 1u32 && is_close(at, next, SAME);
            at = next;
            k += 1u32;
        }
        Direction { vector: at, is_known }
    }

    /// The direction perpendicular to two edges, the cones of which have two rays each; none where
    /// they are parallel.
    pub fn crossing(&self) -> Direction {
        let mut found = no_direction();
        if self.count(0u32) == 2u32 && self.count(1u32) == 2u32 {
            let one = self.ray(0u32, 0u32).cross(self.ray(0u32, 1u32));
            let other = self.ray(1u32, 0u32).cross(self.ray(1u32, 1u32));
            let both = direction_of(one, 0.0f32).vector.cross(direction_of(other, 0.0f32).vector);
            found = direction_of(both, PARALLEL);
        }
        found
    }

    /// The mean of the extreme rays of what both cones have in common; none where they have none.
    pub fn mean_of_common(&self) -> Direction {
        let mut rays = Rays { numbers: Array::<f32>::new(comptime!(3 * MOST_COMMON as usize)), count: 0u32 };
        let (own, other) = (self.count(0u32), self.count(1u32));
        let lines = own * own * other * other;
        let mut number = 0u32;
        while number < own + other + 2u32 * lines {
            let offered = self.offered(number);
            if offered.is_known && self.are_within(offered.vector, NEAR) {
                rays.offer(offered.vector);
            }
            number += 1u32;
        }
        let mut sum = zero();
        let mut i = 0u32;
        while i < rays.count {
            sum = sum + read(&rays.numbers, i);
            i += 1u32;
        }
        direction_of(sum, NEAR)
    }

    /// What may be an extreme ray of both cones: the rays of one, those of the other, then both
    /// directions of the lines in which a side of one crosses a side of the other.
    fn offered(&self, number: u32) -> Direction {
        let (own, other) = (self.count(0u32), self.count(1u32));
        let mut found = no_direction();
        if number < own + other {
            let of_other = number >= own;
            let ray = self.ray(select(of_other, 1u32, 0u32), select(of_other, number - own, number));
            found = Direction { vector: ray, is_known: true.runtime() };
        } else {
            let line = (number - own - other) / 2u32;
            let sign = select((number - own - other) % 2u32 == 0u32, 1.0f32, -1.0f32);
            let (one, crossed) =
                (self.side(0u32, line / (other * other)), self.side(1u32, line % (other * other)));
            let along = direction_of(one.vector.cross(crossed.vector), NEAR);
            let is_known = one.is_known && crossed.is_known && along.is_known;
            found = Direction { vector: along.vector * sign, is_known };
        }
        found
    }

    /// The direction perpendicular to two rays, the pair `number` of all ordered ones; none where
    /// the first is not before the second.
    fn side(&self, cone: u32, number: u32) -> Direction {
        let count = self.count(cone);
        let (i, j) = (number / count, number % count);
        let across = direction_of(self.ray(cone, i).cross(self.ray(cone, j)), 0.0f32);
        Direction { vector: across.vector, is_known: across.is_known && i < j }
    }
}

#[cube]
impl Rays {
    /// Adds a ray that differs from all others.
    fn offer(&mut self, ray: V3) {
        let mut is_new = self.count < MOST_COMMON;
        let mut i = 0u32;
        while i < self.count {
            is_new = is_new && !is_close(read(&self.numbers, i), ray, 2.0f32 * NEAR);
            i += 1u32;
        }
        if is_new {
            write(&mut self.numbers, self.count, ray);
            self.count += 1u32;
        }
    }
}

/// The direction nearest to `v` between two rays; none where it is one of them.
#[cube]
fn foot(p: V3, q: V3, v: V3) -> Direction {
    let across = p.cross(q);
    let square = across.dot(across);
    let foot = v - across * (v.dot(across) / square.max(LEAST_DIVISOR));
    let found = direction_of(foot, 0.0f32);
    let is_between = p.cross(foot).dot(across) >= 0.0f32 && foot.cross(q).dot(across) >= 0.0f32;
    Direction { vector: found.vector, is_known: found.is_known && square > LEAST_DIVISOR && is_between }
}
