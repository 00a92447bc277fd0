//! Convex hulls of points of a plane.
use glam::DVec2;

/// The corners of the convex hull of points with their numbers, anticlockwise (Andrew's monotone
/// chain). A corner that rounding makes of a point on a side, or beside another corner, is left
/// out: one that stands out by at most `level` of the extent.
pub fn convex_hull(mut points: Vec<(DVec2, usize)>, level: f64) -> Vec<(DVec2, usize)> {
    points.sort_by(|(p, i), (q, j)| p.x.total_cmp(&q.x).then(p.y.total_cmp(&q.y)).then(i.cmp(j)));
    points.dedup_by(|later, first| later.0 == first.0);
    if points.len() < 3 {
        return points;
    }
    let mut hull: Vec<(DVec2, usize)> = Vec::new();
    let chain = |hull: &mut Vec<(DVec2, usize)>, p: (DVec2, usize), start: usize| {
        while let [.., a, b] = hull[start..]
            && (b.0 - a.0).perp_dot(p.0 - a.0) <= 0.0
        {
            hull.pop();
        }
        hull.push(p);
    };
    for &p in &points {
        chain(&mut hull, p, 0);
    }
    let start = hull.len() - 1;
    for &p in points.iter().rev().skip(1) {
        chain(&mut hull, p, start);
    }
    hull.pop();
    let first = hull[0].0;
    let level = level * hull.iter().map(|(p, _)| p.distance(first)).fold(0.0, f64::max);
    // The distance from the line between two neighbours, or from the nearer one beyond its end.
    let height = |hull: &[(DVec2, usize)], k: usize| {
        let n = hull.len();
        let (a, b, p) = (hull[(k + n - 1) % n].0, hull[(k + 1) % n].0, hull[k].0);
        let along = (p - a).dot(b - a) / (b - a).length_squared().max(f64::MIN_POSITIVE);
        p.distance(a + along.clamp(0.0, 1.0) * (b - a))
    };
    while hull.len() > 2
        && let Some(k) = (0..hull.len()).find(|&k| height(&hull, k) <= level)
    {
        hull.remove(k);
    }
    hull
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn turn(a: DVec2, b: DVec2, c: DVec2) -> f64 {
        (b - a).perp_dot(c - a)
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(1000))]
        #[test]
        fn hulls_hold_all_points_and_turn_left(points in prop::collection::vec([-3i32..4, -3..4], 0..12)) {
            let points: Vec<DVec2> = points.iter().map(|p| DVec2::from_array(p.map(f64::from))).collect();
            let hull = convex_hull(points.iter().copied().zip(0..).collect(), 0.0);
            for &(p, i) in &hull {
                // Of points that coincide the first stays.
                prop_assert_eq!(points.iter().position(|&q| q == p), Some(i));
            }
            let n = hull.len();
            let in_line = points.iter().all(|&p| turn(hull[0].0, hull[n - 1].0, p) == 0.0);
            prop_assert_eq!(n < 3, points.is_empty() || in_line);
            for k in 0..if n < 3 { 0 } else { n } {
                let (a, b, c) = (hull[k].0, hull[(k + 1) % n].0, hull[(k + 2) % n].0);
                prop_assert!(turn(a, b, c) > 0.0);
                prop_assert!(points.iter().all(|&p| turn(a, b, p) >= 0.0));
            }
            for &p in points.iter().filter(|_| n == 2) {
                let (a, b) = (hull[0].0, hull[1].0);
                prop_assert!((p - a).dot(p - b) <= 0.0, "{p} is beyond {a} or {b}");
            }
        }
    }

    #[test]
    fn corners_below_the_level_are_left_out() {
        let numbers = |points: &[[f64; 2]], level| -> Vec<usize> {
            let points = points.iter().map(|&p| DVec2::from_array(p)).zip(0..).collect();
            convex_hull(points, level).iter().map(|&(_, i)| i).collect()
        };
        // The third point stands out of the square by 1e-3, of an extent of √32.
        let square = [[0.0, 0.0], [4.0, 0.0], [4.0 + 1e-3, 2.0], [4.0, 4.0], [0.0, 4.0]];
        assert_eq!(numbers(&square, 1e-4), [0, 1, 2, 3, 4]);
        assert_eq!(numbers(&square, 1e-3 / 32f64.sqrt() * 1.01), [0, 1, 3, 4]);
        // Of two corners beside each other one stays.
        let beside = [[0.0, 0.0], [4.0, 0.0], [4.0, 4.0], [3.9995, 4.0005], [0.0, 4.0]];
        assert_eq!(numbers(&beside, 1e-3), [0, 1, 3, 4]);
        // Two points stay of a flat cloud.
        assert_eq!(numbers(&[[0.0, 0.0], [1.0, 1e-6], [2.0, -1e-6], [3.0, 0.0]], 1e-3), [0, 3]);
        assert_eq!(numbers(&square, 1.0).len(), 2, "at the highest level");
    }
}
