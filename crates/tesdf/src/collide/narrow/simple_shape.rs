//! The point of a segment or triangle that is lowest in the field of a plane, box, sphere, capsule
//! or cylinder, in closed form.
//!
//! These fields are convex, so the lowest point is where the planes of the sides or the features of
//! both bodies leave no way down, and there are few such places. Each is a candidate, and the value
//! of the field at it decides.
use arrayvec::ArrayVec;
use glam::DVec3;

use crate::collide::narrow::over_cylinder::offer_lowest;
use crate::collide::scene::simple::Simple;
use crate::collide::search::greatest_minimum::{CORNERS, summit};
use crate::geometry::{Feature, Triangle};

/// A place within a segment or triangle is taken if it is lower than its corners by more than this
/// fraction of the numbers in the computation. Otherwise rounding would decide where all are alike,
/// and faces around a corner would not have the same contact there.
const LOWER: f64 = 1e-14;

/// The lowest of one to three points and what is between them, up to rounding. `normal` is that of a
/// triangle; zero where it has no area.
pub fn lowest(simple: Simple, points: &[DVec3], normal: DVec3) -> DVec3 {
    let mut best = (f64::INFINITY, DVec3::ZERO);
    let mut offer = |p: DVec3, margin: f64| {
        let distance = simple.value(p).distance;
        if distance < best.0 - margin {
            best = (distance, p);
        }
        best.0
    };
    let size = |half: DVec3| points.iter().fold(half, |size, p| size.max(p.abs())).max_element();
    if let Simple::Cylinder(cylinder) = simple {
        let margin = LOWER * size(simple.bounds().max);
        let mut count = 0;
        offer_lowest(&cylinder, points, normal, &mut |p| {
            offer(p, if count < points.len() { 0.0 } else { margin });
            count += 1;
        });
        return best.1;
    }
    points.iter().for_each(|&p| {
        offer(p, 0.0);
    });
    // A capsule is what is near its segment, which is a box without width.
    let (half, is_solid) = match simple {
        Simple::Plane | Simple::Cylinder(_) => return best.1,
        Simple::Box(half) => (half, true),
        Simple::Round { half_height, .. } => (DVec3::new(0.0, 0.0, half_height), false),
    };
    let margin = LOWER * size(half);
    let corners = [points[0], points[1], points[points.len() - 1]];
    // Under the corner of the box that is lowest along the normal. Where a side of the box is parallel
    // to the part, that is a corner of what touches, so `Patch::extremes` need not add one there: it
    // has the same bits.
    let triangle = Triangle::with_normal(corners, normal);
    if points.len() == 3 && normal != DVec3::ZERO {
        for normal in [normal, -normal] {
            let corner = half * normal.map(|x| if x < 0.0 { 1.0 } else { -1.0 });
            if triangle.closest(corner).feature == Feature::Face {
                offer(corner - normal.dot(corner - corners[0]) * normal, margin);
            }
        }
    }
    if !is_apart(half, &corners) {
        let within = offer(deepest_in_sides(half, &corners), margin);
        // Where the part enters the box, the sides alone give the depth.
        if is_solid && within <= 0.0 {
            return best.1;
        }
    }
    let edges = if points.len() == 2 { 1 } else { 3 };
    for k in 0..edges {
        offer(nearest_on_segment(half, corners[k], corners[(k + 1) % 3]), margin);
    }
    best.1
}

/// Whether a side of the box has all corners of a triangle on its outer side.
fn is_apart(half: DVec3, corners: &[DVec3; 3]) -> bool {
    let [a, b, c] = *corners;
    let (low, high) = (a.min(b).min(c), a.max(b).max(c));
    low.cmpgt(half).any() || high.cmplt(-half).any()
}

/// The point of a triangle at which the greatest height over the planes of the six sides is least.
fn deepest_in_sides(half: DVec3, corners: &[DVec3; 3]) -> DVec3 {
    let depths = |axis: usize, sign: f64| corners.map(|p| half[axis] - sign * p[axis]);
    let all: [[f64; 3]; 6] = std::array::from_fn(|k| depths(k / 2, if k % 2 == 0 { -1.0 } else { 1.0 }));
    // A side that is deeper than another one at all corners does not matter.
    let is_above = |k: usize, l: usize| {
        let is_deeper = (0..3).all(|i| all[k][i] >= all[l][i]);
        is_deeper && (l < k || all[k] != all[l])
    };
    let matters = |k: usize| (0..all.len()).all(|l| l == k || !is_above(k, l));
    let depths: ArrayVec<[f64; 3], 6> = (0..all.len()).filter(|&k| matters(k)).map(|k| all[k]).collect();
    let (_, weights) = summit(&depths);
    match CORNERS.iter().position(|corner| *corner == weights) {
        Some(k) => corners[k],
        None => weights[0] * corners[0] + weights[1] * corners[1] + weights[2] * corners[2],
    }
}

/// The point of a segment that is nearest to a box, where the segment is outside.
///
/// The derivative of half the squared distance is piecewise linear and grows; it changes where the
/// segment passes the plane of a side.
fn nearest_on_segment(half: DVec3, from: DVec3, to: DVec3) -> DVec3 {
    let way = to - from;
    let at = |t: f64| from.lerp(to, t);
    let slope = |t: f64| {
        let p = at(t);
        way.dot(p - p.clamp(-half, half))
    };
    let mut stops = ArrayVec::<f64, 7>::new();
    for axis in 0..3 {
        for side in [-half[axis], half[axis]] {
            let t = (side - from[axis]) / way[axis];
            if t > 0.0 && t < 1.0 {
                stops.push(t);
            }
        }
    }
    stops.sort_unstable_by(f64::total_cmp);
    stops.push(1.0);
    let mut low = (0.0, slope(0.0));
    if low.1 >= 0.0 {
        return from;
    }
    for t in stops {
        let high = (t, slope(t));
        if high.1 >= 0.0 {
            return at(low.0 + (high.0 - low.0) * (low.1 / (low.1 - high.1)));
        }
        low = high;
    }
    to
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::collide::scene::cylinder::Cylinder;
    use crate::testing::random;

    /// The least value over a triangle by halving the best of a grid of samples.
    fn sampled(simple: Simple, corners: [DVec3; 3]) -> f64 {
        const N: u32 = 24;
        let (mut center, mut size, mut least) = ([1.0 / 3.0; 2], 1.0, f64::INFINITY);
        for _ in 0..40 {
            let from: [f64; 2] = center.map(|c| c - 0.5 * size);
            for i in 0..=N {
                for j in 0..=N {
                    let [u, v] = [(i, 0), (j, 1)].map(|(i, k)| from[k] + size * f64::from(i) / f64::from(N));
                    let (u, v) = (u.clamp(0.0, 1.0), v.clamp(0.0, 1.0));
                    let v = v.min(1.0 - u);
                    let p = corners[0] + u * (corners[1] - corners[0]) + v * (corners[2] - corners[0]);
                    let distance = simple.value(p).distance;
                    if distance < least {
                        (least, center) = (distance, [u, v]);
                    }
                }
            }
            size *= 0.6;
        }
        least
    }

    #[test]
    fn the_lowest_point_is_that_of_samples() {
        let mut state = 1;
        let (mut inside, mut within, mut at_corners) = (0, 0, 0);
        for case in 0..3000 {
            let mut number = || random(&mut state);
            let size = 0.1 + DVec3::new(number(), number(), number());
            let simple = match case % 4 {
                0 if case % 8 == 0 => Simple::Plane,
                0 | 1 => Simple::Box(size),
                2 => Simple::Cylinder(Cylinder { half_height: size.z, radius: 0.7 * size.x }),
                _ => {
                    let half_height = if case % 8 == 3 { 0.0 } else { size.y };
                    Simple::Round { half_height, radius: 0.3 * size.x }
                }
            };
            let span = [0.3, 1.0, 4.0][case / 4 % 3];
            let center = 1.6 * (DVec3::new(number(), number(), number()) - 0.5);
            let mut corner = || center + span * (DVec3::new(number(), number(), number()) - 0.5);
            let mut corners = [corner(), corner(), corner()];
            // Flat on a side, a segment, a point, a needle.
            match case / 12 % 5 {
                0 => corners.iter_mut().for_each(|p| p.z = size.z + [0.0, 1e-6, -1e-6, 0.1][case / 60 % 4]),
                1 => corners[2] = corners[1],
                2 => corners = [corners[0]; 3],
                3 => corners[2] = corners[0].lerp(corners[1], 0.4) + 1e-9,
                _ => {}
            }
            let triangle = Triangle::new(corners);
            let point = lowest(simple, &corners, triangle.normal);
            let distance = simple.value(point).distance;
            let least = sampled(simple, corners);
            assert!(distance <= least + 1e-12, "case {case}: {distance} {least} {simple:?} {corners:?}");
            assert!(triangle.closest(point).distance < 1e-14, "case {case}: on the triangle");
            let segment = lowest(simple, &corners[..2], DVec3::ZERO);
            let least = sampled(simple, [corners[0], corners[1], corners[1]]);
            assert!(simple.value(segment).distance <= least + 1e-12, "case {case}");
            inside += usize::from(distance < 0.0);
            let is_corner = corners.contains(&point);
            (within, at_corners) = (within + usize::from(!is_corner), at_corners + usize::from(is_corner));
        }
        assert!(inside > 700 && within > 800 && at_corners > 800, "{inside} {within} {at_corners}");
    }

    #[test]
    fn a_corner_is_taken_where_all_points_are_alike() {
        let simple = Simple::Box(DVec3::new(1.0, 1.0, 0.1));
        for height in [0.3, 0.1, 0.1 - 1e-7] {
            let corners = [(0.1, 0.2), (0.7, 0.3), (0.2, 0.9)].map(|(x, y)| DVec3::new(x, y, height));
            assert!(corners.contains(&lowest(simple, &corners, DVec3::Z)));
        }
    }
}
