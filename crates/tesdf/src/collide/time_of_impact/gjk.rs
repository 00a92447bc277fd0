//! The distance of a convex body from the origin, from its support points (Gilbert, Johnson and
//! Keerthi 1988).
use arrayvec::ArrayVec;
use glam::DVec3;

use crate::geometry::{Feature, Triangle};

/// A distance is more than the least one by at most this share of what it exceeds the radius by.
pub const RELATIVE_ERROR: f64 = 1e-3;

/// Number of support points after which the search stops. Nearly all take less than 20.
const MOST: u32 = 100;

/// The distance of a point of the body that is nearly the nearest one, and the direction from the
/// origin along which the body is known to be farthest. `None` where the origin is in the body or too
/// near to tell.
///
/// `support` is a point of the body that is farthest in a direction, which need not have length 1. Of
/// the distance, `radius` does not count for its exactness.
pub fn separation(radius: f64, support: impl Fn(DVec3) -> DVec3) -> Option<(f64, DVec3)> {
    let mut nearest = support(DVec3::X);
    let mut simplex = ArrayVec::<DVec3, 4>::from_iter([nearest]);
    let mut farthest = (f64::NEG_INFINITY, DVec3::ZERO);
    for _ in 0..MOST {
        let (distance, direction) = (nearest.length(), nearest.try_normalize()?);
        let beyond = support(-nearest);
        let bound = direction.dot(beyond);
        if bound > farthest.0 {
            farthest = (bound, direction);
        }
        if distance - farthest.0 <= RELATIVE_ERROR * (distance - radius).abs() || simplex.contains(&beyond) {
            break;
        }
        simplex.push(beyond);
        // Rounding could put the origin into a flat tetrahedron.
        let (point, rest) = match of_simplex(&simplex) {
            None if farthest.0 <= 0.0 => return None,
            None => break,
            Some(found) => found,
        };
        if point.length() >= distance {
            break;
        }
        (nearest, simplex) = (point, rest);
    }
    (farthest.0 > 0.0).then_some((nearest.length(), farthest.1))
}

/// The nearest point of a simplex, and the corners between which it is. `None` within a tetrahedron.
fn of_simplex(corners: &[DVec3]) -> Option<(DVec3, ArrayVec<DVec3, 4>)> {
    match *corners {
        [a, b] => Some(of_triangle([a, b, b])),
        [a, b, c] => Some(of_triangle([a, b, c])),
        [a, b, c, d] => {
            let sides = [([a, b, c], d), ([a, b, d], c), ([a, c, d], b), ([b, c, d], a)];
            let is_inside = |([a, b, c], opposite): &([DVec3; 3], DVec3)| {
                let normal = (*b - *a).cross(*c - *a);
                normal.dot(-*a) * normal.dot(*opposite - *a) > 0.0
            };
            if sides.iter().all(is_inside) {
                return None;
            }
            let squared = |(point, _): &(DVec3, _)| point.length_squared();
            sides
                .map(|(side, _)| of_triangle(side))
                .into_iter()
                .min_by(|a, b| squared(a).total_cmp(&squared(b)))
        }
        _ => None,
    }
}

fn of_triangle(corners: [DVec3; 3]) -> (DVec3, ArrayVec<DVec3, 4>) {
    let closest = Triangle::new(corners).closest(DVec3::ZERO);
    let corner = |k: u8| corners[usize::from(k) % 3];
    let rest = match closest.feature {
        Feature::Face => corners.into_iter().collect(),
        Feature::Edge(k) => [corner(k), corner(k + 1)].into_iter().collect(),
        Feature::Vertex(k) => [corner(k)].into_iter().collect(),
    };
    (closest.point, rest)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::random;

    fn vector(state: &mut u64) -> DVec3 {
        DVec3::from_array([0; 3].map(|_| 2.0 * random(state) - 1.0))
    }

    /// The hull of these points.
    fn hull(points: &[DVec3]) -> impl Fn(DVec3) -> DVec3 {
        |m| points.iter().copied().max_by(|p, q| m.dot(*p).total_cmp(&m.dot(*q))).expect("points")
    }

    /// Of a body that is apart, by this distance.
    fn assert_separation(found: Option<(f64, DVec3)>, support: impl Fn(DVec3) -> DVec3, distance: f64) {
        let (found, direction) = found.unwrap_or_else(|| panic!("nothing at {distance}"));
        assert!((direction.length() - 1.0).abs() < 1e-15);
        let bound = direction.dot(support(-direction));
        // A direction between points of size 1 is that of their rounded difference.
        let rounding = 1e-14 * (1.0 + distance) + 8.0 * f64::EPSILON / distance;
        assert!(found >= distance - rounding && bound <= distance + rounding, "{bound} {distance} {found}");
        assert!(found - bound <= RELATIVE_ERROR * found + rounding, "{bound} {distance} {found}");
    }

    #[test]
    fn distances_of_triangles_and_balls_are_those_of_formulas() {
        let mut state = 1;
        for k in 0..20_000 {
            // Coincident corners and needles, near and far.
            let mut corners = [0; 3].map(|_| vector(&mut state));
            match k % 5 {
                0 => corners[1] = corners[0],
                1 => corners[2] = corners[0] + 1e-9 * vector(&mut state),
                2 => corners[2] = 0.5 * (corners[0] + corners[1]),
                _ => {}
            }
            let away = [1e-6, 1e-3, 1.0, 1e3][k % 4] * vector(&mut state);
            let nearest = Triangle::new(corners).closest(DVec3::ZERO).point;
            let corners = corners.map(|p| p - nearest + away);
            let distance = Triangle::new(corners).closest(DVec3::ZERO).distance;
            if distance > 1e-9 {
                assert_separation(separation(0.0, hull(&corners)), hull(&corners), distance);
            }
            let (center, radius) = (vector(&mut state) + 2.0 * DVec3::X, random(&mut state));
            let ball = |m: DVec3| center + radius * m.normalize_or_zero();
            assert_separation(separation(0.0, ball), ball, center.length() - radius);
        }
    }

    #[test]
    fn bodies_around_the_origin_have_no_direction() {
        let mut state = 2;
        for _ in 0..2_000 {
            let points = [0; 8].map(|_| vector(&mut state));
            let middle = points.iter().sum::<DVec3>() / 8.0;
            let around = points.map(|p| p - middle);
            assert_eq!(separation(0.0, hull(&around)), None);
            // On a corner, up to rounding.
            let at_corner = points.map(|p| p - points[3]);
            assert!(separation(0.0, hull(&at_corner)).is_none_or(|(distance, _)| distance < 1e-15));
        }
        assert_eq!(separation(0.0, |_| DVec3::ZERO), None);
        // A flat body beside it, whose points are all in a plane or on a line.
        let flat = |m: DVec3| DVec3::new(1f64.copysign(m.x), 1f64.copysign(m.y), 1e-7);
        assert_separation(separation(0.0, flat), flat, 1e-7);
        let line = |m: DVec3| DVec3::new(1f64.copysign(m.x), 0.0, 1e-9);
        assert_separation(separation(0.0, line), line, 1e-9);
    }
}
