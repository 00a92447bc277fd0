use glam::DVec3;

use super::Lowest;
use super::branch_and_bound::branch_and_bound;
use crate::TeSdf;
use crate::asset::layout::{Label, Side};
use crate::collide::field::{CellField, ROUNDING};
use crate::collide::polygon::{MOST_VERTICES, Polygon};
use crate::geometry::polygon_to_triangle;
use crate::query::{Faces, Place, Precision};

/// Closer to the surface than this (local frame) a polygon may cross it: where two faces cross, the distance between them is
/// rarely 0 but some 1e-17, and the sign there may be either. Far below any sensible tolerance.
const CLEAR: f64 = 1e-9;

/// The least signed distance over a polygon to `tolerance`, both in the field's frame; `None` when it is above `reach`.
///
/// Outside of the solid it is the least distance between the polygon and a face, in closed form. Inside it is the greatest of a
/// minimum of convex functions, found by branch and bound; the field is 1-Lipschitz, and the distance to one face, being convex,
/// is over a triangle at most what it is at a corner.
pub fn lowest(
    cell: &CellField,
    polygon: &Polygon,
    normal: DVec3,
    tolerance: f64,
    reach: f64,
    precision: Precision,
) -> Option<Lowest> {
    let center = polygon.center();
    let radius = polygon.reach(center);
    let first = cell.value(center, Precision::F32);
    if first.distance - radius > reach + ROUNDING {
        return None;
    }
    let CellField::Mesh { asset, place, faces } = *cell else {
        return Some(branch_and_bound(cell, polygon, tolerance, reach, precision));
    };
    let crossing = matches!(place, Place::Listed { label: Label::Crossing(_), .. });
    let inside = match place {
        Place::Listed { label: Label::Inside, .. } | Place::Far(Side::Inside) => true,
        // Nothing of the surface is nearer to the centre than its distance.
        _ if crossing => first.distance < -radius - ROUNDING,
        _ => false,
    };
    if inside {
        return Some(branch_and_bound(cell, polygon, tolerance, reach, precision));
    }
    if !crossing && reach < 0.0 {
        return None;
    }
    let query = Query { asset, place, faces, polygon, normal, center, radius, tolerance, reach };
    let (distance, point) = query.nearest_to_faces(first.position);
    // Clear of the surface, the polygon is all on one side of it.
    let all_outside = !crossing || (distance > CLEAR && cell.value(point, Precision::F64).distance > 0.0);
    if !all_outside && !query.only_touches(cell, distance, point) {
        return Some(branch_and_bound(cell, polygon, tolerance, reach, precision));
    }
    (distance <= reach).then_some(Lowest { point, converged: true })
}

/// A polygon and the faces that can be nearest to its points; all of it is within a ball.
#[derive(Clone, Copy)]
struct Query<'a> {
    asset: &'a TeSdf,
    place: Place,
    faces: &'a Faces,
    polygon: &'a Polygon,
    normal: DVec3,
    center: DVec3,
    radius: f64,
    tolerance: f64,
    reach: f64,
}

impl Query<'_> {
    /// The least distance between the polygon and a face, up to the tolerance, and where on the polygon; `likely` is looked at
    /// first. Endless, and the ball's middle, when all are beyond reach.
    fn nearest_to_faces(&self, likely: u32) -> (f64, DVec3) {
        let mut points = [DVec3::ZERO; MOST_VERTICES];
        points.iter_mut().zip(self.polygon.points()).for_each(|(to, p)| *to = p);
        let points = &points[..self.polygon.vertices().len()];
        // A polygon that may cross the surface is always seen.
        let farthest = self.reach.max(0.0) + 2.0 * CLEAR;
        let mut best = (f64::INFINITY, self.center);
        let mut offer = |face: u32| {
            // What is nearer by less than the tolerance does not count, unless the polygon may go through it.
            let limit = if best.0 > self.tolerance + CLEAR { best.0 - self.tolerance } else { best.0 };
            let limit = limit.min(farthest);
            if !self.plane_is_beyond(points, face, limit) {
                let triangle = self.asset.local_triangle(face as usize);
                if let Some(found) = polygon_to_triangle(points, self.normal, &triangle, limit) {
                    best = found;
                }
            }
            best.0.min(farthest)
        };
        offer(likely);
        match self.place {
            Place::Listed { .. } => {
                self.asset.near_in_list(self.faces, self.center, self.radius, &mut offer);
            }
            _ => self.asset.near_in_tree(self.center, self.radius, &mut offer),
        }
        best
    }

    /// Whether the polygon, `distance` from the surface at `point`, touches it along an edge or a whole face but does not go in: it is then free a
    /// hair's breadth out, or back, and its least is 0 up to that.
    fn only_touches(&self, cell: &CellField, distance: f64, point: DVec3) -> bool {
        let hair = self.tolerance.min(CLEAR);
        let is_free = |outward: DVec3| {
            let moved: Vec<DVec3> = self.polygon.points().map(|p| p + hair * outward).collect();
            let (polygon, center) = (&Polygon::new(&moved), self.center + hair * outward);
            let moved = Query { polygon, center, reach: hair, ..*self };
            let face = cell.value(center, Precision::F32).position;
            let (clear, at) = moved.nearest_to_faces(face);
            clear > 0.1 * hair && cell.value(at, Precision::F64).distance > 0.0
        };
        distance <= hair && (is_free(cell.value(point, Precision::F64).gradient) || is_free(-self.normal))
    }

    /// Whether all of the polygon is farther than `limit` from the plane of a face: in `f32` already, without making the face's
    /// normal.
    fn plane_is_beyond(&self, points: &[DVec3], face: u32, limit: f64) -> bool {
        let plane = self.asset.records[face as usize].triangle();
        let middle = self.asset.cube.middle() + plane.corners[0];
        let heights = points.iter().map(|&p| plane.normal.dot(p - middle));
        let (low, high) = heights.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), x| (l.min(x), h.max(x)));
        low.max(-high) > limit + ROUNDING
    }
}
