use glam::DVec3;

use super::Lowest;
use super::branch_and_bound::branch_and_bound;
use crate::TeSdf;
use crate::asset::layout::{Label, Side};
use crate::collide::field::{CellField, ROUNDING};
use crate::collide::polygon::{MOST_VERTICES, Polygon};
use crate::geometry::polygon_to_triangle;
use crate::query::{Faces, Place, Precision};

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
    let (distance, point) = nearest_to_faces(asset, place, faces, polygon, normal, (center, radius), reach);
    // Clear of the surface, the polygon is all on one side of it.
    let all_outside = !crossing || (distance > 0.0 && cell.value(point, Precision::F64).distance > 0.0);
    if !all_outside {
        return Some(branch_and_bound(cell, polygon, tolerance, reach, precision));
    }
    (distance <= reach).then_some(Lowest { point, converged: true })
}

/// The least distance between the polygon and the faces that can be nearest to a point of it, and where; endless and the ball's middle
/// when all are beyond `reach`. The polygon is within the ball.
fn nearest_to_faces(
    asset: &TeSdf,
    place: Place,
    faces: &Faces,
    polygon: &Polygon,
    normal: DVec3,
    (center, radius): (DVec3, f64),
    reach: f64,
) -> (f64, DVec3) {
    let mut points = [DVec3::ZERO; MOST_VERTICES];
    let count = polygon.vertices().len();
    points.iter_mut().zip(polygon.points()).for_each(|(to, p)| *to = p);
    let points = &points[..count];
    let mut best = (f64::INFINITY, center);
    let mut offer = |face: u32| {
        let triangle = asset.local_triangle(face as usize);
        let limit = best.0.min(reach.max(0.0));
        let [a, ..] = triangle.corners;
        // Most faces are out by the plane of one of the two; between parallel walls all but a few.
        let beyond = is_beyond_plane(points, a, triangle.normal, limit)
            || is_beyond_plane(&triangle.corners, points[0], normal, limit)
            || triangle.closest(center).distance - radius > limit;
        if !beyond {
            let found = polygon_to_triangle(points, normal, &triangle);
            if found.0 < best.0 {
                best = found;
            }
        }
        best.0
    };
    match place {
        Place::Listed { .. } => asset.near_in_list(faces, center, radius, &mut offer),
        _ => asset.near_in_tree(center, radius, &mut offer),
    }
    best
}

/// Whether all points are more than `limit` off a plane, on one side of it. A normal of zero says nothing.
fn is_beyond_plane(points: &[DVec3], on_plane: DVec3, normal: DVec3, limit: f64) -> bool {
    // Well above the rounding of a height in the local frame.
    let limit = limit + 1e-14;
    let (mut above, mut below) = (true, true);
    for p in points {
        let height = normal.dot(*p - on_plane);
        above &= height > limit;
        below &= height < -limit;
    }
    above || below
}
