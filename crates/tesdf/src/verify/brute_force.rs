use glam::DVec3;

use crate::base::elementary;
use crate::mesh::TriangleMesh;

/// Distance to all faces of a mesh, one after the other. A face is skipped when a ball around it is
/// farther than the nearest face so far.
///
/// This code is independent of [`Triangle`](crate::geometry::Triangle), which queries use, so that
/// an error in one shows in the comparison. Lengths are scaled by a power of two, so that products
/// stay within the range of `f64`.
pub(crate) struct BruteForce {
    facets: Vec<Facet>,
    balls: Vec<Ball>,
    scale: f64,
}

/// A ball around a face.
struct Ball {
    center: DVec3,
    radius: f64,
}

/// Relative bound of the rounding error of a radius and a distance.
const ROUNDING: f64 = 1e-14;

/// A face whose height is a smaller fraction of its length counts as its edges.
const FLAT: f64 = 4e-15;
/// A face smaller than this (scaled) counts as its edges.
const SMALLEST: f64 = 1e-70;

/// A face in scaled lengths.
struct Facet {
    corners: [DVec3; 3],
    /// Vectors from each corner to the next.
    along: [DVec3; 3],
    /// Inverse squared lengths of `along`; 0 for a length of 0.
    inverse: [f64; 3],
    /// Index of the longest edge. A point over the face is also beside this edge.
    longest: usize,
    /// Unit normal; `None` when the face has no area.
    normal: Option<DVec3>,
}

impl BruteForce {
    /// `diagonal` is the mesh's diagonal; it must be finite and positive.
    pub(crate) fn new(mesh: &TriangleMesh, diagonal: f64) -> Self {
        let scale = elementary::exp2((-elementary::log2(diagonal).floor()).clamp(-1000.0, 1000.0));
        let facets = (0..mesh.faces().len()).map(|f| Facet::new(mesh.triangle(f).map(|p| p * scale)));
        let facets: Vec<Facet> = facets.collect();
        Self { balls: facets.iter().map(Facet::ball).collect(), facets, scale }
    }

    /// Distance from `p` to the nearest of all faces, in the mesh's unit.
    pub(crate) fn distance(&self, p: DVec3) -> f64 {
        let p = p * self.scale;
        let mut least = f64::INFINITY;
        for (facet, ball) in self.facets.iter().zip(&self.balls) {
            let reach = (least + ball.radius) * (1.0 + ROUNDING);
            if p.distance_squared(ball.center) <= reach * reach {
                least = least.min(facet.offset(p).length());
            }
        }
        least / self.scale
    }

    /// Vector from the closest point of one face to `p`, in the mesh's unit.
    pub(crate) fn offset(&self, face: usize, p: DVec3) -> DVec3 {
        self.facets[face].offset(p * self.scale) / self.scale
    }
}

impl Facet {
    fn new(corners: [DVec3; 3]) -> Self {
        let [a, b, c] = corners;
        let along = [b - a, c - b, a - c];
        let inverse = along.map(|e| if e == DVec3::ZERO { 0.0 } else { 1.0 / e.length_squared() });
        let longer = |i: usize, k: usize| if along[k].length() > along[i].length() { k } else { i };
        let longest = longer(longer(0, 1), 2);
        let length = along[longest].length();
        let cross = accurate_cross(along[0], along[1]);
        // The height of a lower face is only rounding, and the squared area of a smaller face loses
        // precision.
        let has_plane = cross.length() > FLAT * length * length && length > SMALLEST;
        let normal = has_plane.then_some(cross).and_then(DVec3::try_normalize);
        Self { corners, along, inverse, longest, normal }
    }

    fn ball(&self) -> Ball {
        let [a, b, c] = self.corners;
        let center = 0.5 * (a.min(b).min(c) + a.max(b).max(c));
        let radius = self.corners.iter().map(|p| p.distance(center)).fold(0.0, f64::max);
        Ball { center, radius: radius * (1.0 + ROUNDING) }
    }

    fn offset(&self, p: DVec3) -> DVec3 {
        if let Some(n) = self.normal {
            let from = self.corners.map(|c| p - c);
            // When this test is wrong, the foot is only a rounding error away from the edge.
            let over = (0..3).all(|k| n.cross(self.along[k]).dot(from[k]) >= 0.0);
            let at = from[self.longest].dot(self.along[self.longest]) * self.inverse[self.longest];
            if over && (0.0..=1.0).contains(&at) {
                return n.dot(from[0]) * n;
            }
        }
        let mut best = DVec3::INFINITY;
        let mut least = f64::INFINITY;
        for k in 0..3 {
            let from = p - self.corners[k];
            let t = (from.dot(self.along[k]) * self.inverse[k]).clamp(0.0, 1.0);
            // Measured from the nearer end, so that rounding is small relative to the remainder.
            let offset = if t <= 0.5 {
                from - t * self.along[k]
            } else {
                let next = p - self.corners[(k + 1) % 3];
                let back = (next.dot(-self.along[k]) * self.inverse[k]).clamp(0.0, 1.0);
                next + back * self.along[k]
            };
            if offset.length_squared() < least {
                (best, least) = (offset, offset.length_squared());
            }
        }
        best
    }
}

/// The cross product. Each component is accurate to some ulps of itself.
///
/// With a plain cross product, a needle of aspect 1e7 has a normal with an error of 1e-9, and
/// distances to its far end have an error of 1e-9 of its length.
fn accurate_cross(u: DVec3, v: DVec3) -> DVec3 {
    // Kahan's difference of products; see Jeannerod, Louvet, Muller 2013.
    let difference = |a: f64, b: f64, c: f64, d: f64| {
        let cd = c * d;
        let lost = c.mul_add(-d, cd);
        a.mul_add(b, -cd) + lost
    };
    DVec3::new(difference(u.y, v.z, u.z, v.y), difference(u.z, v.x, u.x, v.z), difference(u.x, v.y, u.y, v.x))
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::testing::{degenerate, exact};

    fn point() -> impl Strategy<Value = DVec3> {
        prop::array::uniform3(-3i32..4).prop_map(|[x, y, z]| DVec3::new(x.into(), y.into(), z.into()))
    }

    proptest! {
        #[test]
        fn no_sample_of_the_triangle_is_closer(a in point(), b in point(), c in point(), p in point()) {
            let offset = Facet::new([a, b, c]).offset(p);
            let (mut least, mut near) = (f64::INFINITY, f64::INFINITY);
            for i in 0..=60 {
                for j in 0..=60 - i {
                    let (u, v) = (f64::from(i) / 60.0, f64::from(j) / 60.0);
                    let q = a + u * (b - a) + v * (c - a);
                    least = least.min(p.distance(q));
                    near = near.min((p - offset).distance(q));
                }
            }
            prop_assert!(offset.length() <= least + 1e-12, "{} {}", offset, least);
            prop_assert!(near <= 0.2, "the closest point is {} off the triangle", near);
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(2000))]
        #[test]
        fn degenerate_faces_are_exact((corners, p) in degenerate::face_and_point()) {
            let distance = Facet::new(corners).offset(p).length();
            let squared = exact::squared_distance(p, corners);
            prop_assert!(exact::is_root(distance, &squared, 2e-14), "{distance} at {p} from {corners:?}");
        }
    }

    #[test]
    fn heights_over_needles_are_accurate() {
        // Height 1e-7 of the length, in no special position; the points are over the far end.
        let (u, v) = (DVec3::new(0.3, 0.5, 0.7).normalize(), DVec3::new(0.1, -0.9, 0.2));
        let n = accurate_cross(u, v).normalize();
        let w = n.cross(u);
        let corners = [DVec3::ZERO, u, 0.9 * u + 1e-7 * w];
        let facet = Facet::new(corners);
        let middle = 0.5 * corners[1] + 0.5 * corners[2];
        for height in [-1e-3, 1e-3, 0.5] {
            let offset = facet.offset(middle + height * n);
            assert!(
                (offset.length() - f64::abs(height)).abs() < 4e-16,
                "{}",
                offset.length() - f64::abs(height)
            );
        }
    }
}
