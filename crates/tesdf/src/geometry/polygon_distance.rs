use glam::DVec3;

use super::Triangle;

/// The least distance between a convex plane polygon and a triangle, with the nearest point of the
/// polygon. `None` when the distance is `limit` or more.
///
/// `points` go around the polygon; one or two points are a point or a segment. `normal` is the
/// polygon's unit normal, or zero when it has no area. Every candidate is a pair of points of both
/// shapes, so the distance is too small by no more than rounding. The candidates cover all cases of
/// nearest points: a corner and a face, two edges, an edge through a face.
///
/// ```
/// use tesdf::geometry::Triangle;
/// use tesdf::geometry::internal::polygon_to_triangle;
/// use tesdf::glam::DVec3;
///
/// let t = Triangle::new([DVec3::ZERO, DVec3::X, DVec3::Y]);
/// let square = [(0., 0.), (1., 0.), (1., 1.), (0., 1.)].map(|(x, y)| DVec3::new(x, y, 2.0 + x));
/// let normal = DVec3::new(-1.0, 0.0, 1.0).normalize();
/// let nearest = polygon_to_triangle(&square, normal, &t, f64::INFINITY);
/// assert_eq!(nearest.map(|(distance, at)| (distance, at.x)), Some((2.0, 0.0)));
/// assert_eq!(polygon_to_triangle(&square, normal, &t, 1.5), None);
/// ```
pub fn polygon_to_triangle(
    points: &[DVec3],
    normal: DVec3,
    triangle: &Triangle,
    limit: f64,
) -> Option<(f64, DVec3)> {
    let corners = &triangle.corners;
    let mut best = Least { distance: limit, at: None };
    // The triangle's plane is at least as near as the triangle.
    let to_points = Heights::new(points, corners[0], triangle.normal);
    if to_points.least >= limit {
        return None;
    }
    for (i, &p) in points.iter().enumerate() {
        if to_points.of(i) < best.distance {
            best.offer(p, triangle.closest(p).point);
        }
    }
    let has_plane = points.len() > 2 && normal != DVec3::ZERO;
    let plane = if has_plane { normal } else { DVec3::ZERO };
    let to_corners = Heights::new(corners, points[0], plane);
    if to_points.least.max(to_corners.least) >= best.distance {
        return best.found();
    }
    if has_plane {
        for (k, &c) in corners.iter().enumerate() {
            if to_corners.of(k) < best.distance {
                let x = c - normal * normal.dot(c - points[0]);
                if holds(points, normal, x) {
                    best.offer(x, c);
                }
            }
        }
    }
    let n = points.len();
    for i in 0..if n < 3 { n - 1 } else { n } {
        let j = if i + 1 == n { 0 } else { i + 1 };
        if to_points.of_edge(i, j) >= best.distance {
            continue;
        }
        let (p, q) = (points[i], points[j]);
        for k in 0..3 {
            let l = (k + 1) % 3;
            if to_corners.of_edge(k, l) < best.distance {
                let (on_edge, on_triangle) = between_segments(p, q, corners[k], corners[l]);
                best.offer(on_edge, on_triangle);
            }
        }
        if let Some(x) = crossing(p, q, corners[0], triangle.normal) {
            best.offer(x, triangle.closest(x).point);
        }
    }
    if has_plane {
        for k in 0..3 {
            if let Some(x) = crossing(corners[k], corners[(k + 1) % 3], points[0], normal)
                && holds(points, normal, x)
            {
                best.offer(x, x);
            }
        }
    }
    best.found()
}

struct Least {
    distance: f64,
    at: Option<DVec3>,
}

impl Least {
    #[inline]
    fn offer(&mut self, on_polygon: DVec3, on_triangle: DVec3) {
        let distance = on_polygon.distance(on_triangle);
        if distance < self.distance {
            *self = Self { distance, at: Some(on_polygon) };
        }
    }

    fn found(&self) -> Option<(f64, DVec3)> {
        self.at.map(|at| (self.distance, at))
    }
}

/// Largest number of points whose heights are stored. With more points, all heights count as 0,
/// which rules out no candidate.
const MAX_POINTS: usize = 12;

/// Heights of points over a plane.
struct Heights {
    heights: [f64; MAX_POINTS],
    /// Lower bound of the distance from the plane to the convex hull of the points.
    least: f64,
}

impl Heights {
    #[inline]
    fn new(points: &[DVec3], on_plane: DVec3, normal: DVec3) -> Self {
        let mut heights = [0.0; MAX_POINTS];
        let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
        if points.len() > MAX_POINTS || normal == DVec3::ZERO {
            return Self { heights, least: 0.0 };
        }
        for (height, p) in heights.iter_mut().zip(points) {
            *height = normal.dot(*p - on_plane);
            (low, high) = (low.min(*height), high.max(*height));
        }
        Self { heights, least: low.max(-high).max(0.0) }
    }

    #[inline]
    fn of(&self, i: usize) -> f64 {
        self.heights.get(i).map_or(0.0, |h| h.abs())
    }

    #[inline]
    fn of_edge(&self, i: usize, j: usize) -> f64 {
        let (h, k) = (self.heights.get(i).unwrap_or(&0.0), self.heights.get(j).unwrap_or(&0.0));
        if h * k > 0.0 { h.abs().min(k.abs()) } else { 0.0 }
    }
}

/// The point where the segment crosses the plane; `None` unless its ends lie on different sides.
#[inline]
fn crossing(p: DVec3, q: DVec3, on_plane: DVec3, normal: DVec3) -> Option<DVec3> {
    let (h, k) = (normal.dot(p - on_plane), normal.dot(q - on_plane));
    (h * k < 0.0).then(|| p + (h / (h - k)) * (q - p))
}

/// Whether a point of the polygon's plane lies in the polygon.
#[inline]
fn holds(points: &[DVec3], normal: DVec3, x: DVec3) -> bool {
    let n = points.len();
    let side = |i: usize| {
        let (p, q) = (points[i], points[if i + 1 == n { 0 } else { i + 1 }]);
        (q - p).cross(x - p).dot(normal)
    };
    // Both orientations are accepted: a clipped face keeps its orientation, a polygon of the caller
    // may have the opposite one.
    (0..n).all(|i| side(i) >= 0.0) || (0..n).all(|i| side(i) <= 0.0)
}

/// The nearest points of two segments (Ericson 2005, *Real-Time Collision Detection*, 5.1.9).
#[inline]
fn between_segments(p: DVec3, q: DVec3, r: DVec3, s: DVec3) -> (DVec3, DVec3) {
    let (u, v, w) = (q - p, s - r, p - r);
    let (a, e, f) = (u.length_squared(), v.length_squared(), v.dot(w));
    let share = |x: f64, of: f64| if of > 0.0 { (x / of).clamp(0.0, 1.0) } else { 0.0 };
    let (b, c) = (u.dot(v), u.dot(w));
    let denominator = a * e - b * b;
    // For parallel segments any start works: the end is fitted to it, and then the start to the
    // end.
    let start = if denominator > 0.0 { share(b * f - c * e, denominator) } else { 0.0 };
    let t = share(b * start + f, e);
    let start = share(b * t - c, a);
    (p + start * u, r + t * v)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::strategy::point;
    use proptest::prelude::*;

    fn sampled(points: &[DVec3], triangle: &Triangle) -> f64 {
        let n = 60;
        let mut least = f64::INFINITY;
        for k in 1..points.len() - 1 {
            for i in 0..=n {
                for j in 0..=n - i {
                    let (s, t) = (i as f64 / n as f64, j as f64 / n as f64);
                    let p = points[0] + s * (points[k] - points[0]) + t * (points[k + 1] - points[0]);
                    least = least.min(triangle.closest(p).distance);
                }
            }
        }
        least
    }

    proptest! {
        #[test]
        fn no_sampled_pair_is_nearer(t in [point(), point(), point()], o in point(), u in point(), v in point()) {
            let triangle = Triangle::new(t);
            // A parallelogram.
            let points = [o, o + 0.5 * u, o + 0.5 * (u + v), o + 0.5 * v];
            let normal = u.cross(v).normalize_or_zero();
            let (distance, at) = polygon_to_triangle(&points, normal, &triangle, f64::INFINITY).unwrap();
            prop_assert!(polygon_to_triangle(&points, normal, &triangle, distance).is_none());
            let sampled = sampled(&points, &triangle);
            prop_assert!(distance <= sampled + 1e-12, "{distance} {sampled}");
            prop_assert!(sampled <= distance + 0.04, "{distance} {sampled}");
            prop_assert!((triangle.closest(at).distance - distance).abs() < 1e-12);
        }
    }

    #[test]
    fn crossing_polygons_touch() {
        let triangle = Triangle::new([DVec3::ZERO, DVec3::X, DVec3::Y]);
        let points = [DVec3::new(0.2, 0.2, -1.0), DVec3::new(0.2, 0.2, 1.0), DVec3::new(0.3, 0.2, 1.0)];
        let normal = (points[1] - points[0]).cross(points[2] - points[0]).normalize();
        let distance =
            |points: &[DVec3], normal| polygon_to_triangle(points, normal, &triangle, 9.0).unwrap().0;
        assert!(distance(&points, normal) < 1e-16);
        assert!(distance(&points[..2], DVec3::ZERO) < 1e-16);
        assert_eq!(distance(&points[..1], DVec3::ZERO), 1.0);
    }

    /// A polygon of any number of corners is as near as the nearest of the triangles that it
    /// consists of.
    #[test]
    fn polygons_are_as_near_as_their_triangles() {
        let lattice =
            |k: u32| DVec3::new(f64::from(k % 5), f64::from(k / 5 % 5), f64::from(k / 25 % 5)) - 2.0;
        for n in [3, 4, 12, 13, 40] {
            let corner = |k: usize| (k as f64 * std::f64::consts::TAU / n as f64).sin_cos();
            let points: Vec<DVec3> = (0..n).map(corner).map(|(s, c)| DVec3::new(c, s, 0.0)).collect();
            for k in 0..1500 {
                // Among them segments and points, and edges parallel to those of the polygon.
                let t = Triangle::new([lattice(k), lattice(k * 7 / 3), lattice(k * 5 / 2 + 3)]);
                let distance = |points: &[DVec3]| {
                    let (distance, at) = polygon_to_triangle(points, DVec3::Z, &t, f64::INFINITY).unwrap();
                    assert!((t.closest(at).distance - distance).abs() < 1e-14);
                    distance
                };
                let parts = (1..n - 1).map(|i| distance(&[points[0], points[i], points[i + 1]]));
                let least = parts.fold(f64::INFINITY, f64::min);
                assert!((distance(&points) - least).abs() < 1e-14, "{n} {k}");
                let reversed: Vec<DVec3> = points.iter().rev().copied().collect();
                assert!((distance(&reversed) - least).abs() < 1e-14, "{n} {k}");
            }
        }
        let t = Triangle::new([DVec3::ZERO, DVec3::X, DVec3::Y]);
        let (p, far) = (DVec3::new(0.5, -1.0, 0.0), DVec3::new(9.0, -1.0, 0.0));
        let of_segment = |p, q| polygon_to_triangle(&[p, q], DVec3::ZERO, &t, 9.0).unwrap().0;
        assert_eq!(
            (of_segment(p, p), of_segment(p, far)),
            (1.0, 1.0),
            "a point, and a segment beside an edge"
        );
    }

    #[test]
    fn polygons_and_triangles_without_area_are_segments_or_points() {
        let v = DVec3::new;
        let t = Triangle::new([DVec3::ZERO, DVec3::X, DVec3::Y]);
        let distance = |points: &[DVec3], normal, t| polygon_to_triangle(points, normal, t, 9.0).unwrap().0;
        let line = [v(-0.5, -3.0, 4.0), v(1.5, -3.0, 4.0), v(0.5, -3.0, 4.0)];
        assert_eq!(distance(&line, DVec3::ZERO, &t), 5.0);
        // In line with an edge, but beyond its end.
        assert_eq!(distance(&[v(2.0, 0.0, 0.0), v(3.0, 0.0, 0.0)], DVec3::Z, &t), 1.0);
        let point = Triangle::new([v(0.5, -3.0, 4.0); 3]);
        assert_eq!(distance(&[DVec3::ZERO, DVec3::X, DVec3::Y], DVec3::Z, &point), 5.0, "beside an edge");
    }
}
