//! Points so far out that they are answered from nearer by.
use glam::DVec3;

use super::{Answer, Faces, Place};
use crate::TeSdf;
use crate::base::Side;
use crate::geometry::length_and_direction;

/// A point with a coordinate above this (local frame) is far: squares of larger numbers leave the range of 64-bit floats
/// in the end, and before that rounding hides which face is the nearest.
const FAR: f64 = 1e8;

/// Whether a point of the local frame is finite and not far.
#[inline]
pub(super) fn is_near(local: DVec3) -> bool {
    // NaN fails the comparison.
    local.abs().cmple(DVec3::splat(FAR)).all()
}

/// Where a far point is answered from, in the same direction.
///
/// The nearest point `x` of the body to there is as good as the nearest to the far point up to `1 / (2 NEARER)`: with
/// `p = r u`, `|p − x| = r − u·x + |x⊥|²/(2r) + …`, and the body is within 1. That is less than the rounding of coordinates from `FAR` on.
const NEARER: f64 = 1e7;

impl TeSdf {
    /// The answer for a point that is far or not finite; `point` is in the mesh's unit.
    #[cold]
    pub(super) fn answer_far(&self, point: DVec3) -> Answer {
        if !point.is_finite() {
            return Answer::NONE;
        }
        let middle = self.bounds().center();
        let (_, outward) = length_and_direction(point - middle);
        let near = self.frame.to_local(middle) + NEARER * outward;
        let found = self.answer_f64(near, Place::Far(Side::Outside), &Faces::default());
        let closest_point = self.frame.to_world(found.closest_point);
        let (signed_distance, gradient) = length_and_direction(point - closest_point);
        let face = self.face_ids[found.position as usize];
        Answer { signed_distance, gradient, closest_point, face }
    }
}
