use std::cmp::Ordering;
use std::collections::BinaryHeap;

use glam::DVec3;

use super::Lowest;
use crate::TeSdf;
use crate::asset::layout::{Label, Side};
use crate::collide::field::{CellField, FieldValue, ROUNDING};
use crate::collide::polygon::{MOST_VERTICES, Polygon};
use crate::geometry::{Triangle, polygon_to_triangle};
use crate::query::{Faces, Place, Precision};

/// Evaluations after which a search gives up: the hardest of 10^5 polygons on real parts took a tenth.
const MOST_EVALUATIONS: usize = 20_000;

/// A polygon that comes as near to a face may go through it (local frame, of extent about 1): some ten roundings.
const TOUCHING: f64 = 1e-14;

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
        return Some(branch_and_bound(cell, polygon, tolerance, precision));
    };
    let crossing = matches!(place, Place::Listed { label: Label::Crossing(_), .. });
    let inside = match place {
        Place::Listed { label: Label::Inside, .. } | Place::Far(Side::Inside) => true,
        // Nothing of the surface is nearer to the centre than its distance.
        _ if crossing => first.distance < -radius - ROUNDING,
        _ => false,
    };
    if inside {
        return Some(branch_and_bound(cell, polygon, tolerance, precision));
    }
    let query = Query { asset, place, faces, polygon, normal, center, radius, tolerance };
    let (distance, point) = query.nearest_to_faces(first.position);
    // Clear of the surface, the polygon is all on one side of it.
    let all_outside = !crossing || (distance > TOUCHING && cell.value(point, Precision::F64).distance > 0.0);
    if !all_outside {
        return Some(branch_and_bound(cell, polygon, tolerance, precision));
    }
    (distance <= reach).then_some(Lowest { point, converged: true })
}

/// A polygon and the faces that can be nearest to its points.
struct Query<'a> {
    asset: &'a TeSdf,
    place: Place,
    faces: &'a Faces,
    polygon: &'a Polygon,
    normal: DVec3,
    center: DVec3,
    radius: f64,
    tolerance: f64,
}

impl Query<'_> {
    /// Whether all of the polygon is farther than `limit` from the plane of a face: in `f32` already, without making the face's
    /// normal.
    fn plane_is_beyond(&self, points: &[DVec3], face: u32, limit: f64) -> bool {
        let plane = self.asset.records[face as usize].triangle();
        let middle = self.asset.cube.middle() + plane.corners[0];
        let heights = points.iter().map(|&p| plane.normal.dot(p - middle));
        let (low, high) = heights.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), x| (l.min(x), h.max(x)));
        low.max(-high) > limit + ROUNDING
    }

    /// The least distance between the polygon and a face, up to the tolerance, and where on the polygon; `likely` is looked at
    /// first.
    fn nearest_to_faces(&self, likely: u32) -> (f64, DVec3) {
        let mut points = [DVec3::ZERO; MOST_VERTICES];
        points.iter_mut().zip(self.polygon.points()).for_each(|(to, p)| *to = p);
        let points = &points[..self.polygon.vertices().len()];
        let mut best = (f64::INFINITY, self.center);
        let mut offer = |face: u32| {
            // What is nearer by less than the tolerance does not count, unless the polygon may go through it.
            let limit = if best.0 > 2.0 * self.tolerance { best.0 - self.tolerance } else { best.0 };
            if !self.plane_is_beyond(points, face, limit) {
                let triangle = self.asset.local_triangle(face as usize);
                if let Some(found) = polygon_to_triangle(points, self.normal, &triangle, limit) {
                    best = found;
                }
            }
            best.0
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
}

/// A part of the polygon that is still open.
struct Piece {
    /// No point of it has a lower signed distance.
    bound: f64,
    corners: [DVec3; 3],
}

impl PartialEq for Piece {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}
impl Eq for Piece {}
impl PartialOrd for Piece {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}
impl Ord for Piece {
    fn cmp(&self, other: &Self) -> Ordering {
        // The heap gives the lowest bound first.
        other.bound.total_cmp(&self.bound)
    }
}

fn branch_and_bound(cell: &CellField, polygon: &Polygon, tolerance: f64, precision: Precision) -> Lowest {
    let mut search = Branches { cell, precision, best: (f64::INFINITY, polygon.center()), evaluations: 0 };
    polygon.points().for_each(|p| {
        search.value(p);
    });
    let mut open = BinaryHeap::new();
    let v = polygon.vertices();
    for k in 2..v.len().max(3) {
        // A segment is a triangle with two equal corners.
        let corners = [v[0].point, v[k - 1].point, v[k.min(v.len() - 1)].point];
        open.push(search.piece(corners));
    }
    while let Some(piece) = open.pop() {
        if piece.bound >= search.best.0 - tolerance {
            return Lowest { point: search.best.1, converged: true };
        }
        if search.evaluations > MOST_EVALUATIONS {
            return Lowest { point: search.best.1, converged: false };
        }
        for half in halves(piece.corners) {
            let piece = search.piece(half);
            if piece.bound < search.best.0 - tolerance {
                open.push(piece);
            }
        }
    }
    Lowest { point: search.best.1, converged: true }
}

/// Cuts the longest edge.
fn halves([a, b, c]: [DVec3; 3]) -> [[DVec3; 3]; 2] {
    let edge = |p: DVec3, q: DVec3| p.distance_squared(q);
    let (ab, bc, ca) = (edge(a, b), edge(b, c), edge(c, a));
    let [a, b, c] = if ab >= bc && ab >= ca {
        [a, b, c]
    } else if bc >= ca {
        [b, c, a]
    } else {
        [c, a, b]
    };
    let m = 0.5 * (a + b);
    [[a, m, c], [m, b, c]]
}

struct Branches<'a> {
    cell: &'a CellField<'a>,
    precision: Precision,
    best: (f64, DVec3),
    evaluations: usize,
}

impl Branches<'_> {
    fn value(&mut self, p: DVec3) -> FieldValue {
        self.evaluations += 1;
        let value = self.cell.value(p, self.precision);
        if value.distance < self.best.0 {
            self.best = (value.distance, p);
        }
        value
    }

    fn piece(&mut self, corners: [DVec3; 3]) -> Piece {
        let center = (corners[0] + corners[1] + corners[2]) / 3.0;
        let value = self.value(center);
        let radius = corners.iter().map(|c| c.distance_squared(center)).fold(0.0, f64::max).sqrt();
        let lipschitz = value.distance - radius;
        let bound = match *self.cell {
            // Nowhere is the surface farther than the face that is nearest at the centre.
            CellField::Mesh { asset, .. } => {
                let face: Triangle = asset.local_triangle(value.position as usize);
                -corners.iter().map(|&c| face.closest(c).distance).fold(0.0, f64::max)
            }
            // A convex function is above its tangent.
            CellField::Simple(_) => {
                let down = |c: &DVec3| value.gradient.dot(*c - center);
                value.distance + corners.iter().map(down).fold(f64::INFINITY, f64::min)
            }
        };
        Piece { bound: lipschitz.max(bound), corners }
    }
}
