use arrayvec::ArrayVec;
use glam::DVec3;

use super::Lowest;
use super::branch_and_bound::{self, branch_and_bound};
use super::deepest::{deepest, has_bounds_by_planes};
use super::simple_shape;
use crate::TeSdf;
use crate::asset::layout::Label;
use crate::base::Side;
use crate::collide::bodies::field::{CellField, ROUNDING};
use crate::collide::bodies::polygon::{MAX_VERTICES, Parts, Polygon};
use crate::collide::scene::field_value::FieldValue;
use crate::geometry::polygon_to_triangle;
use crate::query::{Faces, Place, Precision, Surroundings};

/// Nearer to the surface than this (local frame), a polygon may cross it. Where two faces cross,
/// their computed distance is rarely 0 but about 1e-17, and the sign there may be either. This is
/// far below any sensible tolerance.
pub const CLEAR: f64 = 1e-9;

/// Where a whole face is deeper than this fraction of its radius, branch and bound over it drops
/// the parts near the surface at once, and finds the deepest point faster than if the face was cut
/// first.
const SUNK: f64 = 1.0 / 16.0;

/// The least signed distance over a polygon, within `tolerance`; both in the field's frame. `None`
/// when it is above `reach`.
///
/// Outside the solid it is the least distance between the polygon and a face, in closed form.
/// Inside, the depth is a minimum of convex functions, and a best-first search finds its maximum.
/// It uses that the field is 1-Lipschitz, and that the distance to one face is convex, so over a
/// triangle it is at most its greatest value at a corner.
///
/// Where the sign jumps, [`jump::lowest`](super::jump::lowest) is for it.
pub fn lowest(
    cell: &CellField,
    polygon: &Polygon,
    normal: DVec3,
    tolerance: f64,
    reach: f64,
    precision: Precision,
) -> Option<Lowest> {
    if let CellField::Simple(simple) = *cell {
        let points: ArrayVec<DVec3, MAX_VERTICES> = polygon.points().collect();
        let point = simple_shape::lowest(simple, &points, normal);
        return (simple.value(point).distance <= reach).then_some(Lowest {
            point,
            converged: true,
            face: None,
        });
    }
    let center = polygon.center();
    let radius = polygon.reach(center);
    let first = match cell {
        // Distances from lists that are not exact rule out nothing.
        CellField::Whole(around) => around.asset.found_exactly(center).into(),
        _ => cell.value(center, Precision::F32),
    };
    if first.distance - radius > reach + ROUNDING {
        return None;
    }
    let none = Faces::default();
    let (asset, place, faces) = cell.mesh(&none)?;
    // No point of the surface is nearer to the centre than the first distance.
    let clear = radius + ROUNDING;
    let (inside, crossing) = match (cell, place) {
        (CellField::Whole(_), _) => (first.distance < -clear, first.distance.abs() <= clear),
        (_, Place::Listed { label: Label::Crossing(_), .. }) => (first.distance < -clear, true),
        (_, Place::Listed { label: Label::Inside, .. } | Place::Far(Side::Inside)) => (true, false),
        _ => (false, false),
    };
    let is_sunk = |depth: f64| matches!(cell, CellField::Whole(_)) && depth > SUNK * radius;
    if inside || is_sunk(-first.distance) {
        return Some(lowest_inside(cell, polygon, normal, (tolerance, reach), precision));
    }
    if !crossing && reach < 0.0 {
        return None;
    }
    // Where the result names the face, its distance must be the least one.
    let slack = if matches!(cell, CellField::Whole(_)) { 0.0 } else { tolerance };
    let around = cell.surroundings();
    let query =
        Query { asset, around, place, faces, polygon, normal, center, radius, tolerance, slack, reach };
    let (distance, point, face) = query.nearest_to_faces(first.position);
    if crossing && distance <= CLEAR {
        let depth = -polygon.points().map(|p| cell.rough(p).0).fold(f64::INFINITY, f64::min);
        if is_sunk(depth) {
            return Some(lowest_inside(cell, polygon, normal, (tolerance, reach), precision));
        }
        if depth > ROUNDING || !query.only_touches(cell, distance, point) {
            return query.lowest_of_parts(cell, precision);
        }
    }
    // A polygon that keeps clear of the surface is on one side of it.
    let is_inside = || match first.distance {
        d if d.abs() > ROUNDING => d < 0.0,
        _ => cell.value(point, Precision::F64).distance < 0.0,
    };
    if crossing && distance > CLEAR && is_inside() {
        return Some(lowest_inside(cell, polygon, normal, (tolerance, reach), precision));
    }
    (distance <= reach).then_some(Lowest { point, converged: true, face })
}

/// The least signed distance over a polygon of which a part may be inside, within a tolerance, if
/// it is at most `reach`.
fn lowest_inside(
    cell: &CellField,
    polygon: &Polygon,
    normal: DVec3,
    (tolerance, reach): (f64, f64),
    precision: Precision,
) -> Lowest {
    match cell {
        CellField::Whole(Surroundings { asset, .. }) if has_bounds_by_planes(asset) => {
            deepest(asset, polygon, normal, tolerance, reach)
        }
        _ => branch_and_bound(cell, polygon, tolerance, reach, precision),
    }
}

/// Whether the value at a point of the polygon, `least`, has the least signed distance of the
/// polygon, up to `tolerance`; `false` when this is not clear. All in the field's frame.
///
/// Outside, the distance to a face is convex and lies above its tangent at the point; where that is
/// too low, the polygon is compared with the face. Inside, the bound is that of branch and bound
/// before the first branch.
pub fn is_least(
    cell: &CellField,
    polygon: &Polygon,
    normal: DVec3,
    point: DVec3,
    &FieldValue { distance: least, position: face, .. }: &FieldValue,
    tolerance: f64,
) -> bool {
    if let CellField::Simple(simple) = cell {
        // The field is convex.
        let gradient = simple.value(point).gradient;
        return polygon.points().all(|p| gradient.dot(p - point) >= -tolerance);
    }
    if least <= CLEAR {
        return branch_and_bound::is_least(cell, polygon, (least, point, face), tolerance);
    }
    let none = Faces::default();
    let Some(query) = Query::of_cell(cell, &none, polygon, normal, (tolerance, least)) else { return false };
    let points = query.points();
    // A polygon that keeps clear of all faces is on one side of the surface.
    let bound = (least - tolerance).max(0.5 * CLEAR);
    let mut is_least = true;
    query.near(least, &mut |face| {
        let triangle = query.asset.local_triangle(face as usize);
        let closest = triangle.closest(point);
        let outward = (point - closest.point) / closest.distance;
        let slope = polygon.points().map(|p| outward.dot(p - point)).fold(f64::INFINITY, f64::min);
        is_least &= closest.distance + slope >= bound
            || polygon_to_triangle(&points, normal, &triangle, bound).is_none();
        if is_least { least } else { f64::NEG_INFINITY }
    });
    is_least
}

/// The direction from a face to the nearest point of the polygon. Most other faces are farther
/// along it, in particular those that share the nearest point.
struct Axis {
    direction: DVec3,
    /// The lowest point of the polygon along it.
    lowest: f64,
}

impl Axis {
    /// `None` where the polygon touches the face.
    fn new(points: &[DVec3], way: DVec3) -> Option<Self> {
        let direction = way.try_normalize()?;
        let lowest = points.iter().map(|p| direction.dot(*p)).fold(f64::INFINITY, f64::min);
        Some(Self { direction, lowest })
    }

    /// Whether a face is at least `limit` away along the axis, up to rounding.
    fn separates(&self, corners: &[DVec3; 3], limit: f64) -> bool {
        let highest = corners.iter().map(|c| self.direction.dot(*c)).fold(f64::NEG_INFINITY, f64::max);
        self.lowest - highest >= limit - ALONG_AXIS
    }
}

/// Rounding of a height along an axis (local frame).
const ALONG_AXIS: f64 = 1e-14;

/// Number of cuts after which the rest of a polygon is searched without further cuts.
const MAX_CUTS: usize = 64;

/// A polygon, and the faces that can be nearest to its points. A ball contains the polygon.
#[derive(Clone, Copy)]
pub struct Query<'a> {
    asset: &'a TeSdf,
    /// For a polygon in the whole field.
    around: Option<&'a Surroundings<'a>>,
    place: Place,
    faces: &'a Faces,
    polygon: &'a Polygon,
    normal: DVec3,
    center: DVec3,
    radius: f64,
    tolerance: f64,
    /// Faces that are nearer by less than this are skipped.
    slack: f64,
    reach: f64,
}

impl<'a> Query<'a> {
    /// A polygon in a field; `none` is the list of the whole field. `None` for a simple shape.
    pub fn of_cell(
        cell: &'a CellField<'a>,
        none: &'a Faces,
        polygon: &'a Polygon,
        normal: DVec3,
        (tolerance, reach): (f64, f64),
    ) -> Option<Self> {
        let (asset, place, faces) = cell.mesh(none)?;
        let center = polygon.center();
        let (radius, around) = (polygon.reach(center), cell.surroundings());
        let slack = 0.0;
        Some(Self { asset, around, place, faces, polygon, normal, center, radius, tolerance, slack, reach })
    }

    /// Another polygon in the same plane.
    pub fn with_polygon<'b>(&self, polygon: &'b Polygon) -> Query<'b>
    where
        'a: 'b,
    {
        let center = polygon.center();
        Query { polygon, center, radius: polygon.reach(center), ..*self }
    }

    fn points(&self) -> ArrayVec<DVec3, MAX_VERTICES> {
        self.polygon.points().collect()
    }

    /// The least distance between the polygon and a face, within the tolerance, with the nearest
    /// point of the polygon and the face. `likely` is tested first. Infinite, with the centre of
    /// the ball and no face, when all faces are out of reach.
    pub fn nearest_to_faces(&self, likely: u32) -> (f64, DVec3, Option<u32>) {
        let points = &self.points();
        // Keeps all polygons that may cross the surface.
        let farthest = self.reach.max(0.0) + 2.0 * CLEAR;
        let mut best = (f64::INFINITY, self.center, None);
        let mut axis = None;
        let mut offer = |face: u32| {
            // Improvements below the slack are skipped, unless the polygon may cross the face.
            let limit = if best.0 > self.slack + CLEAR { best.0 - self.slack } else { best.0 };
            let limit = limit.min(farthest);
            let corners = self.asset.local_corners(face as usize);
            let is_apart = |axis: &Axis| axis.separates(&corners, limit);
            if !axis.as_ref().is_some_and(is_apart) && !self.plane_is_beyond(points, face, limit) {
                let triangle = self.asset.local_triangle(face as usize);
                if let Some((distance, point)) = polygon_to_triangle(points, self.normal, &triangle, limit) {
                    best = (distance, point, Some(face));
                    axis = Axis::new(points, point - triangle.closest(point).point);
                }
            }
            best.0.min(farthest)
        };
        let first = offer(likely);
        self.near(first, &mut offer);
        best
    }

    /// Offers the faces that can be nearest to a point of the polygon. `offer` returns the least
    /// distance so far between the polygon and a face; `first` is the first one.
    fn near(&self, first: f64, offer: &mut impl FnMut(u32) -> f64) {
        match (self.around, self.place) {
            (Some(around), _) => around.near_polygon(&self.points(), self.normal, first, offer),
            (None, Place::Listed { .. }) => {
                self.asset.near_in_list(self.faces, self.center, self.radius, offer)
            }
            _ => self.asset.near_polygon(&self.points(), self.normal, first, offer),
        }
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
            let part = Query { reach, ..self.with_polygon(&polygon) };
            if cuts < MAX_CUTS
                && let Some((above, below)) = part.cut()
            {
                cuts += 1;
                parts.extend([above, below]);
                continue;
            }
            let value = cell.value(center, Precision::F64);
            let touches = || {
                let (distance, point, _) = part.nearest_to_faces(value.position);
                let is_outside = value.distance > CLEAR || part.only_touches(cell, distance, point);
                is_outside.then_some((distance, point))
            };
            // A part whose centre is deeper than `only_touches` moves it stays inside.
            let is_inside = value.distance < -2.0 * CLEAR;
            let found = if let Some(found) = (!is_inside).then(touches).flatten() {
                found
            } else {
                let limits = (self.tolerance, reach);
                let lowest = lowest_inside(cell, &polygon, self.normal, limits, precision);
                converged &= lowest.converged;
                (cell.value(lowest.point, Precision::F64).distance, lowest.point)
            };
            if found.0 < least.0 {
                least = found;
            }
        }
        (least.0 <= self.reach).then_some(Lowest { point: least.1, converged, face: None })
    }

    /// Cuts the polygon along the plane of the face that it crosses deepest; `None` when it crosses
    /// no face.
    pub fn cut(&self) -> Option<(Polygon, Polygon)> {
        let points = &self.points();
        let mut deepest = (CLEAR, None);
        self.near(0.0, &mut |face| {
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
            // Faces that cross the polygon are within the ball.
            0.0
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
            let moved: ArrayVec<DVec3, MAX_VERTICES> =
                self.polygon.points().map(|p| p + hair * outward).collect();
            let (polygon, center) = (&Polygon::new(&moved), self.center + hair * outward);
            let moved = Query { polygon, center, reach: hair, ..*self };
            let face = cell.value(center, Precision::F32).position;
            let (clear, at, _) = moved.nearest_to_faces(face);
            clear > 0.1 * hair && cell.value(at, Precision::F64).distance > 0.0
        };
        // A normal that does not tell the outside may point either way.
        let is_either = || !self.asset.faces_look_outward() && is_free(self.normal);
        // The field of all cells keeps this value for the contact, which is there, too.
        let gradient = || cell.opposing(point, DVec3::ZERO, Precision::F64).gradient;
        distance <= hair && (is_free(gradient()) || is_free(-self.normal) || is_either())
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
