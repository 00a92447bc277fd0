use glam::DVec3;

use super::{normal_signs, orientation};

/// Whether two closed triangles of positive area share a point. Exact.
pub fn triangles_meet(t: [DVec3; 3], u: [DVec3; 3]) -> bool {
    if one_sided(t, u) || one_sided(u, t) {
        return false;
    }
    // When they share a point, they share one on an edge of one of them.
    let edges = |t: [DVec3; 3]| [(t[0], t[1]), (t[1], t[2]), (t[2], t[0])];
    edges(u).into_iter().any(|(p, q)| segment_meets_triangle(p, q, t))
        || edges(t).into_iter().any(|(p, q)| segment_meets_triangle(p, q, u))
}

/// Whether plain `f64` arithmetic proves that a plane separates two triangles. Then they share no
/// point, except their first corner if `corner_shared`.
///
/// This filter runs before the exact tests, which are slow for coplanar faces. The two ends of a
/// prism with 4,000 sides have ten million pairs of such faces with overlapping boxes; the filter
/// leaves fewer than one in a thousand. `true` is proved, because all rounding errors are bounded;
/// `false` proves nothing.
pub fn surely_apart(t: [DVec3; 3], u: [DVec3; 3], corner_shared: bool) -> bool {
    if corner_shared {
        // The difference of the bisectors at the shared corner is a likely normal of a separating
        // plane.
        let middle = |t: [DVec3; 3]| (t[1] - t[0]).normalize_or_zero() + (t[2] - t[0]).normalize_or_zero();
        let axis = middle(u) - middle(t);
        return least_along(axis, &u[1..], t[0]) > TINY && least_along(-axis, &t[1..], t[0]) > TINY;
    }
    let past_an_edge = |t: [DVec3; 3], u: [DVec3; 3]| {
        let normal = (t[1] - t[0]).cross(t[2] - t[0]);
        (0..3).any(|k| {
            let outward = (t[(k + 1) % 3] - t[k]).cross(normal);
            least_along(outward, &u, t[k]) + least_along(-outward, &t, t[k]) > TINY
        })
    };
    past_an_edge(t, u) || past_an_edge(u, t)
}

/// Sums below this value may have lost digits to underflow.
const TINY: f64 = 1e-290;

/// A lower bound of `axis · (p − from)` over the points. It subtracts the rounding errors of three
/// differences, products and sums.
fn least_along(axis: DVec3, points: &[DVec3], from: DVec3) -> f64 {
    let least = |p: &DVec3| {
        let d = *p - from;
        axis.dot(d) - 8.0 * f64::EPSILON * axis.abs().dot(d.abs())
    };
    points.iter().map(least).fold(f64::INFINITY, f64::min)
}

/// Whether a closed segment and a closed triangle of positive area share a point. Exact.
pub fn segment_meets_triangle(p: DVec3, q: DVec3, [a, b, c]: [DVec3; 3]) -> bool {
    match (orientation(a, b, c, p), orientation(a, b, c, q)) {
        (0, 0) => segment_meets_coplanar(p, q, [a, b, c]),
        (s, r) if s * r > 0 => false,
        _ => {
            let turns = [orientation(p, q, a, b), orientation(p, q, b, c), orientation(p, q, c, a)];
            turns.iter().all(|&s| s >= 0) || turns.iter().all(|&s| s <= 0)
        }
    }
}

/// Whether all corners of `u` are strictly on one side of the plane of `t`.
fn one_sided([a, b, c]: [DVec3; 3], u: [DVec3; 3]) -> bool {
    let first = orientation(a, b, c, u[0]);
    first != 0 && orientation(a, b, c, u[1]) == first && orientation(a, b, c, u[2]) == first
}

fn segment_meets_coplanar(p: DVec3, q: DVec3, [a, b, c]: [DVec3; 3]) -> bool {
    let normal = normal_signs(a, b, c);
    let Some(axis) = (0..3).find(|&k| normal[k] != 0) else { return false };
    // Positive when the three points turn like the triangle, seen along the axis.
    let turn = |u, v, w| normal[axis] * normal_signs(u, v, w)[axis];
    let edges = [(a, b), (b, c), (c, a)];
    let holds = |x| edges.iter().all(|&(u, v)| turn(u, v, x) >= 0);
    if holds(p) || holds(q) {
        return true;
    }
    edges.iter().any(|&(u, v)| {
        let ends = (turn(p, q, u), turn(p, q, v));
        // An edge in line with the segment needs no test: the other two edges decide.
        ends != (0, 0) && ends.0 * ends.1 <= 0 && turn(u, v, p) * turn(u, v, q) <= 0
    })
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::testing::random;

    fn point(c: [i32; 3]) -> DVec3 {
        DVec3::new(c[0].into(), c[1].into(), c[2].into())
    }

    /// Distance of two triangles by alternating projections, which converge to the distance of two
    /// convex sets.
    fn distance(t: [DVec3; 3], u: [DVec3; 3]) -> f64 {
        let mut x = (t[0] + t[1] + t[2]) / 3.0;
        let mut last = f64::INFINITY;
        for _ in 0..20_000 {
            let y = closest(u, x);
            x = closest(t, y);
            last = x.distance(y);
        }
        last
    }

    fn closest([a, b, c]: [DVec3; 3], x: DVec3) -> DVec3 {
        let n = (b - a).cross(c - a);
        let on_edge = |a: DVec3, b: DVec3| {
            a + ((x - a).dot(b - a) / (b - a).length_squared()).clamp(0.0, 1.0) * (b - a)
        };
        if [(a, b), (b, c), (c, a)].iter().all(|&(a, b)| (b - a).cross(x - a).dot(n) >= 0.0) {
            return x - (x - a).dot(n) / n.length_squared() * n;
        }
        [on_edge(a, b), on_edge(b, c), on_edge(c, a)]
            .into_iter()
            .min_by(|p, q| p.distance(x).total_cmp(&q.distance(x)))
            .unwrap_or(a)
    }

    #[test]
    fn segments_in_line_with_an_edge_meet_where_they_reach_it() {
        let t = [[0, 0, 0], [2, 0, 0], [0, 2, 0]].map(point);
        for (from, to, meets) in [(3, 4, false), (-2, -1, false), (-1, 3, true), (2, 3, true), (-1, 0, true)]
        {
            assert_eq!(
                segment_meets_triangle(point([from, 0, 0]), point([to, 0, 0]), t),
                meets,
                "{from} {to}"
            );
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(600))]
        #[test]
        fn triangles_meet_where_their_distance_is_zero(
            t in prop::array::uniform3(prop::array::uniform3(0i32..4)),
            u in prop::array::uniform3(prop::array::uniform3(0i32..4)),
            flat in 0u8..3,
        ) {
            // A third of the pairs are coplanar.
            let project = |mut c: [i32; 3]| { if flat == 0 { c[1] = 1; } point(c) };
            let (t, u) = (t.map(project), u.map(project));
            prop_assume!(normal_signs(t[0], t[1], t[2]) != [0; 3] && normal_signs(u[0], u[1], u[2]) != [0; 3]);
            // On this lattice, triangles that do not meet are farther apart than the error of the
            // iteration.
            prop_assert_eq!(triangles_meet(t, u), distance(t, u) < 5e-3);
            let meet = triangles_meet(t, u);
            prop_assert_eq!(triangles_meet(u, t), meet);
            prop_assert!(!(meet && surely_apart(t, u, false)));
            prop_assert!(flat != 0 || meet || surely_apart(t, u, false), "coplanar and apart");
            // Where triangles share more than a corner, an edge opposite to it meets the other one.
            let v = [t[0], u[1], u[2]];
            prop_assume!(normal_signs(v[0], v[1], v[2]) != [0; 3]);
            let meet = segment_meets_triangle(t[1], t[2], v) || segment_meets_triangle(v[1], v[2], t);
            prop_assert!(!(meet && surely_apart(t, v, true)));
        }
    }

    #[test]
    fn segments_within_a_triangle_meet_it() {
        let t = [[0, 0, 0], [9, 0, 0], [0, 9, 0]].map(point);
        for t in [t, [t[0], t[2], t[1]]] {
            assert!(segment_meets_triangle(point([1, 1, 0]), point([2, 3, 0]), t));
            assert!(triangles_meet([[1, 1, 0], [2, 1, 0], [1, 2, 0]].map(point), t));
        }
    }

    /// Triangles of a fan share its centre, and neighbours an edge.
    #[test]
    fn triangles_of_a_fan_are_apart_beside_its_centre() {
        let (x, y, center) = (DVec3::new(0.8, 0.0, 0.6), DVec3::Y, DVec3::new(7.1, -3.3, 0.7));
        for n in [5, 8, 30] {
            let rim = |k: usize| {
                let (s, c) = (k as f64 * std::f64::consts::TAU / n as f64).sin_cos();
                center + c * x + s * y
            };
            for (i, j) in (0..n).flat_map(|i| (0..n).map(move |j| (i, j))) {
                let [t, u] = [i, j].map(|k| [center, rim(k), rim((k + 1) % n)]);
                let apart = (2..n - 1).contains(&((n + i - j) % n));
                assert_eq!(surely_apart(t, u, true), apart, "{n} {i} {j}");
                assert!(!surely_apart(t, u, false), "they share the centre");
            }
        }
    }

    /// Integers of up to 53 bits: sums of products are exact in 128 bits.
    #[test]
    fn least_heights_are_lower_bounds() {
        let mut state = 1;
        for k in 0..3000u64 {
            let mut vector =
                |bits: i32| [0; 3].map(|_| ((random(&mut state) - 0.5) * 2f64.powi(bits)).round());
            let (axis, from) = (vector(40), vector(53));
            // Half of them are nearly perpendicular to the axis.
            let across = [axis[1], -axis[0], 0.0].map(|x| 512.0 * x);
            let beside = vector(if k % 2 == 0 { 3 } else { 50 });
            let p = [0, 1, 2].map(|i| from[i] + across[i] + beside[i]);
            let found = least_along(axis.into(), &[p.into()], from.into());
            let whole = |x: f64| x as i128;
            let products = [0, 1, 2].map(|i| whole(axis[i]) * (whole(p[i]) - whole(from[i])));
            let (exact, size) =
                (products.iter().sum::<i128>(), products.iter().map(|x| x.abs()).sum::<i128>());
            assert!(whole(found.ceil()) <= exact, "{k}: {found} {exact}");
            assert!(found >= exact as f64 - 20.0 * f64::EPSILON * size as f64, "{k}: {found} {exact}");
        }
    }
}
