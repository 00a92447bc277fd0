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
    /// Unit normal by the right-hand rule; zero when the triangle has no area, or no more than rounding gives it.
    pub normal: DVec3,
}

/// Sine of the angle at the first corner below which the normal is computed with twice the digits; heights
/// above that are off by at most 1e-16 / 1e-3 of the triangle's size.
const NEEDLE: f64 = 1e-3;

/// Height, as a share of the longest edge, up to which a triangle is no more than its edges: which side of them a point
/// is on is rounding then.
const FLAT: f64 = 16.0 * f64::EPSILON;

/// `(b - a) × (c - a)` by products and differences without rounding errors, but for the last sums.
fn cross_of_differences(a: DVec3, b: DVec3, c: DVec3) -> DVec3 {
    let (u, v) = ([0, 1, 2].map(|k| difference(b[k], a[k])), [0, 1, 2].map(|k| difference(c[k], a[k])));
    DVec3::from_array([(1, 2), (2, 0), (0, 1)].map(|(i, j)| {
        let (first, second) = (product(u[i].0, v[j].0), product(u[j].0, v[i].0));
        let small = u[i].0 * v[j].1 + u[i].1 * v[j].0 - (u[j].0 * v[i].1 + u[j].1 * v[i].0);
        let leading = difference(first.0, second.0);
        leading.0 + (leading.1 + (first.1 - second.1) + small)
    }))
}

/// `x - y` as a rounded difference and its error (Knuth).
fn difference(x: f64, y: f64) -> (f64, f64) {
    let d = x - y;
    let t = d - x;
    (d, (x - (d - t)) - (y + t))
}

/// `x y` as a rounded product and its error.
fn product(x: f64, y: f64) -> (f64, f64) {
    let p = x * y;
    (p, x.mul_add(y, -p))
}

impl Triangle {
    /// Computes the normal.
    pub fn new(corners: [DVec3; 3]) -> Self {
        let [a, b, c] = corners;
        let (u, v) = (b - a, c - a);
        let mut normal = u.cross(v);
        // The cross product is off by some ulps of |u| |v|, in any direction. The normal of a needle would be noise, not
        // even at right angles to it, and heights over its plane as wrong as the needle is long.
        if normal.length_squared() < NEEDLE * NEEDLE * u.length_squared() * v.length_squared() {
            normal = cross_of_differences(a, b, c);
        }
        let longest_squared = u.length_squared().max(v.length_squared()).max((v - u).length_squared());
        let flat = normal.length() <= FLAT * longest_squared;
        Self { corners, normal: if flat { DVec3::ZERO } else { normal.try_normalize().unwrap_or(DVec3::ZERO) } }
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
        // Beyond the tip of a needle the sides are rounding when seen from its other end.
        let inside = inside
            && (0..3).all(|k| {
                let next = (k + 1) % 3;
                let nearer = if from[k].length_squared() <= from[next].length_squared() { k } else { next };
                along[k].dot(from[nearer].cross(self.normal)) >= 0.0
            });
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
