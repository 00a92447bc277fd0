//! Answers points that are very far out by a nearer point in the same direction.
use glam::DVec3;

use super::{Answer, Faces, Place};
use crate::TeSdf;
use crate::base::Side;
use crate::geometry::length_and_direction;

/// A point is far when a coordinate in the local frame exceeds this. Much farther out, squares
/// leave the range of 64-bit floats; before that, rounding hides which face is the nearest.
const FAR: f64 = 1e8;

/// Whether a point of the local frame is finite and not far.
#[inline]
pub(super) fn is_near(local: DVec3) -> bool {
    // The comparison is false for NaN.
    local.abs().cmple(DVec3::splat(FAR)).all()
}

/// Distance of the point, in the same direction, from which a far point is answered.
///
/// Let `x` be the nearest point of the body as seen from there. For the far point, `x` is the
/// nearest up to `1 / (2 NEARER)`: with `p = r u`, `|p − x| = r − u·x + |x⊥|²/(2r) + …`, and the
/// body is within 1. From `FAR` on, this is below the rounding of coordinates.
const NEARER: f64 = 1e7;

impl TeSdf {
    /// The answer at a point that is far or not finite. `point` is in the mesh's unit.
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
        let half = self.half_thickness * self.frame.inverse_scale();
        let (signed_distance, closest_point) = (signed_distance - half, closest_point + half * gradient);
        Answer { signed_distance, gradient, closest_point, face }
    }
}
