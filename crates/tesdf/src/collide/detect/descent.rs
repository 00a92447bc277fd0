//! Whether the distance falls from a contact along the surface.
//!
//! The least signed distance over a face may lie on its border and go on falling in the face beside
//! it. Such a contact is no minimum over the surface. Its direction is oblique, and as a plane it
//! stops a body that has room: of a wall just ahead of a peg, the border that faces the peg. Unless
//! that plane is a wall itself, as the sides of a groove are.
use arrayvec::ArrayVec;
use glam::DVec3;

use crate::collide::bodies::field::{FieldBody, ROUNDING};
use crate::collide::bodies::surface::SurfaceBody;
use crate::geometry::Triangle;

/// A contact is no minimum where the distance falls by more than this per unit of length. Where it
/// falls by less, bodies that turn by less than this angle (rad) can touch.
pub const SLOPE: f64 = 0.1;

/// A point that shows the fall is lower by at least this per unit of length.
const LOWER: f64 = 0.5 * SLOPE;

/// A contact is on a side of a face when it is nearer to it than this fraction of the longest edge.
const ON_SIDE: f64 = 1e-4;

/// Behind a wall the distance falls by at least this fraction of what it falls behind a plane.
/// Measured with 0.5 and 0.95; a chain that swings under load holds with both, with 0.5 it is less
/// deep.
const WALL: f64 = 0.5;

/// The distance to the point that shows the fall: a fraction of the signed distance, because the
/// field bends on that scale.
const WAY: f64 = 0.25;

/// Least and greatest distance to that point, as fractions of the longest edge.
const WAYS: [f64; 2] = [1e-4, 1.0 / 64.0];

/// A point of a face, and the field there, in `f64` (field's frame).
#[derive(Clone, Copy, Debug)]
pub struct OnFace {
    /// The face, by its index in the surface's shape.
    pub face: u32,
    /// The point.
    pub point: DVec3,
    /// The signed distance at the point.
    pub distance: f64,
    /// Its gradient.
    pub gradient: DVec3,
    /// Whether the point is the lowest of its face. Then only the faces beside it matter.
    pub is_lowest: bool,
}

/// A side of a face at which a contact is.
#[derive(Clone, Copy)]
struct Side {
    /// The side goes from this corner to the next one.
    corner: usize,
    along: DVec3,
    inward: DVec3,
}

/// Whether the distance falls from a point along the surface, steeper than [`SLOPE`], and its plane
/// is no wall.
///
/// Another point of the same face or of a face beside it shows the fall: it is lower. So each
/// contact that is dropped is followed by a lower one, and the deepest one stays. Planes and
/// rounded shapes have no faces, and their points stay.
///
/// `has_contact` tells whether a face with a lower point has a lower contact.
pub fn descends(
    surface: &SurfaceBody,
    field: &FieldBody,
    at: &OnFace,
    has_contact: impl Fn(&Triangle) -> bool,
) -> bool {
    let Some(own) = surface.face_triangle(at.face) else { return false };
    let falls_in = |face: &Triangle| falls_in(face, field, at) && has_contact(face);
    if !at.is_lowest && falls_in(&own) {
        return !is_wall(&own, field, at);
    }
    let corners: ArrayVec<usize, 2> = match sides_at(&own, field, at.point).as_slice() {
        [] => return false,
        [side] => [side.corner, (side.corner + 1) % 3].into_iter().collect(),
        // Two sides meet at a corner.
        [first, .., last] => {
            let is_last = (first.corner + 1) % 3 == last.corner;
            [if is_last { last.corner } else { first.corner }].into_iter().collect()
        }
    };
    surface.any_beside(at.face, &corners, (at.gradient, SLOPE), falls_in) && !is_wall(&own, field, at)
}

/// Whether the plane of a contact is a wall: the body cannot pass it sideways.
///
/// In a groove, as in the bend of a chain link, the only minimum is the bottom, and its plane does
/// not hold a body that is pushed to the side. The planes of the faces beside it do. Where the
/// other body is convex, the surface turns away from such a plane instead, and a body that slides
/// by has room. So the point is moved sideways by twice the way at which it meets the plane. Behind
/// a wall it is as deep as it was high before; on a surface that turns away it is not.
fn is_wall(own: &Triangle, field: &FieldBody, at: &OnFace) -> bool {
    let along = at.gradient.reject_from_normalized(own.normal);
    let slope = along.length();
    let gap = at.distance.abs().max(WAYS[0] * longest_edge(own));
    if slope <= SLOPE {
        return false;
    }
    let behind = at.point - 2.0 * gap / (slope * slope) * along;
    let wall = at.distance - 2.0 * WALL * gap;
    field.rough(behind).0 <= wall + ROUNDING && field.field.exact_value(behind).distance <= wall
}

/// Whether a point of a face is lower than a point of its border, or of the face itself.
fn falls_in(face: &Triangle, field: &FieldBody, at: &OnFace) -> bool {
    let down = -at.gradient.reject_from_normalized(face.normal);
    let way = steepest(down, &sides_at(face, field, at.point));
    let slope = way.length();
    if face.normal == DVec3::ZERO || slope <= SLOPE {
        return false;
    }
    let [shortest, longest] = WAYS.map(|share| share * longest_edge(face));
    let step = (WAY * at.distance.abs()).clamp(shortest, longest);
    let point = face.closest(at.point + step / slope * way).point;
    let lower = at.distance - LOWER * point.distance(at.point);
    field.rough(point).0 < lower + ROUNDING && field.field.exact_value(point).distance < lower
}

/// The steepest way down that does not leave the face, where the point is at these sides.
fn steepest(down: DVec3, sides: &[Side]) -> DVec3 {
    let stays = |way: &DVec3| sides.iter().all(|side| side.inward.dot(*way) >= -1e-9);
    if stays(&down) {
        return down;
    }
    let along = sides.iter().map(|side| down.dot(side.along) * side.along).filter(stays);
    along.fold(DVec3::ZERO, |best, way| if way.length() > best.length() { way } else { best })
}

/// The sides of a face that a point is at.
fn sides_at(face: &Triangle, field: &FieldBody, p: DVec3) -> ArrayVec<Side, 3> {
    let near = ON_SIDE * longest_edge(face) + field.rounding();
    let side = |corner: usize| {
        let start = face.corners[corner];
        let along = (face.corners[(corner + 1) % 3] - start).normalize_or_zero();
        let side = Side { corner, along, inward: face.normal.cross(along) };
        ((p - start).dot(side.inward) <= near).then_some(side)
    };
    (0..3).filter_map(side).collect()
}

fn longest_edge(face: &Triangle) -> f64 {
    let [a, b, c] = face.corners;
    a.distance(b).max(b.distance(c)).max(c.distance(a))
}
