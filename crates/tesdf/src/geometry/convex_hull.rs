//! Convex hulls of points of a plane.
use glam::DVec2;

/// The corners of the convex hull of points with their numbers, anticlockwise (Andrew's monotone
/// chain). A corner that rounding makes of a point on a side, or beside another corner, is left out:
/// one that stands out by at most `level` of the extent.
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
