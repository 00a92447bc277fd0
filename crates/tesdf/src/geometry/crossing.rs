use glam::DVec3;
use robust::{Coord, Coord3D};

/// The change of the winding number where the segment from `x` to `p'` passes through one triangle.
/// For a closed surface and any `x` that is not on it:
///
/// ```text
/// winding(x) = winding(p') + sum over the triangles of signed_crossing(x, p, triangle)
/// p' = p + (e, e^2, e^3), e > 0 infinitesimal
/// ```
///
/// The result is in {-1, 0, 1}. It is 1 where the segment leaves through the front
/// (counter-clockwise) side. It is exact, without tolerance or rounding, for coordinates whose
/// products neither overflow nor underflow. `p` may lie anywhere, also on the surface. When `x` is
/// on the triangle, the result is 0.
///
/// # Why the sum is right
/// Write `[u v w]` for the determinant. All decisions are signs of
///
/// - the side of `x`: `[a-x b-x c-x]`,
/// - the side of `p'`: `[a-p' b-p' c-p'] = [a-p b-p c-p] - (e, e^2, e^3) . n`, `n = (b-a) x (c-a)`,
/// - the turn about each edge: `[p'-x a-x b-x] = [p-x a-x b-x] + (e, e^2, e^3) . m`, `m = (a-x) x
///   (b-x)`.
///
/// Each of these is a polynomial in `e`. For every small enough `e > 0` its sign is that of its
/// first nonzero coefficient: the determinant, then the x, y and z component of `-n` or `m`. These
/// components are planar determinants of the corners, so all coefficients have exact signs. The
/// decisions therefore hold for one true point `p'` close to `p`. For this point:
///
/// - An edge that is not in line with `x` has `m != 0`, so the line through `x` and `p'` misses it.
///   An edge in line with `x` does not contain `x`, because `x` is not on the surface, and it can
///   meet that line only in `x`. So the segment meets no edge. Reversing an edge swaps two rows of
///   its determinant and so changes the sign of the turn. Neighbouring triangles therefore agree on
///   which of them is crossed.
/// - A triangle of area 0 consists of its edges, so the result is 0. For it the side of `x` is 0.
/// - In a triangle whose plane contains `x`, `n != 0` keeps `p'` off the plane. So the segment
///   meets the plane only in `x`, which is not on the triangle, and the result is 0.
/// - Any other triangle is crossed in its interior exactly when `x` and `p'` are on different sides
///   and the turns about its three edges are equal.
///
/// So the segment is in general position to a closed surface. Along it the winding number changes
/// by 1 at each crossing, and decreases by 1 where the segment leaves through a front side.
pub fn signed_crossing(x: DVec3, p: DVec3, triangle: [DVec3; 3]) -> i32 {
    let [a, b, c] = triangle;
    // Most faces around a cell are beside the segment, also if its end moves a little.
    let is_low = a.max(b).max(c).cmplt(x.min(p));
    let is_high = a.min(b).min(c).cmpgt(x.max(p));
    if (is_low | is_high).any() {
        return 0;
    }
    let side = orientation(a, b, c, x);
    if side == 0 {
        return 0;
    }
    if perturbed_orientation(triangle, p) == side {
        return 0;
    }
    let turns = |a, b| match orientation(p, a, b, x) {
        0 => first_nonzero(normal_signs(x, a, b)),
        sign => sign,
    };
    // Seen from x behind the triangle, the corners of a crossed triangle turn about p' in the
    // positive sense.
    if turns(a, b) == side && turns(b, c) == side && turns(c, a) == side { side } else { 0 }
}

/// Exact sign of the determinant `[a-d b-d c-d]`. It is 1 when `d` is behind the triangle `abc`.
pub fn orientation(a: DVec3, b: DVec3, c: DVec3, d: DVec3) -> i32 {
    let coord = |p: DVec3| Coord3D { x: p.x, y: p.y, z: p.z };
    sign(robust::orient3d(coord(a), coord(b), coord(c), coord(d)))
}

/// [`orientation`] of `p + (e, e^2, e^3)` with `e > 0` infinitesimal: 1 behind the triangle, -1 in
/// front of it. It is 0 only when the triangle has no area.
pub fn perturbed_orientation([a, b, c]: [DVec3; 3], p: DVec3) -> i32 {
    match orientation(a, b, c, p) {
        0 => -first_nonzero(normal_signs(a, b, c)),
        sign => sign,
    }
}

/// Exact signs of the three components of `(b-a) x (c-a)`; all 0 when the points are collinear.
pub fn normal_signs(a: DVec3, b: DVec3, c: DVec3) -> [i32; 3] {
    [(1, 2), (2, 0), (0, 1)].map(|(i, j)| {
        let coord = |p: DVec3| Coord { x: p[i], y: p[j] };
        sign(robust::orient2d(coord(a), coord(b), coord(c)))
    })
}

fn first_nonzero(signs: [i32; 3]) -> i32 {
    signs.into_iter().find(|&s| s != 0).unwrap_or(0)
}

fn sign(value: f64) -> i32 {
    i32::from(value > 0.0) - i32::from(value < 0.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::exact;
    use proptest::prelude::*;

    fn point() -> impl Strategy<Value = DVec3> {
        // A coarse lattice, so that segments often meet edges, corners and planes.
        [-2i32..3, -2..3, -2..3].prop_map(|p| DVec3::from_array(p.map(f64::from)))
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(2000))]
        #[test]
        fn crossings_are_those_of_a_point_moved_by_a_little(x in point(), p in point(), t in [point(), point(), point()]) {
            prop_assert_eq!(signed_crossing(x, p, t), exact::crossing(x, p, t));
        }
    }
}
