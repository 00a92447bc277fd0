//! How often one closed curve goes through another.
use robust::{Coord3D, orient3d};
use tesdf::glam::DVec3;

/// Where the apex of the cone is tried, from the middle of the curve, as fractions of its extent.
/// Curves with symmetries meet the edges of a cone that has the same ones.
const APICES: [DVec3; 6] = [
    DVec3::ZERO,
    DVec3::new(0.031, 0.073, -0.117),
    DVec3::new(-0.137, 0.059, 0.083),
    DVec3::new(0.089, -0.151, 0.047),
    DVec3::new(-0.071, -0.103, -0.163),
    DVec3::new(0.173, 0.139, 0.107),
];

/// The linking number of two closed polygons: how often `b` goes through a surface that `a` bounds,
/// with signs. It does not change while the curves do not pass through each other. Exact for the
/// given coordinates. `None` if the curves touch, or if each of the surfaces that are tried has an
/// edge that `b` meets.
///
/// The surfaces are cones over `a`. Where the apex is does not matter.
pub fn linking_number(a: &[DVec3], b: &[DVec3]) -> Option<i32> {
    let middle = a.iter().sum::<DVec3>() / a.len().max(1) as f64;
    let extent = a.iter().map(|p| p.distance(middle)).fold(0.0, f64::max);
    APICES.into_iter().find_map(|apex| through_cone(middle + extent * apex, a, b))
}

/// How often `b` goes through the cone over `a`, or `None` when it meets the border of a triangle.
fn through_cone(apex: DVec3, a: &[DVec3], b: &[DVec3]) -> Option<i32> {
    let mut sum = 0;
    for (p, q) in edges(a) {
        for (r, s) in edges(b) {
            sum += crossing([apex, p, q], [r, s])?;
        }
    }
    Some(sum)
}

fn edges(curve: &[DVec3]) -> impl Iterator<Item = (DVec3, DVec3)> {
    curve.iter().zip(curve.iter().cycle().skip(1)).map(|(p, q)| (*p, *q))
}

/// 1 or -1 if the segment goes through the triangle, 0 if not, `None` if it meets its border or
/// lies in its plane.
fn crossing([a, b, c]: [DVec3; 3], [p, q]: [DVec3; 2]) -> Option<i32> {
    let from = side(a, b, c, p);
    let to = side(a, b, c, q);
    if from == to && from != 0 {
        return Some(0);
    }
    let around = [side(p, q, a, b), side(p, q, b, c), side(p, q, c, a)];
    if around.contains(&1) && around.contains(&-1) {
        return Some(0);
    }
    (from != 0 && to != 0 && !around.contains(&0)).then_some(to)
}

/// The side of the plane of the first three points that the last one is on, by an exact predicate.
fn side(a: DVec3, b: DVec3, c: DVec3, d: DVec3) -> i32 {
    let coord = |p: DVec3| Coord3D { x: p.x, y: p.y, z: p.z };
    let volume = orient3d(coord(a), coord(b), coord(c), coord(d));
    i32::from(volume > 0.0) - i32::from(volume < 0.0)
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use tesdf::glam::DQuat;

    use super::*;

    fn circle(center: DVec3, normal: DVec3, corners: usize) -> Vec<DVec3> {
        let turn = DQuat::from_rotation_arc(DVec3::Z, normal);
        let corner = |k: usize| {
            let (sin, cos) = (TAU * k as f64 / corners as f64).sin_cos();
            center + turn * DVec3::new(cos, sin, 0.0)
        };
        (0..corners).map(corner).collect()
    }

    #[test]
    fn a_circle_goes_once_through_another_one() {
        let a = circle(DVec3::ZERO, DVec3::Z, 12);
        let linked = circle(DVec3::X, DVec3::Y, 12);
        let reversed: Vec<_> = linked.iter().rev().copied().collect();
        let sign = linking_number(&a, &linked).unwrap();
        assert_eq!(sign.abs(), 1);
        assert_eq!(linking_number(&a, &reversed), Some(-sign));
        assert_eq!(linking_number(&linked, &a).unwrap().abs(), 1);
        // Beside, above, and inside of the other one's plane.
        for other in [
            circle(2.5 * DVec3::X, DVec3::Y, 12),
            circle(DVec3::Z, DVec3::Z, 12),
            circle(DVec3::Z * 1e-12, DVec3::Z, 5).iter().map(|p| *p * 0.5).collect(),
        ] {
            assert_eq!(linking_number(&a, &other), Some(0));
        }
    }

    /// A torus knot of two turns goes through the hole twice.
    #[test]
    fn a_coil_goes_twice_through_a_circle() {
        let a = circle(DVec3::ZERO, DVec3::Z, 24);
        let coil = |k: usize| {
            let angle = TAU * k as f64 / 50.0;
            let (around, across) = (angle, 2.0 * angle);
            let radius = 1.0 + 0.3 * across.cos();
            DVec3::new(radius * around.cos(), radius * around.sin(), 0.3 * across.sin())
        };
        let coil: Vec<_> = (0..50).map(coil).collect();
        assert_eq!(linking_number(&a, &coil).unwrap().abs(), 2);
    }

    /// The middle of one is a corner of the other: the first apex is on the curve.
    #[test]
    fn a_curve_through_the_middle_needs_another_apex() {
        let a = circle(DVec3::ZERO, DVec3::Z, 8);
        let b = [DVec3::new(0.0, 0.0, -1.0), DVec3::ZERO, DVec3::Z, DVec3::new(3.0, 0.1, 0.0)];
        assert_eq!(linking_number(&a, &b).unwrap().abs(), 1);
    }

    #[test]
    fn curves_that_touch_have_no_linking_number() {
        let a = circle(DVec3::ZERO, DVec3::Z, 12);
        let corner = a[3];
        let b = [corner, corner + DVec3::Z, DVec3::new(5.0, 5.0, 1.0)];
        assert_eq!(linking_number(&a, &b), None);
        assert_eq!(linking_number(&[], &a), Some(0), "no curve bounds no surface");
    }
}
