use glam::{DMat3, DVec3};

/// Barycentric coordinates of `p` in a tetrahedron. Their sum is 1, and inside the tetrahedron all
/// are at least 0. They are not finite when the tetrahedron is flat.
///
/// One step of iterative refinement makes the weighted sum of the corners equal `p` up to the
/// rounding of its coordinates. This holds in slivers too, where the coordinates themselves are
/// ill-conditioned.
pub fn barycentric(corners: &[DVec3; 4], p: DVec3) -> [f64; 4] {
    let [a, b, c, d] = *corners;
    let edges = DMat3::from_cols(b - a, c - a, d - a);
    let inverse = edges.inverse();
    let from = p - a;
    let first = inverse * from;
    let l = first + inverse * (from - edges * first);
    [1.0 - (l.x + l.y + l.z), l.x, l.y, l.z]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::strategy::point;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn barycentric_coordinates_reproduce_the_point(base in [point(), point(), point()], up in -1.0..1.0f64, height in -5i32..0, p in point()) {
            let [a, b, c] = base;
            let normal = (b - a).cross(c - a);
            prop_assume!(normal.length() > 0.1 && up.abs() > 0.1);
            // Down to slivers of height 1e-5.
            let d = (a + b + c) / 3.0 + up * 10f64.powi(height) * normal.normalize();
            let corners = [a, b, c, d];
            let l = barycentric(&corners, p);
            let again: DVec3 = (0..4).map(|k| l[k] * corners[k]).sum();
            let size = l.iter().fold(1.0, |m: f64, x| m.max(x.abs()));
            prop_assert!(again.distance(p) < 2e-15 * size, "{l:?}: off by {:e}", again.distance(p));
        }
    }
}
