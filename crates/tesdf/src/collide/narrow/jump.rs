//! The least signed distance over a polygon where the sign changes without a face: of an open mesh,
//! in whose holes the generalised winding number passes through 1/2 (`docs/math.md`, section 14).
//!
//! Only the distance without its sign is 1-Lipschitz. The side is told by the winding number. Over
//! a part that no face passes through, the number is linear up to a known error. So a part is
//! outside, inside, or cut where it is certainly outside, and the rest is searched like a part
//! inside.
use arrayvec::ArrayVec;
use glam::DVec3;

use super::Lowest;
use super::branch_and_bound::{BoundedTriangle, Branches, Corner, branch_and_bound, triangles};
use super::exact::{CLEAR, Query};
use crate::collide::bodies::field::{CellField, ROUNDING};
use crate::collide::bodies::jump::{Side, side};
use crate::collide::bodies::polygon::{MAX_VERTICES, Parts, Polygon};
use crate::collide::scene::field_value::FieldValue;
use crate::collide::search::queue::Queue;
use crate::geometry::GeneralizedWinding;
use crate::query::{Faces, Precision};

/// Corners within this share of the tolerance are beside a cut.
const BESIDE: f64 = 0.125;

/// What is known of a part of the polygon.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Known {
    /// Nothing.
    Nothing,
    /// No face passes through it.
    Clear,
    /// It is inside.
    Inside,
}

/// A part of the polygon that is still to be searched.
struct Open {
    piece: BoundedTriangle,
    known: Known,
}

/// The least signed distance over a polygon, within `tolerance`, up to `reach`; both in the field's
/// frame.
///
/// Points inside that are within the tolerance of a point of the polygon outside may be passed
/// over: the jump is found up to the tolerance. Where the search is cut short, the lowest point
/// seen is returned, and `converged` is false.
pub(super) fn lowest(
    jump: &GeneralizedWinding,
    cell: &CellField,
    polygon: &Polygon,
    normal: DVec3,
    (tolerance, reach): (f64, f64),
    precision: Precision,
) -> Option<Lowest> {
    let (center, none) = (polygon.center(), Faces::default());
    let radius = polygon.reach(center);
    let first: FieldValue = match cell {
        CellField::Whole(around) => around.asset.found_exactly(center).into(),
        _ => cell.value(center, Precision::F32),
    };
    let query = Query::of_cell(cell, &none, polygon, normal, (tolerance, reach))?;
    let is_clear = first.distance.abs() > radius + ROUNDING;
    if is_clear {
        let points: ArrayVec<DVec3, MAX_VERTICES> = polygon.points().collect();
        match side(jump, &points, center) {
            Side::Outside if first.distance - radius > reach + ROUNDING => return None,
            Side::Outside => {
                let (distance, point, face) = query.nearest_to_faces(first.position);
                return (distance <= reach).then_some(Lowest { point, converged: true, face });
            }
            Side::Inside => return Some(branch_and_bound(cell, polygon, tolerance, reach, precision)),
            Side::Across(_) | Side::Unknown => {}
        }
    }
    let (distance, point, face) = query.nearest_to_faces(first.position);
    let mut branches = Branches::new(cell, polygon, precision, tolerance, reach);
    if distance.is_finite() {
        branches.value(point);
    }
    let search = Search { jump, query, tolerance };
    let known = if is_clear { Known::Clear } else { Known::Nothing };
    let mut open = Queue::new();
    push(polygon, known, &mut branches, &mut open);
    let converged = branches.run(&mut open, |branches, part, open| search.look(part, branches, open));
    let (least, at) = branches.best;
    // Where nothing is inside, the nearest point of the faces is the lowest.
    let face = face.filter(|_| least > CLEAR && at == point);
    least.is_finite().then_some(Lowest { point: at, converged, face })
}

struct Search<'a> {
    jump: &'a GeneralizedWinding,
    query: Query<'a>,
    tolerance: f64,
}

/// Adds the triangles of a polygon to a queue.
fn push(polygon: &Polygon, known: Known, branches: &mut Branches, open: &mut Queue<Open>) {
    if polygon.vertices().len() > 1 {
        let corners = branches.corners(polygon);
        triangles(&corners).for_each(|corners| branches.push(corners, open, |piece| Open { piece, known }));
    }
}

impl Search<'_> {
    fn look(&self, Open { piece, mut known }: Open, branches: &mut Branches, open: &mut Queue<Open>) {
        branches.evaluations += 1;
        let points = piece.corners.map(|c| c.point);
        let center = points.iter().sum::<DVec3>() / 3.0;
        let radius = points.iter().map(|p| p.distance(center)).fold(0.0, f64::max);
        let polygon = polygon_of(points);
        if known == Known::Nothing {
            if piece.center.distance.abs() <= radius + 2.0 * ROUNDING
                && let Some((above, below)) = self.query.with_polygon(&polygon).cut()
            {
                [above, below].iter().for_each(|part| push(part, Known::Nothing, branches, open));
                return;
            }
            known = Known::Clear;
        }
        let mut rest = None;
        if known == Known::Clear {
            let from = off_faces(&piece, center, branches);
            match from.map_or(Side::Unknown, |from| side(self.jump, &points, from)) {
                Side::Outside => return,
                Side::Inside => known = Known::Inside,
                Side::Across(cut) => {
                    // How deep the part is that is certainly inside.
                    if let Parts::Across(inner, _) = polygon.cut(|v| cut.inner(v.point)) {
                        branches.corners(&inner);
                    }
                    // Corners beside the cut are on it. Otherwise slivers would remain, cut after
                    // cut. Nothing but the outside is cut off: the cut lies farther out by as much.
                    let beside = BESIDE * self.tolerance * cut.gradient.length();
                    let height = |p: DVec3| match cut.outer(p) + beside {
                        h if h.abs() <= beside => 0.0,
                        h => h,
                    };
                    match polygon.cut(|v| height(v.point)) {
                        Parts::Above => {}
                        Parts::Below => return,
                        Parts::Across(kept, _) => rest = Some(kept),
                    }
                }
                Side::Unknown => {}
            }
        }
        if known != Known::Inside && radius <= self.tolerance {
            return;
        }
        // Also after a cut, so that parts get smaller.
        let mut halve = |piece: &BoundedTriangle, branches: &mut Branches| {
            for part in branches.parts(piece) {
                branches.push(part, open, |piece| Open { piece, known });
            }
        };
        match rest {
            None => halve(&piece, branches),
            Some(kept) if kept.vertices().len() > 1 => {
                let known_at = |p: DVec3| piece.corners.iter().find(|c| c.point == p).copied();
                let corners: ArrayVec<Corner, MAX_VERTICES> =
                    kept.points().map(|p| known_at(p).unwrap_or_else(|| branches.corner(p))).collect();
                for corners in triangles(&corners) {
                    let piece = branches.piece(corners);
                    if branches.is_open(piece.bound) {
                        halve(&piece, branches);
                    }
                }
            }
            Some(_) => {}
        }
    }
}

/// The point of a part, its centre or a corner, that is farthest from the faces; `None` where all
/// of them are on faces, up to rounding.
fn off_faces(piece: &BoundedTriangle, center: DVec3, branches: &Branches) -> Option<DVec3> {
    let corners = piece.corners.iter().map(|c| (c.value.distance.abs(), c.point));
    let first = (piece.center.distance.abs(), center);
    let (distance, at) = corners.fold(first, |best, next| if next.0 > best.0 { next } else { best });
    let is_off = distance > 4.0 * ROUNDING || branches.exact(at).distance.abs() > 4.0 * CLEAR;
    is_off.then_some(at)
}

/// The polygon of a triangle, which may be a segment.
fn polygon_of([a, b, c]: [DVec3; 3]) -> Polygon {
    if b == c || a == c {
        return Polygon::new(&[a, b]);
    }
    if a == b { Polygon::new(&[b, c]) } else { Polygon::new(&[a, b, c]) }
}
