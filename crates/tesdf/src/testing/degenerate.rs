//! Degenerate faces of every kind and size, and points where they cause numerical trouble.
use glam::DVec3;
use proptest::prelude::*;

/// A face inside the cube [-1, 1]³.
pub fn face() -> impl Strategy<Value = [DVec3; 3]> {
    let size = (-150.0..0.0f64).prop_map(|e| 10f64.powf(e));
    let width = (-18.0..-1.0f64).prop_map(|e| 10f64.powf(e));
    (0u8..10, lattice(), [anywhere(), anywhere(), anywhere()], [lattice(), lattice()], size, width).prop_map(
        |(kind, at, [p, q, r], [u, v], size, width)| {
            let q = 0.5 * q;
            match kind {
                0 => [p; 3],
                1 => [p, p, q],
                2 => [p, q, p],
                // Collinear corners, exactly and up to rounding.
                3 => [0.25 * at, 0.25 * (at + u), 0.25 * (at - 2.0 * u)],
                4 => [p, q, p + 0.3 * (q - p)],
                // Needles and caps.
                5 => [p, q, p + width * r],
                6 => [p, q, p + 0.4 * (q - p) + width * r],
                // Small faces: with full relative precision at the origin; elsewhere rounding
                // distorts their shape.
                7 => [size * p, size * q, size * r],
                8 => [p, p + size.sqrt().max(1e-12) * q, p + size.sqrt().max(1e-12) * r],
                _ => [0.25 * at, 0.25 * u, 0.25 * v],
            }
        },
    )
}

/// A point near a face, near the line or plane of one of its edges, at a corner, or anywhere.
pub fn point_beside(corners: [DVec3; 3]) -> impl Strategy<Value = DVec3> {
    let far = (-16.0..0.0f64).prop_map(|e| 10f64.powf(e));
    (0u8..6, 0usize..3, -2.0..3.0f64, far, anywhere(), lattice()).prop_map(move |(kind, k, t, far, q, at)| {
        let (a, b, c) = (corners[k], corners[(k + 1) % 3], corners[(k + 2) % 3]);
        let normal = (b - a).cross(c - a).normalize_or_zero();
        let p = match kind {
            0 => q,
            1 => 0.25 * at,
            2 => a,
            3 => a + t * (b - a) + far * q,
            4 => a + 0.3 * (b - a) + 0.3 * (c - a) + far * normal,
            _ => a + t * (b - a) + far * normal,
        };
        p.clamp(DVec3::splat(-2.0), DVec3::splat(2.0))
    })
}

fn anywhere() -> impl Strategy<Value = DVec3> {
    [-1.0..1.0f64, -1.0..1.0, -1.0..1.0].prop_map(DVec3::from_array)
}

/// Small integers, so that coordinates are often equal.
fn lattice() -> impl Strategy<Value = DVec3> {
    [-2i32..3, -2..3, -2..3].prop_map(|p| DVec3::from_array(p.map(f64::from)))
}

/// A face and a point beside it.
pub fn face_and_point() -> impl Strategy<Value = ([DVec3; 3], DVec3)> {
    face().prop_flat_map(|corners| (Just(corners), point_beside(corners)))
}

/// A narrow face whose longest edge is about 1, and a point beyond one of its tips. The point lies
/// near the plane and nearly in line with the two long sides: their distances differ only by about
/// the rounding error.
pub fn beyond_a_tip() -> impl Strategy<Value = ([DVec3; 3], DVec3)> {
    let power = |low: f64, high: f64| (low..high).prop_map(|e| 10f64.powf(e));
    let shape = (0.0..1.0f64, power(-7.0, 0.0), any::<bool>());
    let place = (power(-16.0, 0.0), -0.2..1.2f64, power(-17.0, -3.0), 0usize..3);
    (anywhere(), [anywhere(), anywhere()], shape, place).prop_map(
        |(at, [u, v], (foot, width, is_cap), (beyond, across, above, turn))| {
            let along = u.try_normalize().unwrap_or(DVec3::X);
            let beside =
                v.reject_from_normalized(along).try_normalize().unwrap_or(along.any_orthonormal_vector());
            let at = 0.5 * at;
            let foot = if is_cap { foot } else { 1.0 };
            let corners = [at, at + along, at + foot * along + width * beside];
            // Points from the tip outwards, between the directions of its two sides.
            let side = along.lerp(corners[2] - corners[0], across).normalize_or(along);
            let p = at - beyond * side + above * along.cross(beside);
            let mut corners = corners;
            corners.rotate_left(turn);
            (corners, p)
        },
    )
}
