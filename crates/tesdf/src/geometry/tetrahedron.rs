use glam::DVec3;

/// Whether a triangle comes within `pad` of a tetrahedron. The test is conservative: it may return
/// true for a farther triangle, but never false for a nearer one.
///
/// It uses the separating axes of two convex bodies: the normal of the triangle's plane, the
/// in-plane normals of its edges, the normals of the four sides, and the 18 cross products of
/// edges. Bodies farther apart than `pad` have a separating direction, the difference of their
/// closest features, which is one of these axes. Only when a corner is closest to a corner it may
/// be none of them, and the gaps along the axes are smaller than the distance. So the result may be
/// true without need.
pub fn triangle_meets_tetrahedron(triangle: &[DVec3; 3], tetrahedron: &[DVec3; 4], pad: f64) -> bool {
    let [a, b, c] = *triangle;
    let t = *tetrahedron;
    let triangle_edges = [b - a, c - b, a - c];
    let tetrahedron_edges = [t[1] - t[0], t[2] - t[0], t[3] - t[0], t[2] - t[1], t[3] - t[1], t[3] - t[2]];
    let separated = |axis: DVec3| {
        let (low, high) = span(triangle, axis);
        let (least, greatest) = span(tetrahedron, axis);
        (low - greatest).max(least - high) > pad * axis.length()
    };
    let normal = triangle_edges[0].cross(triangle_edges[1]);
    if separated(normal) {
        return false;
    }
    let e = tetrahedron_edges;
    let sides = [e[0].cross(e[1]), e[0].cross(e[2]), e[1].cross(e[2]), e[3].cross(e[4])];
    if sides.into_iter().any(separated) {
        return false;
    }
    let crossed = |f: DVec3| e.iter().any(|&g| separated(f.cross(g)));
    !triangle_edges.into_iter().any(|f| crossed(f) || separated(f.cross(normal)))
}

fn span<const N: usize>(points: &[DVec3; N], axis: DVec3) -> (f64, f64) {
    points.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), p| {
        let s = p.dot(axis);
        (low.min(s), high.max(s))
    })
}

/// The volume of a tetrahedron. It is positive for either orientation.
pub fn tetrahedron_volume(t: &[DVec3; 4]) -> f64 {
    (t[1] - t[0]).cross(t[2] - t[0]).dot(t[3] - t[0]).abs() / 6.0
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::strategy::point;
    use crate::geometry::{Triangle, polygon_to_triangle, triangles_meet};
    use proptest::prelude::*;

    proptest! {
        /// Finds every triangle of which a sample lies in the tetrahedron.
        #[test]
        fn every_intersection_is_found(t in [point(), point(), point(), point()], tri in [point(), point(), point()]) {
            let volume = |q: DVec3, k: usize| { let mut s = t; s[k] = q; tetrahedron_volume(&s) };
            let whole = tetrahedron_volume(&t);
            prop_assume!(whole > 1e-3);
            let mut meets = false;
            for i in 0..=30 {
                for j in 0..=30 - i {
                    let q = tri[0] + (tri[1] - tri[0]) * (i as f64 / 30.0) + (tri[2] - tri[0]) * (j as f64 / 30.0);
                    meets |= (0..4).map(|k| volume(q, k)).sum::<f64>() <= whole * (1.0 + 1e-9);
                }
            }
            let answer = triangle_meets_tetrahedron(&tri, &t, 0.0);
            prop_assert!(!meets || answer);
            // Far triangles must be rejected.
            let far = tri.map(|p| p + DVec3::splat(4.0));
            prop_assert!(!triangle_meets_tetrahedron(&far, &t, 0.1));
        }

        /// Bodies that share no point are apart along one of the axes.
        #[test]
        fn bodies_that_are_apart_do_not_meet(t in [point(), point(), point(), point()], tri in [point(), point(), point()]) {
            let sides = [[0, 1, 2], [0, 1, 3], [0, 2, 3], [1, 2, 3]].map(|side| side.map(|k: usize| t[k]));
            let volumes = |p: DVec3| sides.iter().map(|&[a, b, c]| tetrahedron_volume(&[a, b, c, p])).sum::<f64>();
            let whole = tetrahedron_volume(&t);
            prop_assume!(whole > 1e-3);
            let within = volumes(tri[0]) <= whole * (1.0 + 1e-12);
            let meets = within || sides.iter().any(|&side| triangles_meet(side, tri));
            prop_assert_eq!(triangle_meets_tetrahedron(&tri, &t, 0.0), meets);
            // The least distance of the triangle from a side is a pad with which they meet.
            let triangle = Triangle::new(tri);
            let apart = |side: &[DVec3; 3]| {
                let normal = (side[1] - side[0]).cross(side[2] - side[0]).normalize();
                polygon_to_triangle(side, normal, &triangle, f64::INFINITY).map_or(0.0, |(distance, _)| distance)
            };
            let distance = sides.iter().map(apart).fold(f64::INFINITY, f64::min);
            prop_assert!(triangle_meets_tetrahedron(&tri, &t, distance * (1.0 + 1e-9)));
        }
    }

    /// Two edges, a corner and a side, an edge and the triangle: the pad is their distance.
    #[test]
    fn the_pad_is_the_distance_of_features() {
        let t = [DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z];
        assert_eq!(tetrahedron_volume(&t), 1.0 / 6.0);
        let v = DVec3::new;
        let way = v(1.0, 1.0, 0.0).normalize();
        let across =
            |d: f64| [v(0.5, 0.5, 0.3) + d * way, v(0.5, 0.5, -0.4) + d * way, v(3.0, 3.0, 0.0) + d * way];
        let beside = |d: f64| [v(0.2, 0.2, -d), v(3.0, 0.2, -2.0), v(0.2, 3.0, -2.0)];
        let over = |d: f64| [v(-2.0, -2.0, 1.0 + d), v(3.0, -2.0, 1.0 + d), v(0.0, 3.0, 1.0 + d)];
        for d in [1e-3, 0.1, 1.0] {
            for triangle in [across(d), beside(d), over(d)] {
                assert!(!triangle_meets_tetrahedron(&triangle, &t, 0.999 * d), "{d} {triangle:?}");
                assert!(triangle_meets_tetrahedron(&triangle, &t, 1.001 * d), "{d} {triangle:?}");
            }
        }
    }
}
