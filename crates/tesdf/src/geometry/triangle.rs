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
    /// All features whose closed region holds the query point.
    pub regions: Regions,
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
        // Of the three equal cross products, the one at the longest edge's opposite corner cancels least.
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
    pub fn closest(&self, p: DVec3) -> Closest {
        let [a, b, c] = self.corners;
        let from = [p - a, p - b, p - c];
        let along = [b - a, c - b, a - c];
        let turned = from[0].cross(self.normal);
        let turned_b = from[1].cross(self.normal);
        let side = [along[0].dot(turned), along[1].dot(turned_b), along[2].dot(turned)];
        let start: [f64; 3] = std::array::from_fn(|k| along[k].dot(from[k]));
        let end: [f64; 3] = std::array::from_fn(|k| along[k].dot(from[(k + 1) % 3]));
        let flat = self.normal == DVec3::ZERO;

        let mut regions = 0u8;
        for k in 0..3 {
            let previous = (k + 2) % 3;
            regions |= u8::from(side[k] <= 0.0 && start[k] >= 0.0 && end[k] <= 0.0) << (1 + k);
            regions |= u8::from(start[k] <= 0.0 && end[previous] >= 0.0) << (4 + k);
        }
        let inside = !flat && side[0] >= 0.0 && side[1] >= 0.0 && side[2] >= 0.0;
        let regions = if flat { Regions::FACE } else { Regions(regions | u8::from(inside)) };
        if inside {
            let height = self.normal.dot(from[0]);
            return Closest {
                distance: height.abs(),
                point: p - height * self.normal,
                feature: Feature::Face,
                regions,
            };
        }
        let mut best = (f64::INFINITY, a, Feature::Vertex(0));
        for k in 0..3 {
            let next = (k + 1) % 3;
            let (point, feature) = if start[k] <= 0.0 {
                (self.corners[k], Feature::Vertex(k as u8))
            } else if end[k] >= 0.0 {
                (self.corners[next], Feature::Vertex(next as u8))
            } else {
                let t = start[k] / (start[k] - end[k]);
                (self.corners[k] + t * along[k], Feature::Edge(k as u8))
            };
            let d = p.distance_squared(point);
            if d < best.0 {
                best = (d, point, feature);
            }
        }
        Closest { distance: best.0.sqrt(), point: best.1, feature: best.2, regions }
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
            prop_assert!(found.regions.0 != 0);
        }
    }
}
