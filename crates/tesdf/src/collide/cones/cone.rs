//! Cones of unit vectors.
use arrayvec::ArrayVec;
use glam::DVec3;

use crate::base::elementary;

/// Sine of the angle by which a normal may be out of a cone: bodies that turn by less in a step can
/// touch there.
pub const SLOPE: f64 = 0.1;

/// Faces that are turned against each other by more (rad) do not touch with their insides.
pub const PARALLEL: f64 = 1e-3;

/// Normals that differ by less (rad) are equal, so the edges between coplanar faces are none.
pub const SAME: f64 = 1e-6;

/// A ray is in a cone when it is nearer to it than this (rad).
pub const NEAR: f64 = 1e-4;

/// Maximum number of times that a direction is moved into one cone and then into the other one.
pub const ALTERNATIONS: usize = 4;

/// A place with more different normals is left as it is.
pub const MOST: usize = 12;

/// Different outward normals at a place.
pub type Normals = ArrayVec<DVec3, MOST>;

/// The greatest cosine of an angle out of a cone.
pub fn least_cosine() -> f64 {
    (1.0 - SLOPE * SLOPE).sqrt()
}

/// A cone of unit vectors: all sums of its rays with weights of at least 0.
pub struct Cone {
    pub rays: Normals,
    /// The cross products of each two rays, in the order of the first one.
    crosses: Crosses,
}

type Crosses = ArrayVec<DVec3, { MOST * (MOST - 1) / 2 }>;

impl Cone {
    pub fn new(rays: impl Iterator<Item = DVec3>) -> Self {
        let mut cone = Self { rays: Normals::new(), crosses: Crosses::new() };
        cone.rays.extend(rays);
        for (i, p) in cone.rays.iter().enumerate() {
            cone.crosses.extend(cone.rays[i + 1..].iter().map(|q| p.cross(*q)));
        }
        cone
    }

    /// The cone of the opposite directions.
    pub fn opposite(normals: &[DVec3]) -> Self {
        Self::new(normals.iter().map(|n| -*n))
    }

    /// The cross product of the rays `i` and `j`, where `i` is less than `j`.
    fn cross(&self, i: usize, j: usize) -> DVec3 {
        self.crosses[i * (2 * self.rays.len() - i - 1) / 2 + j - i - 1]
    }

    /// Whether a direction is a sum of three rays that are not in a plane.
    pub fn is_inside(&self, v: DVec3) -> bool {
        let count = self.rays.len();
        (0..count).any(|i| {
            (i + 1..count).any(|j| {
                let over = self.cross(i, j).dot(v);
                (j + 1..count).any(|k| {
                    let (det, next) = (self.cross(i, j).dot(self.rays[k]), self.cross(j, k).dot(v));
                    let last = -self.cross(i, k).dot(v);
                    let side = det.signum();
                    det.abs() > 1e-12 && over * side >= 0.0 && next * side >= 0.0 && last * side >= 0.0
                })
            })
        })
    }

    /// The direction of the cone that is nearest to a direction.
    pub fn nearest(&self, v: DVec3) -> DVec3 {
        if self.is_inside(v) {
            return v;
        }
        let mut best = (f64::NEG_INFINITY, DVec3::ZERO);
        let mut offer = |p: DVec3| {
            let cosine = p.dot(v);
            if cosine > best.0 {
                best = (cosine, p);
            }
        };
        for (i, &p) in self.rays.iter().enumerate() {
            offer(p);
            (i + 1..self.rays.len()).filter_map(|j| self.foot(i, j, v)).for_each(&mut offer);
        }
        best.1
    }

    /// The direction nearest to `v` between the rays `i` and `j`; `None` where it is one of them.
    fn foot(&self, i: usize, j: usize, v: DVec3) -> Option<DVec3> {
        let (p, q, across) = (self.rays[i], self.rays[j], self.cross(i, j));
        let square = across.length_squared();
        if square <= f64::MIN_POSITIVE {
            return None;
        }
        let foot = v - v.dot(across) / square * across;
        let is_between = p.cross(foot).dot(across) >= 0.0 && foot.cross(q).dot(across) >= 0.0;
        if is_between { foot.try_normalize() } else { None }
    }

    /// Whether the cosine between a direction and the [`nearest`](Self::nearest) one of the cone is at
    /// least this. Most contacts ask this often, and one direction of the cone is enough to tell.
    pub fn is_within(&self, v: DVec3, least: f64) -> bool {
        if self.rays.iter().any(|ray| ray.dot(v) >= least) {
            return true;
        }
        // Planes at a greater angle have no such direction; far more than rounding is added.
        let sine_squared = 1.0 - least * least + 1e-12;
        let mut pairs = (0..self.rays.len()).flat_map(|i| (i + 1..self.rays.len()).map(move |j| (i, j)));
        let is_beside = |(i, j)| {
            let across = self.cross(i, j);
            elementary::powi(v.dot(across), 2) <= sine_squared * across.length_squared()
                && self.foot(i, j, v).is_some_and(|foot| foot.dot(v) >= least)
        };
        pairs.any(is_beside) || self.is_inside(v)
    }

    /// Whether a direction is in the cone, up to [`SLOPE`].
    pub fn is_near(&self, direction: DVec3) -> bool {
        self.is_within(direction, least_cosine())
    }
}

/// Whether a direction is in the cone of some rays, up to [`SLOPE`]. Most often it is near a ray, and
/// the cone is not made.
pub fn is_near(rays: impl Iterator<Item = DVec3> + Clone, direction: DVec3) -> bool {
    rays.clone().any(|ray| ray.dot(direction) >= least_cosine()) || Cone::new(rays).is_near(direction)
}

/// A direction that is in both cones, near to `v`; `None` where none is found.
pub fn clamped(one: &Cone, other: &Cone, v: DVec3) -> Option<DVec3> {
    let mut at = v;
    for _ in 0..ALTERNATIONS {
        let of_one = one.nearest(at);
        at = other.nearest(of_one);
        if at.distance(of_one) <= SAME {
            return Some(at);
        }
    }
    None
}

/// The direction perpendicular to two edges, each between two faces with these normals; `None` where
/// they are parallel.
pub fn crossing([a, b]: [&DVec3; 2], [c, d]: [&DVec3; 2]) -> Option<DVec3> {
    let [one, other] = [a.cross(*b).try_normalize()?, c.cross(*d).try_normalize()?];
    let both = one.cross(other);
    (both.length() > PARALLEL).then(|| both.normalize())
}

/// The extreme rays of what two cones have in common.
pub fn common(one: &Cone, other: &Cone) -> ArrayVec<DVec3, { 4 * MOST }> {
    let least = elementary::cos(NEAR);
    let holds = |cone: &Cone, ray: DVec3| cone.is_within(ray, least);
    let mut rays = ArrayVec::<DVec3, { 4 * MOST }>::new();
    // There are at most as many as both have together, and some that rounding adds.
    let mut offer = |ray: DVec3| {
        if !rays.is_full() && rays.iter().all(|r| r.distance(ray) > 2.0 * NEAR) {
            rays.push(ray);
        }
    };
    one.rays.iter().filter(|ray| holds(other, **ray)).for_each(|ray| offer(*ray));
    other.rays.iter().filter(|ray| holds(one, **ray)).for_each(|ray| offer(*ray));
    // The lines in which a side of one crosses a side of the other.
    let unit = |cross: &DVec3| cross.try_normalize();
    let mut others = Crosses::new();
    others.extend(other.crosses.iter().filter_map(unit));
    for side in one.crosses.iter().filter_map(unit) {
        for line in others.iter().map(|other| side.cross(*other)) {
            let Some(ray) = line.try_normalize().filter(|_| line.length() > NEAR) else { continue };
            for ray in [ray, -ray] {
                if holds(one, ray) && holds(other, ray) {
                    offer(ray);
                }
            }
        }
    }
    rays
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_nearest_direction_of_a_cone_is_in_it() {
        let cone = |rays: &[DVec3]| Cone::new(rays.iter().map(|ray| ray.normalize()));
        let sector = cone(&[DVec3::X, DVec3::Y, DVec3::Z, DVec3::ONE]);
        assert_eq!(sector.nearest(DVec3::ONE.normalize()), DVec3::ONE.normalize());
        let aside = DVec3::new(1.0, 1.0, -0.5).normalize();
        assert!(sector.nearest(aside).distance(DVec3::new(1.0, 1.0, 0.0).normalize()) < 1e-15);
        assert!(sector.nearest(DVec3::new(2.0, -1.0, -1.0).normalize()).distance(DVec3::X) < 1e-15);
        for k in 0..1000u32 {
            let v = DVec3::new(f64::from(k % 10), f64::from(k / 10 % 10), f64::from(k / 100)) - 4.6;
            let (v, cosine) = (v.normalize(), sector.nearest(v.normalize()).dot(v.normalize()));
            assert!(sector.is_within(v, cosine - 1e-12));
            assert!(sector.is_inside(v) || !sector.is_within(v, cosine + 1e-12));
        }
        // Two arcs that have one direction in common.
        let (one, other) = (cone(&[DVec3::Z, DVec3::X]), cone(&[DVec3::Z, -DVec3::X]));
        let tilted = DVec3::new(0.03, 0.0, 1.0).normalize();
        assert!(clamped(&one, &other, tilted).is_some_and(|n| n.distance(DVec3::Z) < 1e-12));
        assert_eq!(common(&one, &other).as_slice(), [DVec3::Z]);
        let apart = cone(&[-DVec3::Z, DVec3::Y]);
        assert!(common(&one, &apart).is_empty());
    }
}
