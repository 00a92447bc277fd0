//! The least distance between a polygon and a face in closed form, as in
//! [`tesdf::geometry::internal::polygon_to_triangle`].
//!
//! Mirrors `geometry/polygon_distance.rs` of `tesdf`.
use cubecl::prelude::*;

use crate::kernels::detect::candidates::{Polygons, PolygonsExpand, Weights};
use crate::kernels::detect::ordered_pair::Part;
use crate::kernels::geometry::triangle::{Face, FaceExpand};
use crate::kernels::geometry::vector::{LEAST_DIVISOR, V3, pick};
use crate::kernels::query::nearest::FAR;

/// A polygon that was cut from a part of a surface.
#[derive(CubeType, Clone, Copy)]
#[expand(derive(Clone, Copy))]
pub struct Polygon<'a> {
    polygons: &'a Polygons,
    number: u32,
    /// Number of vertices. Their order may be either orientation.
    pub count: u32,
    pub part: Part,
}

/// A distance, and the nearest point of the polygon.
#[derive(CubeType, CubeTypeMut, Clone, Copy)]
#[expand(derive(Clone, Copy))]
pub struct Apart {
    pub distance: f32,
    pub at: Weights,
}

/// The mean of a polygon's vertices, and the greatest distance of a vertex from it.
#[derive(CubeType, Clone, Copy)]
#[expand(derive(Clone, Copy))]
pub struct PolygonBall {
    pub center: Weights,
    pub radius: f32,
}

/// The plane of a polygon, and the ball around it.
#[derive(CubeType, Clone, Copy)]
#[expand(derive(Clone, Copy))]
pub struct Disk {
    /// Unit normal; zero when the polygon has no plane.
    pub normal: V3,
    pub center: V3,
    pub radius: f32,
}

/// Two segments count as parallel when the squared sine of their angle is at most this. Then any
/// pair of opposite points is nearest, up to 1e-6 of their length. `tesdf` computes in `f64` and
/// needs no such limit.
const PARALLEL: f32 = 1e-12;

#[cube]
impl Polygons {
    /// Polygon `number`, which was cut from `part`.
    pub fn polygon<'a>(&'a self, number: u32, part: Part) -> Polygon<'a> {
        Polygon::<'a> { polygons: self, number, count: self.items.get(number).number, part }
    }

    /// A whole part as a polygon. The weights of all whole parts are the first polygon of the
    /// buffer: see [`WHOLE`](crate::kernels::detect::candidates::WHOLE).
    pub fn whole<'a>(&'a self, part: Part) -> Polygon<'a> {
        Polygon::<'a> { polygons: self, number: 0u32.runtime(), count: part.count, part }
    }
}

/// A segment.
#[derive(CubeType, Clone, Copy)]
#[expand(derive(Clone, Copy))]
pub struct Segment {
    pub from: V3,
    pub to: V3,
}

/// The distance of two segments, and the nearest point of the first.
#[derive(CubeType, Clone, Copy)]
#[expand(derive(Clone, Copy))]
pub struct Between {
    pub distance: f32,
    /// Position of the nearest point on the first segment, as a fraction of its length.
    pub share: f32,
}

/// The distance of two segments (Ericson 2005, 5.1.9).
#[cube]
fn between_segments(first: Segment, second: Segment) -> Between {
    let u = first.to - first.from;
    let v = second.to - second.from;
    let w = first.from - second.from;
    let a = u.dot(u);
    let e = v.dot(v);
    let f = v.dot(w);
    let b = u.dot(v);
    let c = u.dot(w);
    // Cross products replace a e − b b. For segments at an angle below 3e-4, that difference would
    // be a rounding error.
    let across = u.cross(v);
    let denominator = across.dot(across);
    let parallel = denominator <= PARALLEL * a * e;
    let start = select(
        parallel,
        0.0f32,
        (v.cross(w).dot(across) / denominator.max(LEAST_DIVISOR)).clamp(0.0f32, 1.0f32),
    );
    let t = select(e > 0.0f32, ((b * start + f) / e.max(LEAST_DIVISOR)).clamp(0.0f32, 1.0f32), 0.0f32);
    let share = select(a > 0.0f32, ((b * t - c) / a.max(LEAST_DIVISOR)).clamp(0.0f32, 1.0f32), 0.0f32);
    let apart = (first.from + u * share) - (second.from + v * t);
    Between { distance: apart.length(), share }
}

/// Weights of a point of the part's plane.
///
/// For a needle, the height over the longest side is a rounding error, and so is the weight of the
/// third corner. The weight along the longest side is computed from it, so that both weights
/// together lead back to the point.
#[cube]
pub fn weights_of(part: Part, normal: V3, x: V3) -> Weights {
    let (ab, bc, ca) = (part.b - part.a, part.c - part.b, part.a - part.c);
    let (u, v, w) = (ab.dot(ab), bc.dot(bc), ca.dot(ca));
    let by_ab = u >= v && u >= w;
    let by_bc = v >= w;
    let start = pick(by_ab, part.a, pick(by_bc, part.b, part.c));
    let along = pick(by_ab, ab, pick(by_bc, bc, ca));
    let third = pick(by_ab, part.c, pick(by_bc, part.a, part.b)) - start;
    let to = x - start;
    let area = along.cross(third).dot(normal);
    let third_weight = along.cross(to).dot(normal) / select(area.abs() > LEAST_DIVISOR, area, 1.0f32);
    let end_weight = (to.dot(along) - third_weight * third.dot(along)) / u.max(v).max(w).max(LEAST_DIVISOR);
    let start_weight = 1.0f32 - end_weight - third_weight;
    Weights {
        s: select(by_ab, end_weight, select(by_bc, start_weight, third_weight)),
        t: select(by_ab, third_weight, select(by_bc, end_weight, start_weight)),
    }
}

#[cube]
impl Face {
    /// The edge from corner `e` to the next one.
    fn edge(self, e: u32) -> Segment {
        let to = pick(e == 2u32, self.corner(0u32), self.corner(e + 1u32));
        Segment { from: self.corner(e), to }
    }
}

#[cube]
impl Apart {
    /// The nearer of two distances. At equal distances, the first.
    fn or(self, distance: f32, s: f32, t: f32) -> Apart {
        let nearer = distance < self.distance;
        Apart {
            distance: select(nearer, distance, self.distance),
            at: Weights { s: select(nearer, s, self.at.s), t: select(nearer, t, self.at.t) },
        }
    }
}

#[cube]
impl Polygon<'_> {
    /// Vertex `i` in weights.
    pub fn vertex(self, i: u32) -> Weights {
        self.polygons.vertex(self.number, i)
    }

    fn point(self, at: Weights) -> V3 {
        self.part.at(at.s, at.t)
    }

    /// The vertex after vertex `i`.
    fn next(self, i: u32) -> u32 {
        select(i + 1u32 == self.count, 0u32, i + 1u32)
    }

    /// The ball around the polygon.
    pub fn ball(self) -> PolygonBall {
        let mut s = 0.0f32;
        let mut t = 0.0f32;
        let mut i = 0u32;
        while i < self.count {
            let v = self.vertex(i);
            s += v.s;
            t += v.t;
            i += 1u32;
        }
        let center = Weights { s: s / self.count as f32, t: t / self.count as f32 };
        let middle = self.point(center);
        let mut radius = 0.0f32;
        i = 0u32;
        while i < self.count {
            radius = radius.max((self.point(self.vertex(i)) - middle).length());
            i += 1u32;
        }
        PolygonBall { center, radius }
    }

    /// Whether a point of the polygon's plane lies in the polygon. Beyond the tip of a narrow
    /// polygon, rounding decides on which side of the long edges the point lies, so it must be in
    /// the ball.
    fn holds(self, disk: Disk, x: V3) -> bool {
        let mut left = true;
        let mut right = true;
        let mut i = 0u32;
        while i < self.count {
            let p = self.point(self.vertex(i));
            let q = self.point(self.vertex(self.next(i)));
            let side = (q - p).cross(x - p).dot(disk.normal);
            left = left && side >= 0.0f32;
            right = right && side <= 0.0f32;
            i += 1u32;
        }
        self.count > 2u32 && (left || right) && (x - disk.center).length() <= disk.radius
    }

    /// The least distance from the polygon's vertices and edges to a face.
    fn border_to(self, f: Face) -> Apart {
        let mut best = Apart { distance: FAR.runtime(), at: Weights { s: 0.0f32, t: 0.0f32 } };
        let mut i = 0u32;
        while i < self.count {
            let (v, w) = (self.vertex(i), self.vertex(self.next(i)));
            let (p, q) = (self.point(v), self.point(w));
            // A corner of the polygon.
            best = best.or(f.distance(p), v.s, v.t);
            // An edge of the polygon that passes through the plane of the face.
            let (h, k) = (f.normal.dot(p - f.a), f.normal.dot(q - f.a));
            if h * k < 0.0f32 {
                let share = h / (h - k);
                let x = p + (q - p) * share;
                best = best.or(f.distance(x), v.s + share * (w.s - v.s), v.t + share * (w.t - v.t));
            }
            // An edge of the polygon and an edge of the face.
            let edge = Segment { from: p, to: q };
            let mut e = 0u32;
            while e < 3u32 {
                let found = between_segments(edge, f.edge(e));
                let share = found.share;
                best = best.or(found.distance, v.s + share * (w.s - v.s), v.t + share * (w.t - v.t));
                e += 1u32;
            }
            i += 1u32;
        }
        best
    }

    /// The least distance to a face.
    pub fn distance_to(self, disk: Disk, f: Face) -> Apart {
        let mut best = self.border_to(f);
        let normal = disk.normal;
        let has_plane = self.count > 2u32 && normal.dot(normal) > 0.5f32;
        let mut e = 0u32;
        while e < 3u32 && has_plane {
            // A corner of the face over the polygon, or an edge of the face through the polygon.
            let edge = f.edge(e);
            let (r, s) = (edge.from, edge.to);
            let (h, k) = (normal.dot(r - self.part.a), normal.dot(s - self.part.a));
            let over = r + normal * -h;
            if h.abs() < best.distance && self.holds(disk, over) {
                best = Apart { distance: h.abs(), at: weights_of(self.part, normal, over) };
            }
            if h * k < 0.0f32 {
                let x = r + (s - r) * (h / (h - k));
                if self.holds(disk, x) {
                    best = Apart { distance: 0.0f32, at: weights_of(self.part, normal, x) };
                }
            }
            e += 1u32;
        }
        best
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;
    use proptest::prelude::*;

    use super::*;
    use crate::kernels::geometry::triangle::face_of;
    use crate::kernels::geometry::vector::v3;

    fn rounded(p: DVec3) -> DVec3 {
        p.as_vec3().as_dvec3()
    }

    fn of(p: DVec3) -> V3 {
        v3(p.x as f32, p.y as f32, p.z as f32)
    }

    fn segment([from, to]: [DVec3; 2]) -> Segment {
        Segment { from: of(from), to: of(to) }
    }

    fn point() -> impl Strategy<Value = DVec3> {
        prop::array::uniform3(-0.5..0.5f64).prop_map(DVec3::from_array)
    }

    fn to_segment(p: DVec3, [r, s]: [DVec3; 2]) -> f64 {
        let along = s - r;
        let t = (along.dot(p - r) / along.length_squared()).clamp(0.0, 1.0);
        p.distance(r + if t.is_nan() { 0.0 } else { t } * along)
    }

    /// The least distance over the ends of both segments, and over the crossing of their lines.
    fn between([p, q]: [DVec3; 2], [r, s]: [DVec3; 2]) -> f64 {
        let ends =
            [to_segment(p, [r, s]), to_segment(q, [r, s]), to_segment(r, [p, q]), to_segment(s, [p, q])];
        let least = ends.into_iter().fold(f64::INFINITY, f64::min);
        let (u, v, w) = (q - p, s - r, r - p);
        let across = u.cross(v);
        let [on_first, on_second] = [w.cross(v), w.cross(u)].map(|n| n.dot(across) / across.length_squared());
        let crosses = (0.0..=1.0).contains(&on_first) && (0.0..=1.0).contains(&on_second);
        if crosses { least.min((p + on_first * u).distance(r + on_second * v)) } else { least }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(20_000))]
        /// Points, tiny segments, and segments that cross at any angle.
        #[test]
        fn distances_of_segments_are_exact_within_rounding(
            (p, u, turn) in (point(), point(), point()), angle in -9.0..0.0f64, (size, other) in (-20.0..0.0f64, -20.0..0.0f64),
            (s, t) in (-0.5..1.5f64, -0.5..1.5f64), apart in -9.0..-0.5f64, kind in 0u8..4,
        ) {
            let (size, other) = match kind {
                0 => (1.0, 1.0),
                1 => (1.0, 10f64.powf(other)),
                2 => (10f64.powf(size), 10f64.powf(other)),
                _ => (0.0, 1.0),
            };
            let v = u + 10f64.powf(angle) * turn;
            let first = [p, p + size * u].map(rounded);
            let start = first[0] + s * size * u - t * other * v + 10f64.powf(apart) * u.cross(turn);
            let second = [start, start + other * v].map(rounded);
            let expected = between(first, second);
            let found = between_segments(segment(first), segment(second));
            prop_assert!((0.0..=1.0).contains(&found.share), "{}", found.share);
            prop_assert!((f64::from(found.distance) - expected).abs() < 1e-6, "{} instead of {expected}", found.distance);
            let there = first[0] + f64::from(found.share) * (first[1] - first[0]);
            prop_assert!((to_segment(there, second) - expected).abs() < 1e-6, "{there} is not the nearest");
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(4000))]
        /// Needles and caps, as thin as a face with a plane can be.
        #[test]
        fn weights_lead_back_to_the_point(
            (a, u, v) in (point(), point(), point()), thin in -6.0..0.0f64, (s, t) in (0.0..1.0f64, 0.0..1.0f64), along in 0.0..1.0f64,
        ) {
            let t = t * (1.0 - s);
            let c = a + along * u + 10f64.powf(thin) * v;
            let [a, b, c] = [a, a + u, c].map(rounded);
            let face = face_of(of(a), of(b), of(c));
            prop_assume!(!face.is_flat());
            let part = Part { a: of(a), b: of(b), c: of(c), count: 3, owned: 0 };
            let x = rounded(a + s * (b - a) + t * (c - a));
            let found = weights_of(part, face.normal, of(x));
            let back = a + f64::from(found.s) * (b - a) + f64::from(found.t) * (c - a);
            prop_assert!(back.distance(x) < 2e-6, "{back} instead of {x}");
        }
    }
}
