use glam::DVec3;

/// A part of a triangle: its interior, an edge or a corner.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Feature {
    /// The triangle itself.
    Face,
    /// Edge `k`, from corner `k` to corner `k + 1` (mod 3).
    Edge(u8),
    /// Corner `k`.
    Vertex(u8),
}

/// A set of features whose closed regions hold a point; bit 0 the face, bits 1–3 edges, 4–6 corners.
///
/// The region of a feature is where the triangle's closest point lies on it. Each is convex: the
/// region of the face is a prism, of an edge a wedge, of a corner a cone.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Regions(pub u8);

impl Regions {
    /// Only the face: for triangles without area, whose features are never told apart.
    pub const FACE: Self = Self(1);

    /// The regions that hold both points, and so the segment between them.
    pub fn and(self, other: Self) -> Self {
        Self(self.0 & other.0)
    }

    /// A corner if it holds one, else an edge, else `Face`.
    pub fn least(self) -> Feature {
        match (self.0 >> 4, (self.0 >> 1) & 7) {
            (0, 0) => Feature::Face,
            (0, edges) => Feature::Edge(edges.trailing_zeros() as u8),
            (corners, _) => Feature::Vertex(corners.trailing_zeros() as u8),
        }
    }
}

/// The point of a triangle that is closest to a query point.
#[derive(Clone, Copy, Debug)]
pub struct Closest {
    /// Distance.
    pub distance: f64,
    /// The closest point.
    pub point: DVec3,
    /// The feature that the closest point lies on.
    pub feature: Feature,
}

/// A triangle with its unit normal, ready for distance queries.
#[derive(Clone, Copy, Debug)]
pub struct Triangle {
    /// Corners.
    pub corners: [DVec3; 3],
    /// Unit normal by the right-hand rule; zero when the triangle has no area.
    pub normal: DVec3,
}

impl Triangle {
    /// Computes the normal.
    pub fn new(corners: [DVec3; 3]) -> Self {
        let [a, b, c] = corners;
        let normal = (b - a).cross(c - a);
        let length = normal.length();
        let normal = if length > 0.0 { normal / length } else { DVec3::ZERO };
        Self { corners, normal: if normal.is_finite() { normal } else { DVec3::ZERO } }
    }

    /// The closest point to `p`.
    ///
    /// Inside of the prism over the face the distance is that to the plane, elsewhere the least of the
    /// three edges. Both are accurate to a few ulp for slivers too, as the prism is told by distances
    /// to its sides, never by a quotient of areas (a needle of aspect 1e7 loses seven digits there).
    #[inline]
    pub fn closest(&self, p: DVec3) -> Closest {
        let relative = Relative::new(self, p);
        if relative.over_face(self) {
            let height = self.normal.dot(relative.from[0]);
            let point = p - height * self.normal;
            return Closest { distance: height.abs(), point, feature: Feature::Face };
        }
        let mut best = (f64::INFINITY, self.corners[0], Feature::Vertex(0));
        for k in 0..3 {
            let next = (k + 1) % 3;
            let (start, end) = (relative.start(k), relative.end(k));
            let (point, feature) = if start <= 0.0 {
                (self.corners[k], Feature::Vertex(k as u8))
            } else if end >= 0.0 {
                (self.corners[next], Feature::Vertex(next as u8))
            } else {
                let t = start / (start - end);
                (self.corners[k] + t * relative.along[k], Feature::Edge(k as u8))
            };
            let d = p.distance_squared(point);
            if d < best.0 {
                best = (d, point, feature);
            }
        }
        Closest { distance: best.0.sqrt(), point: best.1, feature: best.2 }
    }

    /// The features whose closed region holds `p`.
    #[inline]
    pub fn regions(&self, p: DVec3) -> Regions {
        if self.normal == DVec3::ZERO {
            return Regions::FACE;
        }
        let relative = Relative::new(self, p);
        let mut regions = u8::from(relative.over_face(self));
        for k in 0..3 {
            let (start, end) = (relative.start(k), relative.end(k));
            regions |= u8::from(relative.side[k] <= 0.0 && start >= 0.0 && end <= 0.0) << (1 + k);
            regions |= u8::from(start <= 0.0 && relative.end((k + 2) % 3) >= 0.0) << (4 + k);
        }
        Regions(regions)
    }
}

/// A point as seen from a triangle.
struct Relative {
    /// From each corner to the point.
    from: [DVec3; 3],
    /// From each corner to the next.
    along: [DVec3; 3],
    /// Height over each edge within the plane, times the edge's length; positive on the face's side.
    side: [f64; 3],
}

impl Relative {
    #[inline]
    fn new(triangle: &Triangle, p: DVec3) -> Self {
        let [a, b, c] = triangle.corners;
        let from = [p - a, p - b, p - c];
        let along = [b - a, c - b, a - c];
        let turned = from[0].cross(triangle.normal);
        let turned_b = from[1].cross(triangle.normal);
        let side = [along[0].dot(turned), along[1].dot(turned_b), along[2].dot(turned)];
        Self { from, along, side }
    }

    /// Where edge `k` starts, seen along it: negative before its start.
    #[inline]
    fn start(&self, k: usize) -> f64 {
        self.along[k].dot(self.from[k])
    }

    /// Where edge `k` ends: positive beyond its end.
    #[inline]
    fn end(&self, k: usize) -> f64 {
        self.along[k].dot(self.from[(k + 1) % 3])
    }

    #[inline]
    fn over_face(&self, triangle: &Triangle) -> bool {
        let [a, b, c] = self.side;
        a >= 0.0 && b >= 0.0 && c >= 0.0 && triangle.normal != DVec3::ZERO
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn point() -> impl Strategy<Value = DVec3> {
        // A coarse lattice, so that ties and degenerate triangles are common.
        (-3i32..4, -3i32..4, -3i32..4).prop_map(|(x, y, z)| DVec3::new(x as f64, y as f64, z as f64))
    }

    proptest! {
        #[test]
        fn no_sample_of_the_triangle_is_closer(a in point(), b in point(), c in point(), p in point()) {
            let triangle = Triangle::new([a, b, c]);
            let found = triangle.closest(p);
            let mut least = f64::INFINITY;
            for i in 0..=60 {
                for j in 0..=60 - i {
                    let (u, v) = (i as f64 / 60.0, j as f64 / 60.0);
                    least = least.min(p.distance(a + u * (b - a) + v * (c - a)));
                }
            }
            prop_assert!(found.distance <= least + 1e-12);
            prop_assert!((found.point.distance(p) - found.distance).abs() <= 1e-12);
            prop_assert!(least <= found.distance + 0.1);
            prop_assert!(triangle.regions(p).0 != 0);
        }
    }
}
