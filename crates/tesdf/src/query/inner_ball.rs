//! The thickness of a solid, and how finely its vertices sample its surface. The search for hidden
//! overlaps uses both.
use glam::DVec3;

use crate::TeSdf;
use crate::asset::InnerBall;
use crate::asset::layout::TreeChild;

/// Largest number of faces at which inner balls are computed.
const TRIES: usize = 64;
/// Largest number of shrinking steps per ball. Ten steps can shrink it to a thousandth.
const STEPS: usize = 32;
/// A ball counts as inside when its radius exceeds the distance to the surface by at most this
/// fraction.
const FITS: f64 = 1e-3;

impl TeSdf {
    /// The largest of the balls that touch the surface from inside at the centroids of some faces.
    /// In a sheet, the ball of half of its thickness on a face. Its radius is a lower bound of the
    /// radius of the largest ball inside. Computed on first use.
    pub(crate) fn inner_ball(&self) -> InnerBall {
        *self.inner_ball.get_or_init(|| {
            if self.half_thickness > 0.0 {
                let middle = self.local_triangle(self.face_count() / 2).corners.iter().sum::<DVec3>() / 3.0;
                return InnerBall { center: middle, radius: self.half_thickness };
            }
            let step = self.face_count().div_ceil(TRIES);
            let mut largest = InnerBall::default();
            for face in (0..self.face_count()).step_by(step) {
                let center = self.middle_below(face);
                let radius = -self.found_exactly(center).signed_distance;
                if radius > largest.radius {
                    largest = InnerBall { center, radius };
                }
            }
            largest
        })
    }

    /// Centre of the ball that touches the centroid of a face from inside and the surface
    /// elsewhere, by shrinking (Ma, Bae and Choi 2012).
    fn middle_below(&self, face: usize) -> DVec3 {
        let triangle = self.local_triangle(face);
        let on_face = triangle.corners.iter().sum::<DVec3>() / 3.0;
        let normal = self.outward_normal(face as u32, on_face);
        let mut radius = 0.5 * self.local_bounds().extent().length();
        for _ in 0..STEPS {
            let nearest = self.found_exactly(on_face - radius * normal);
            if nearest.signed_distance.abs() >= radius * (1.0 - FITS) {
                break;
            }
            // The ball through both points that is tangent to the face's plane.
            let apart = on_face - nearest.closest_point;
            let through = apart.length_squared() / (2.0 * apart.dot(normal));
            radius = if through > 0.0 && through < radius { through } else { 0.5 * radius };
        }
        on_face - radius * normal
    }

    /// For each node of the face tree, the greatest [`corner_reach`] of the faces below it, in the
    /// local frame, rounded up. Computed on first use.
    pub(crate) fn corner_reaches(&self) -> &[f32] {
        self.corner_reaches.get_or_init(|| {
            let of_faces = |start: u32, count: u32| {
                let reach = |face: u32| corner_reach(self.local_triangle(face as usize).corners);
                ((start..start + count).map(reach).fold(0.0, f64::max) as f32).next_up()
            };
            let mut reaches = vec![0.0f32; self.tree_children.len()];
            // Children follow their parents.
            for node in (0..reaches.len()).rev() {
                for child in self.tree_children[node].map(TreeChild::decode) {
                    let below = match child {
                        TreeChild::Node(node) => reaches[node as usize],
                        TreeChild::Leaf(start, count) => of_faces(start, count),
                    };
                    reaches[node] = reaches[node].max(below);
                }
            }
            reaches
        })
    }
}

/// The greatest distance of a point of a triangle from its nearest corner. A 1-Lipschitz function
/// is nowhere on the triangle lower than its least value at the corners by more than this.
pub fn corner_reach(corners: [DVec3; 3]) -> f64 {
    let [p, q, r] = corners;
    let mut sides = [p.distance_squared(q), q.distance_squared(r), r.distance_squared(p)];
    sides.sort_unstable_by(f64::total_cmp);
    let [c, b, a] = sides;
    let longest = a.sqrt();
    // For an acute triangle it is the circumradius. Otherwise the point lies on the longest side,
    // on the bisector of another side.
    let reach = if a < b + c {
        (a * b * c).sqrt() / (2.0 * (q - p).cross(r - p).length())
    } else {
        let on_longest = |side: f64, other: f64| longest * side / (a + side - other);
        on_longest(b, c).max(on_longest(c, b))
    };
    // Limits the rounding error of needles, and replaces NaN.
    reach.min(longest / 3f64.sqrt())
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn point() -> impl Strategy<Value = DVec3> {
        proptest::array::uniform3(-1.0f64..1.0).prop_map(DVec3::from_array)
    }

    proptest! {
        /// Well-shaped triangles, needles, caps and segments.
        #[test]
        fn corner_reach_bounds_the_distance_to_the_nearest_corner(
            (a, b, c) in (point(), point(), point()), along in 0.0f64..1.0, thin in proptest::sample::select(vec![1.0, 0.3, 1e-2, 1e-9, 0.0]),
        ) {
            let corners = [a, b, a.lerp(b, along) + thin * (c - a)];
            let reach = corner_reach(corners);
            let at = |i: i32, j: i32| {
                let (s, t) = (f64::from(i) / 60.0, f64::from(j) / 60.0);
                a + s * (b - a) + t * (corners[2] - a)
            };
            let points = (0..=60).flat_map(|i| (0..=60 - i).map(move |j| at(i, j)));
            let from_nearest = points.map(|p| corners.map(|q| q.distance(p)).into_iter().fold(9.0, f64::min));
            let farthest = from_nearest.fold(0.0, f64::max);
            prop_assert!(farthest <= reach * (1.0 + 1e-12), "{} > {}", farthest, reach);
            prop_assert!(reach <= farthest + 0.1, "{} instead of {}", reach, farthest);
        }
    }

    #[test]
    fn corner_reach_of_points_and_segments() {
        assert_eq!(corner_reach([DVec3::ONE; 3]), 0.0);
        assert_eq!(corner_reach([DVec3::ZERO, DVec3::X, DVec3::X]), 0.5);
        assert_eq!(corner_reach([DVec3::ZERO, 1e-100 * DVec3::X, DVec3::ZERO]), 0.5e-100);
    }
}
