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
    }
}
