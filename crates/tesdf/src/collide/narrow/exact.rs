use glam::DVec3;

use super::Lowest;
use super::branch_and_bound::branch_and_bound;
use crate::TeSdf;
use crate::asset::layout::Label;
use crate::base::Side;
use crate::collide::field::{CellField, ROUNDING};
use crate::collide::polygon::{MAX_VERTICES, Parts, Polygon};
use crate::geometry::polygon_to_triangle;
use crate::query::{Faces, Place, Precision};

/// Nearer to the surface than this (local frame), a polygon may cross it. Where two faces cross,
/// their computed distance is rarely 0 but about 1e-17, and the sign there may be either. This is
/// far below any sensible tolerance.
const CLEAR: f64 = 1e-9;

/// The least signed distance over a polygon, within `tolerance`; both in the field's frame. `None`
/// when it is above `reach`.
///
/// Outside the solid it is the least distance between the polygon and a face, in closed form.
/// Inside, the depth is a minimum of convex functions, and branch and bound finds its maximum. It
/// uses that the field is 1-Lipschitz, and that the distance to one face is convex, so over a
/// triangle it is at most its greatest value at a corner.
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
        // No point of the surface is nearer to the centre than this distance.
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
    if crossing && distance <= CLEAR && !query.only_touches(cell, distance, point) {
        return query.lowest_of_parts(cell, precision);
    }
    // A polygon that keeps clear of the surface is on one side of it.
    if crossing && distance > CLEAR && cell.value(point, Precision::F64).distance < 0.0 {
        return Some(branch_and_bound(cell, polygon, tolerance, reach, precision));
    }
    (distance <= reach).then_some(Lowest { point, converged: true })
}

/// Number of cuts after which the rest of a polygon is searched without further cuts.
const MAX_CUTS: usize = 64;

/// A polygon, and the faces that can be nearest to its points. A ball contains the polygon.
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
    /// The least distance between the polygon and a face, within the tolerance, with the nearest
    /// point of the polygon. `likely` is tested first. Infinite, with the centre of the ball, when
    /// all faces are out of reach.
    fn nearest_to_faces(&self, likely: u32) -> (f64, DVec3) {
        let mut points = [DVec3::ZERO; MAX_VERTICES];
        points.iter_mut().zip(self.polygon.points()).for_each(|(to, p)| *to = p);
        let points = &points[..self.polygon.vertices().len()];
        // Keeps all polygons that may cross the surface.
        let farthest = self.reach.max(0.0) + 2.0 * CLEAR;
        let mut best = (f64::INFINITY, self.center);
        let mut offer = |face: u32| {
            // Improvements below the tolerance are skipped, unless the polygon may cross the face.
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

    /// The lowest point of a polygon that crosses the surface. The polygon is cut along the faces
    /// that it crosses, so that each part is on one side.
    ///
    /// Branch and bound alone would need pieces as small as the gap on the outer side. For two
    /// flanks a micrometre apart that touch somewhere, it used all allowed evaluations.
    fn lowest_of_parts(&self, cell: &CellField, precision: Precision) -> Option<Lowest> {
        let mut least = (f64::INFINITY, self.center);
        let mut converged = true;
        let mut parts = vec![self.polygon.clone()];
        let mut cuts = 0;
        while let Some(polygon) = parts.pop() {
            let center = polygon.center();
            let reach = self.reach.min(least.0);
            let part = Query { polygon: &polygon, center, radius: polygon.reach(center), reach, ..*self };
            if cuts < MAX_CUTS
                && let Some((above, below)) = part.cut()
            {
                cuts += 1;
                parts.extend([above, below]);
                continue;
            }
            let value = cell.value(center, Precision::F64);
            let (distance, point) = part.nearest_to_faces(value.position);
            let found = if value.distance > CLEAR || part.only_touches(cell, distance, point) {
                (distance, point)
            } else {
                let lowest = branch_and_bound(cell, &polygon, self.tolerance, reach, precision);
                converged &= lowest.converged;
                (cell.value(lowest.point, Precision::F64).distance, lowest.point)
            };
            if found.0 < least.0 {
                least = found;
            }
        }
        (least.0 <= self.reach).then_some(Lowest { point: least.1, converged })
    }

    /// Cuts the polygon along the plane of the face that it crosses deepest; `None` when it crosses
    /// no face.
    fn cut(&self) -> Option<(Polygon, Polygon)> {
        let mut points = [DVec3::ZERO; MAX_VERTICES];
        points.iter_mut().zip(self.polygon.points()).for_each(|(to, p)| *to = p);
        let points = &points[..self.polygon.vertices().len()];
        let mut deepest = (CLEAR, None);
        self.asset.near_in_list(self.faces, self.center, self.radius, &mut |face| {
            let triangle = self.asset.local_triangle(face as usize);
            let height = |p: &DVec3| triangle.normal.dot(*p - triangle.corners[0]);
            let heights = points.iter().map(height);
            let (low, high) =
                heights.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), x| (l.min(x), h.max(x)));
            let depth = high.min(-low);
            if depth > deepest.0
                && polygon_to_triangle(points, self.normal, &triangle, 2.0 * CLEAR)
                    .is_some_and(|(distance, _)| distance <= CLEAR)
            {
                deepest = (depth, Some(triangle));
            }
            f64::INFINITY
        });
        let triangle = deepest.1?;
        match self.polygon.cut(|v| triangle.normal.dot(v.point - triangle.corners[0])) {
            Parts::Across(above, below) => Some((above, below)),
            Parts::Above | Parts::Below => None,
        }
    }

    /// Whether the polygon, which is `distance` from the surface at `point`, only touches it along
    /// an edge or a whole face. It then has no contact after a tiny move outwards or backwards, and
    /// its least distance is 0 up to that move.
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

    /// Whether the whole polygon is farther than `limit` from the plane of a face. Decided in
    /// `f32`, without computing the face's normal.
    fn plane_is_beyond(&self, points: &[DVec3], face: u32, limit: f64) -> bool {
        let plane = self.asset.records[face as usize].triangle();
        let middle = self.asset.cube.middle() + plane.corners[0];
        let heights = points.iter().map(|&p| plane.normal.dot(p - middle));
        let (low, high) = heights.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), x| (l.min(x), h.max(x)));
        low.max(-high) > limit + ROUNDING
    }
}
