//! The least distance between a polygon and a face, in closed form: what [`tesdf::geometry::polygon_to_triangle`] computes.
use cubecl::prelude::*;

use super::nearest::FAR;
use super::products::POLYGON_ROWS;
use super::surface::{Part, at_weights};
use super::triangle::{Face, PART, closest, corner, distance_squared};
use super::vector::{V3, cross, dot, length, minus, pick, plus_scaled};

/// A distance, and where on the polygon, as weights of the face that it was cut from.
#[derive(CubeType, Clone, Copy)]
#[expand(derive(Clone, Copy))]
pub struct Apart {
    pub distance: f32,
    pub s: f32,
    pub t: f32,
}

/// Weight `i` of a polygon: of the second corner of the face, or of the third one.
#[cube]
pub fn weight(rows: &[Vector<f32, Const<4>>], item: u32, i: u32, #[comptime] which: usize) -> f32 {
    let row = rows[(item * comptime!(POLYGON_ROWS as u32) + i / 2u32) as usize];
    select(i % 2u32 == 0u32, row.extract(which), row.extract(which + 2usize))
}

/// The mean of a polygon's vertices, as weights, and the greatest distance of a vertex from it.
#[cube]
pub fn ball_around(part: Part, weights: &[Vector<f32, Const<4>>], item: u32, n: u32) -> Apart {
    let mut s = 0.0f32;
    let mut t = 0.0f32;
    let mut i = 0u32;
    while i < n {
        s += weight(weights, item, i, 0usize);
        t += weight(weights, item, i, 1usize);
        i += 1u32;
    }
    s /= n as f32;
    t /= n as f32;
    let center = at_weights(part, s, t);
    let mut distance = 0.0f32;
    i = 0u32;
    while i < n {
        let p = at_weights(part, weight(weights, item, i, 0usize), weight(weights, item, i, 1usize));
        distance = distance.max(length(minus(p, center)));
        i += 1u32;
    }
    Apart { distance, s, t }
}

/// Segments whose sine, squared, is at most this are parallel: any of their points is as near as any other, up to 1e-6 of their length.
const PARALLEL: f32 = 1e-12;

/// The share of the first segment at which two segments are nearest (Ericson 2005, 5.1.9), and their distance as the first value.
#[cube]
fn between_segments(p: V3, q: V3, r: V3, s: V3) -> Apart {
    let u = minus(q, p);
    let v = minus(s, r);
    let w = minus(p, r);
    let a = dot(u, u);
    let e = dot(v, v);
    let f = dot(v, w);
    let b = dot(u, v);
    let c = dot(u, w);
    // Products instead of a e - b b: that difference is rounding for segments that cross at less than 3e-4.
    let across = cross(u, v);
    let denominator = dot(across, across);
    let parallel = denominator <= PARALLEL * a * e;
    let start = select(
        parallel,
        0.0f32,
        (dot(cross(v, w), across) / denominator.max(1e-30f32)).clamp(0.0f32, 1.0f32),
    );
    let t = select(e > 0.0f32, ((b * start + f) / e.max(1e-30f32)).clamp(0.0f32, 1.0f32), 0.0f32);
    let start = select(a > 0.0f32, ((b * t - c) / a.max(1e-30f32)).clamp(0.0f32, 1.0f32), 0.0f32);
    Apart { distance: length(minus(plus_scaled(p, start, u), plus_scaled(r, t, v))), s: start, t }
}

/// Whether a point of the polygon's plane lies in it; `n` vertices go around `normal` one way or the other, in a ball around `center`.
/// Beyond the tip of a narrow polygon sides alone cannot tell.
#[cube]
fn holds(
    part: Part,
    weights: &[Vector<f32, Const<4>>],
    item: u32,
    n: u32,
    normal: V3,
    center: V3,
    radius: f32,
    x: V3,
) -> bool {
    let mut left = true;
    let mut right = true;
    let mut i = 0u32;
    while i < n {
        let j = select(i + 1u32 == n, 0u32, i + 1u32);
        let p = at_weights(part, weight(weights, item, i, 0usize), weight(weights, item, i, 1usize));
        let q = at_weights(part, weight(weights, item, j, 0usize), weight(weights, item, j, 1usize));
        let side = dot(cross(minus(q, p), minus(x, p)), normal);
        left = left && side >= 0.0f32;
        right = right && side <= 0.0f32;
        i += 1u32;
    }
    n > 2u32 && (left || right) && length(minus(x, center)) <= radius
}

/// Weights of a point of the part's plane.
///
/// The height over the longest side is rounding for a needle, and then counts with the needle's height; where along the longest side the point is
/// takes account of it.
#[cube]
fn weights_of(part: Part, normal: V3, x: V3) -> Apart {
    let (ab, bc, ca) = (minus(part.b, part.a), minus(part.c, part.b), minus(part.a, part.c));
    let (u, v, w) = (dot(ab, ab), dot(bc, bc), dot(ca, ca));
    let by_ab = u >= v && u >= w;
    let by_bc = v >= w;
    let start = pick(by_ab, part.a, pick(by_bc, part.b, part.c));
    let along = pick(by_ab, ab, pick(by_bc, bc, ca));
    let third = minus(pick(by_ab, part.c, pick(by_bc, part.a, part.b)), start);
    let to = minus(x, start);
    let area = dot(cross(along, third), normal);
    let third_weight = dot(cross(along, to), normal) / select(area.abs() > 1e-30f32, area, 1.0f32);
    let end_weight = (dot(to, along) - third_weight * dot(third, along)) / u.max(v).max(w).max(1e-30f32);
    let start_weight = 1.0f32 - end_weight - third_weight;
    let s = select(by_ab, end_weight, select(by_bc, start_weight, third_weight));
    let t = select(by_ab, third_weight, select(by_bc, end_weight, start_weight));
    Apart { distance: FAR, s, t }
}

/// The least distance between polygon `item`, which was cut from `part` with unit `normal` and is within a ball, and a face.
#[cube]
pub fn polygon_to_face(
    part: Part,
    weights: &[Vector<f32, Const<4>>],
    item: u32,
    n: u32,
    normal: V3,
    center: V3,
    radius: f32,
    f: Face,
) -> Apart {
    let mut distance = FAR.runtime();
    let mut best_s = 0.0f32;
    let mut best_t = 0.0f32;
    let mut i = 0u32;
    while i < n {
        let j = select(i + 1u32 == n, 0u32, i + 1u32);
        let (si, ti) = (weight(weights, item, i, 0usize), weight(weights, item, i, 1usize));
        let (sj, tj) = (weight(weights, item, j, 0usize), weight(weights, item, j, 1usize));
        let p = at_weights(part, si, ti);
        let q = at_weights(part, sj, tj);
        // A corner of the polygon.
        let squared = distance_squared(f, p);
        let at_corner = length(closest(f, p, u32::reinterpret(squared) & PART).outward);
        let first = at_corner < distance;
        distance = select(first, at_corner, distance);
        best_s = select(first, si, best_s);
        best_t = select(first, ti, best_t);
        // An edge of it through the face.
        let (h, k) = (dot(f.normal, minus(p, f.a)), dot(f.normal, minus(q, f.a)));
        if h * k < 0.0f32 {
            let share = h / (h - k);
            let x = plus_scaled(p, share, minus(q, p));
            let squared = distance_squared(f, x);
            let through = length(closest(f, x, u32::reinterpret(squared) & PART).outward);
            let first = through < distance;
            distance = select(first, through, distance);
            best_s = select(first, si + share * (sj - si), best_s);
            best_t = select(first, ti + share * (tj - ti), best_t);
        }
        // Two edges.
        let mut e = 0u32;
        while e < 3u32 {
            let r = corner(f, e);
            let s = pick(e == 2u32, corner(f, 0u32), corner(f, e + 1u32));
            let found = between_segments(p, q, r, s);
            let first = found.distance < distance;
            distance = select(first, found.distance, distance);
            best_s = select(first, si + found.s * (sj - si), best_s);
            best_t = select(first, ti + found.s * (tj - ti), best_t);
            e += 1u32;
        }
        i += 1u32;
    }
    let has_plane = n > 2u32 && dot(normal, normal) > 0.5f32;
    let mut e = 0u32;
    while e < 3u32 && has_plane {
        // A corner of the face over the polygon, or an edge of it through the polygon.
        let r = corner(f, e);
        let s = pick(e == 2u32, corner(f, 0u32), corner(f, e + 1u32));
        let (h, k) = (dot(normal, minus(r, part.a)), dot(normal, minus(s, part.a)));
        let over = plus_scaled(r, -h, normal);
        if h.abs() < distance && holds(part, weights, item, n, normal, center, radius, over) {
            let at = weights_of(part, normal, over);
            distance = h.abs();
            best_s = at.s;
            best_t = at.t;
        }
        if h * k < 0.0f32 {
            let x = plus_scaled(r, h / (h - k), minus(s, r));
            if holds(part, weights, item, n, normal, center, radius, x) {
                let at = weights_of(part, normal, x);
                distance = 0.0f32;
                best_s = at.s;
                best_t = at.t;
            }
        }
        e += 1u32;
    }
    Apart { distance, s: best_s, t: best_t }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;
    use proptest::prelude::*;

    use super::super::vector::v3;
    use super::*;

    fn rounded(p: DVec3) -> DVec3 {
        p.as_vec3().as_dvec3()
    }

    fn of(p: DVec3) -> V3 {
        v3(p.x as f32, p.y as f32, p.z as f32)
    }

    fn point() -> impl Strategy<Value = DVec3> {
        prop::array::uniform3(-0.5..0.5f64).prop_map(DVec3::from_array)
    }

    fn to_segment(p: DVec3, [r, s]: [DVec3; 2]) -> f64 {
        let along = s - r;
        let t = (along.dot(p - r) / along.length_squared()).clamp(0.0, 1.0);
        p.distance(r + if t.is_nan() { 0.0 } else { t } * along)
    }

    /// The least over the ends of both, and the crossing where there is one.
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
        fn segments_of_every_kind(
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
            let found = between_segments(of(first[0]), of(first[1]), of(second[0]), of(second[1]));
            prop_assert!((0.0..=1.0).contains(&found.s), "{}", found.s);
            prop_assert!((f64::from(found.distance) - expected).abs() < 1e-6, "{} instead of {expected}", found.distance);
            let there = first[0] + f64::from(found.s) * (first[1] - first[0]);
            prop_assert!((to_segment(there, second) - expected).abs() < 1e-6, "{there} is not the nearest");
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(4000))]
        /// Needles and caps as thin as a plane can be told.
        #[test]
        fn weights_lead_back_to_the_point(
            (a, u, v) in (point(), point(), point()), thin in -6.0..0.0f64, (s, t) in (0.0..1.0f64, 0.0..1.0f64), along in 0.0..1.0f64,
        ) {
            let t = t * (1.0 - s);
            let c = a + along * u + 10f64.powf(thin) * v;
            let [a, b, c] = [a, a + u, c].map(rounded);
            let face = super::super::triangle::record_of(of(a), of(b), of(c));
            prop_assume!(!super::super::triangle::is_flat(face));
            let part = Part { a: of(a), b: of(b), c: of(c), count: 3, owned: 0 };
            let x = rounded(a + s * (b - a) + t * (c - a));
            let found = weights_of(part, face.normal, of(x));
            let back = a + f64::from(found.s) * (b - a) + f64::from(found.t) * (c - a);
            prop_assert!(back.distance(x) < 2e-6, "{back} instead of {x}");
        }
    }
}
