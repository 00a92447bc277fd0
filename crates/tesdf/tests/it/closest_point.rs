//! Certifies [`Triangle::closest`] by convexity, on triangles with nearly or exactly no area.
//!
//! A point `c` of a triangle is closest to `p` when `(p - c)·(v - c) ≤ 0` for the three corners
//! `v`. So the test needs no second implementation that could share rounding errors.

use crate::support::random::Random;
use crate::support::reference::exceeds;
use proptest::prelude::*;
use tesdf::geometry::Triangle;
use tesdf::glam::DVec3;

/// A triangle of size about 1 whose corners are on a line up to `width`, which may be as small as
/// rounding.
fn needle(random: &mut Random, width: f64) -> [DVec3; 3] {
    let along = if random.index(3) == 0 { DVec3::X } else { random.direction() };
    let at = random.in_cube();
    std::array::from_fn(|_| at + random.between(-1.0, 1.0) * along + width * random.in_cube())
}

/// Points anywhere, near the line of the needle, and in the plane through it.
fn beside(t: &Triangle, random: &mut Random) -> DVec3 {
    let [a, b, _] = t.corners;
    let on_line = a + random.between(-2.0, 3.0) * (b - a);
    match random.index(4) {
        0 => random.in_cube() * 2.0,
        1 => on_line + random.power(-17.0, 0.0) * random.in_cube(),
        2 => on_line + random.power(-3.0, 0.0) * t.normal,
        _ => on_line,
    }
}

/// Distance between a point and a segment.
fn to_edge(p: DVec3, a: DVec3, b: DVec3) -> f64 {
    let t = ((p - a).dot(b - a) / (b - a).length_squared()).clamp(0.0, 1.0);
    if t.is_nan() { p.distance(a) } else { p.distance(a + t * (b - a)) }
}

/// Upper bound of the distance from the edges to any point of the face.
fn width([a, b, c]: &[DVec3; 3]) -> f64 {
    let segments = [(*a, *b, *c), (*b, *c, *a), (*c, *a, *b)];
    segments.into_iter().map(|(p, q, r)| to_edge(p, q, r)).fold(f64::INFINITY, f64::min)
}

/// Accepted rounding error of a distance, for coordinates of about 1.
const SLACK: f64 = 2e-13;

fn certify(t: &Triangle, p: DVec3) -> Result<(), String> {
    let found = t.closest(p);
    let to = p - found.point;
    if exceeds((to.length() - found.distance).abs(), 1e-14) {
        return Err(format!("{} is not the distance of {}, {}", found.distance, found.point, to.length()));
    }
    let edges =
        (0..3).map(|k| to_edge(p, t.corners[k], t.corners[(k + 1) % 3])).fold(f64::INFINITY, f64::min);
    if found.distance > edges + SLACK || found.distance < edges - width(&t.corners) - SLACK {
        return Err(format!(
            "{} at {p}, {edges} from the edges, width {}: {t:?}",
            found.distance,
            width(&t.corners)
        ));
    }
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 20_000, ..ProptestConfig::default() })]

    #[test]
    fn closest_points_on_needles_are_exact(width in -18.0..-2.0f64, seed in any::<u64>()) {
        let mut random = Random(seed);
        let t = Triangle::new(needle(&mut random, 10f64.powf(width)));
        for _ in 0..8 {
            let p = beside(&t, &mut random);
            if let Err(e) = certify(&t, p) {
                return Err(TestCaseError::fail(e));
            }
        }
    }
}
