use arrayvec::ArrayVec;
use glam::DVec3;

use crate::geometry::Aabb;
use crate::query::MAX_POINTS;

/// Largest number of vertices of a polygon. A triangle clipped by a tetrahedron has up to seven;
/// the others leave room for vertices that rounding adds on a line.
pub const MAX_VERTICES: usize = MAX_POINTS;

/// A vertex of a polygon that is being clipped.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Vertex {
    /// Position, in the field's local frame.
    pub point: DVec3,
    /// Barycentric coordinates in the cell.
    pub lambda: [f64; 4],
}

impl Vertex {
    fn between(a: &Self, b: &Self, t: f64) -> Self {
        Self {
            point: a.point + t * (b.point - a.point),
            lambda: std::array::from_fn(|k| a.lambda[k] + t * (b.lambda[k] - a.lambda[k])),
        }
    }
}

/// A convex polygon: a face, a segment or a point, clipped by a cell.
#[derive(Clone, Debug, Default)]
pub struct Polygon(ArrayVec<Vertex, MAX_VERTICES>);

/// The parts of a polygon with respect to a plane.
#[expect(
    clippy::large_enum_variant,
    reason = "made and taken apart in one place, a million times a step: no box"
)]
pub enum Parts {
    /// The polygon is above the plane or in it.
    Above,
    /// The polygon is below the plane; a part of it may be in the plane.
    Below,
    /// The polygon is on both sides: the part above and the part below.
    Across(Polygon, Polygon),
}

impl Polygon {
    /// `points` has one to [`MAX_VERTICES`] points.
    pub fn new(points: &[DVec3]) -> Self {
        Self(points.iter().map(|&point| Vertex { point, lambda: [0.0; 4] }).collect())
    }

    /// The vertices, in order around the polygon.
    pub fn vertices(&self) -> &[Vertex] {
        &self.0
    }

    /// Mutable access to the vertices.
    pub fn vertices_mut(&mut self) -> &mut [Vertex] {
        &mut self.0
    }

    /// Positions of the vertices.
    pub fn points(&self) -> impl ExactSizeIterator<Item = DVec3> + Clone {
        self.0.iter().map(|v| v.point)
    }

    /// Bounds of the vertices.
    pub fn bounds(&self) -> Aabb {
        Aabb::of(&self.points().collect::<ArrayVec<DVec3, MAX_VERTICES>>())
    }

    /// Mean of the vertices, which is a point of the polygon.
    pub fn center(&self) -> DVec3 {
        self.points().sum::<DVec3>() / self.0.len() as f64
    }

    /// Whether twice its area is less than `thickness` times the greatest distance of a vertex from
    /// the first vertex. False for points and segments.
    pub fn is_thinner(&self, thickness: f64) -> bool {
        let Some(first) = self.points().next() else { return false };
        let spokes: ArrayVec<DVec3, MAX_VERTICES> = self.points().skip(1).map(|p| p - first).collect();
        let twice_the_area: DVec3 = spokes.windows(2).map(|pair| pair[0].cross(pair[1])).sum();
        let longest = spokes.iter().map(|spoke| spoke.length()).fold(0.0, f64::max);
        spokes.len() > 1 && twice_the_area.length() < thickness * longest
    }

    /// Greatest distance from `p` to a point of the polygon. As the polygon is convex, that point
    /// is a vertex.
    pub fn reach(&self, p: DVec3) -> f64 {
        self.points().map(|v| v.distance_squared(p)).fold(0.0, f64::max).sqrt()
    }

    /// Cuts the polygon where `height` is 0. The parts are closed. A polygon that only touches the
    /// plane is not cut.
    #[inline]
    pub fn cut(&self, height: impl Fn(&Vertex) -> f64) -> Parts {
        let mut heights = [0.0; MAX_VERTICES];
        let (mut above, mut below) = (false, false);
        for (h, v) in heights.iter_mut().zip(&self.0) {
            *h = height(v);
            above |= *h > 0.0;
            below |= *h < 0.0;
        }
        match (above, below) {
            (_, false) => Parts::Above,
            (false, true) => Parts::Below,
            (true, true) => self.across(&heights),
        }
    }

    fn across(&self, heights: &[f64; MAX_VERTICES]) -> Parts {
        let (mut first, mut second) = (Self::default(), Self::default());
        let n = self.0.len();
        for i in 0..n {
            let j = if i + 1 == n { 0 } else { i + 1 };
            let (v, h, h_next) = (self.0[i], heights[i], heights[j]);
            if h >= 0.0 {
                first.push(v);
            }
            if h <= 0.0 {
                second.push(v);
            }
            // A segment has no edge back to its first vertex.
            let is_edge = n > 2 || i == 0;
            if is_edge && ((h > 0.0 && h_next < 0.0) || (h < 0.0 && h_next > 0.0)) {
                // Computed from the same end in both polygons that share the edge.
                let v = if h > 0.0 {
                    Vertex::between(&v, &self.0[j], h / (h - h_next))
                } else {
                    Vertex::between(&self.0[j], &v, h_next / (h_next - h))
                };
                first.push(v);
                second.push(v);
            }
        }
        Parts::Across(first, second)
    }

    /// Adds a vertex, unless it equals the last vertex. When the polygon is full, the vertex that
    /// contributes the least area is removed: more than seven vertices exist only by rounding.
    fn push(&mut self, v: Vertex) {
        if self.0.last().is_some_and(|last| last.point == v.point) {
            return;
        }
        if self.0.is_full() {
            let n = self.0.len();
            let area = |i: usize| {
                let at = |k: usize| self.0[(i + k) % n].point;
                (at(n - 1) - at(0)).cross(at(1) - at(0)).length_squared()
            };
            let least = (0..n).min_by(|&i, &j| area(i).total_cmp(&area(j))).unwrap_or(0);
            self.0.remove(least);
        }
        self.0.push(v);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parts(polygon: &Polygon, height: impl Fn(&Vertex) -> f64) -> (Polygon, Polygon) {
        match polygon.cut(height) {
            Parts::Above => (polygon.clone(), Polygon::default()),
            Parts::Below => (Polygon::default(), polygon.clone()),
            Parts::Across(above, below) => (above, below),
        }
    }

    #[test]
    fn the_parts_of_a_cut_cover_the_polygon() {
        let square = Polygon::new(&[DVec3::ZERO, DVec3::X, DVec3::new(1.0, 1.0, 0.0), DVec3::Y]);
        let area = |p: &Polygon| {
            let points: Vec<DVec3> = p.points().collect();
            (1..points.len().saturating_sub(1))
                .map(|i| 0.5 * (points[i] - points[0]).cross(points[i + 1] - points[0]).length())
                .sum::<f64>()
        };
        for (n, d) in [(DVec3::new(1.0, 0.3, 0.0), 0.4), (DVec3::new(1.0, 1.0, 0.0), 1.0), (DVec3::X, 0.0)] {
            let (first, second) = parts(&square, |v| v.point.dot(n) - d);
            assert!((area(&first) + area(&second) - 1.0).abs() < 1e-14);
            assert!(first.points().all(|p| p.dot(n) - d >= -1e-15));
            assert!(second.points().all(|p| p.dot(n) - d <= 1e-15));
        }
    }

    #[test]
    fn polygons_that_touch_the_plane_are_not_cut() {
        let segment = Polygon::new(&[DVec3::ZERO, DVec3::X]);
        assert!(matches!(segment.cut(|v| v.point.y), Parts::Above));
        assert!(matches!(segment.cut(|v| -v.point.x), Parts::Below));
        let (first, second) = parts(&segment, |v| v.point.x - 0.25);
        assert_eq!(first.points().collect::<Vec<_>>(), [DVec3::new(0.25, 0.0, 0.0), DVec3::X]);
        assert!(second.points().all(|p| p.x <= 0.25));
        assert!(first.points().all(|p| p.x >= 0.25));
    }
}
