use glam::DVec3;

/// Most vertices of a polygon: a triangle clipped by a tetrahedron has seven; the rest is room for those that rounding
/// leaves on a line.
pub const MOST_VERTICES: usize = 12;

/// A vertex of a polygon that is being clipped.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Vertex {
    /// Where it is, in the field's local frame.
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
#[derive(Clone, Copy, Debug)]
pub struct Polygon {
    vertices: [Vertex; MOST_VERTICES],
    count: usize,
}

impl Polygon {
    /// From one to [`MOST_VERTICES`] vertices.
    pub fn new(points: &[DVec3]) -> Self {
        let mut polygon = Self { vertices: [Vertex::default(); MOST_VERTICES], count: 0 };
        points.iter().for_each(|&point| polygon.push(Vertex { point, lambda: [0.0; 4] }));
        polygon
    }

    /// The vertices, in order around.
    pub fn vertices(&self) -> &[Vertex] {
        &self.vertices[..self.count]
    }

    /// The same, to change them.
    pub fn vertices_mut(&mut self) -> &mut [Vertex] {
        &mut self.vertices[..self.count]
    }

    /// Where the vertices are.
    pub fn points(&self) -> impl ExactSizeIterator<Item = DVec3> + Clone {
        self.vertices().iter().map(|v| v.point)
    }

    /// Whether nothing is left.
    pub fn is_empty(&self) -> bool {
        self.count == 0
    }

    /// Mean of the vertices: a point of the polygon.
    pub fn center(&self) -> DVec3 {
        self.points().sum::<DVec3>() / self.count as f64
    }

    /// Greatest distance from `p` to a point of the polygon: to a vertex, as the polygon is convex.
    pub fn reach(&self, p: DVec3) -> f64 {
        self.points().map(|v| v.distance_squared(p)).fold(0.0, f64::max).sqrt()
    }

    /// The parts where `height` is not negative, and where it is not positive; a part of no more than points on the line
    /// between is empty, unless there is no other: then it is the first.
    pub fn cut(&self, height: impl Fn(&Vertex) -> f64) -> (Self, Self) {
        let mut heights = [0.0; MOST_VERTICES];
        let (mut above, mut below) = (false, false);
        for (h, v) in heights.iter_mut().zip(self.vertices()) {
            *h = height(v);
            above |= *h > 0.0;
            below |= *h < 0.0;
        }
        let nothing = Self { vertices: self.vertices, count: 0 };
        if !below {
            return (*self, nothing);
        }
        if !above {
            return (nothing, *self);
        }
        let (mut first, mut second) = (nothing, nothing);
        for i in 0..self.count {
            let j = if i + 1 == self.count { 0 } else { i + 1 };
            let (v, h, h_next) = (self.vertices[i], heights[i], heights[j]);
            if h >= 0.0 {
                first.push(v);
            }
            if h <= 0.0 {
                second.push(v);
            }
            if (h > 0.0 && h_next < 0.0) || (h < 0.0 && h_next > 0.0) {
                // From the same end on both sides of an edge that two polygons share.
                let v = if h > 0.0 {
                    Vertex::between(&v, &self.vertices[j], h / (h - h_next))
                } else {
                    Vertex::between(&self.vertices[j], &v, h_next / (h_next - h))
                };
                first.push(v);
                second.push(v);
            }
        }
        (first, second)
    }

    /// Adds a vertex; one that is where the last one is adds nothing. Of too many the one that adds least area goes:
    /// more than seven are there only by rounding.
    fn push(&mut self, v: Vertex) {
        if self.count > 0 && self.vertices[self.count - 1].point == v.point {
            return;
        }
        if self.count == MOST_VERTICES {
            let area = |i: usize| {
                let at = |k: usize| self.vertices[(i + k) % MOST_VERTICES].point;
                (at(1) - at(0)).cross(at(2) - at(0)).length_squared()
            };
            let least = (0..MOST_VERTICES).min_by(|&i, &j| area(i).total_cmp(&area(j))).unwrap_or(0);
            let gone = (least + 1) % MOST_VERTICES;
            self.vertices.copy_within(gone + 1.., gone);
            self.count -= 1;
        }
        self.vertices[self.count] = v;
        self.count += 1;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_cover_the_whole() {
        let square = Polygon::new(&[DVec3::ZERO, DVec3::X, DVec3::new(1.0, 1.0, 0.0), DVec3::Y]);
        let area = |p: &Polygon| {
            let points: Vec<DVec3> = p.points().collect();
            (1..points.len().saturating_sub(1))
                .map(|i| 0.5 * (points[i] - points[0]).cross(points[i + 1] - points[0]).length())
                .sum::<f64>()
        };
        for (n, d) in [(DVec3::new(1.0, 0.3, 0.0), 0.4), (DVec3::new(1.0, 1.0, 0.0), 1.0), (DVec3::X, 0.0)] {
            let (first, second) = square.cut(|v| v.point.dot(n) - d);
            assert!((area(&first) + area(&second) - 1.0).abs() < 1e-14);
            assert!(first.points().all(|p| p.dot(n) - d >= -1e-15));
            assert!(second.points().all(|p| p.dot(n) - d <= 1e-15));
        }
    }

    #[test]
    fn what_lies_on_the_line_is_of_the_first_part() {
        let segment = Polygon::new(&[DVec3::ZERO, DVec3::X]);
        let (first, second) = segment.cut(|v| v.point.y);
        assert_eq!((first.vertices().len(), second.is_empty()), (2, true));
        let (first, second) = segment.cut(|v| v.point.x - 0.25);
        assert_eq!(first.points().collect::<Vec<_>>(), [DVec3::new(0.25, 0.0, 0.0), DVec3::X]);
        assert!(second.points().all(|p| p.x <= 0.25));
        assert!(first.points().all(|p| p.x >= 0.25));
    }
}
