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
    let (distance, point) = nearest_to_faces(asset, place, faces, polygon, normal, center, radius);
    // Clear of the surface, the polygon is all on one side of it.
    let all_outside = !crossing || (distance > CLEAR && cell.value(point, Precision::F64).distance > 0.0);
    if !all_outside {
        return Some(branch_and_bound(cell, polygon, tolerance, precision));
    }
    (distance <= reach).then_some(Lowest { point, converged: true })
}

/// The least distance between the polygon and the faces that can be nearest to a point of it.
fn nearest_to_faces(
    asset: &TeSdf,
    place: Place,
    faces: &Faces,
    polygon: &Polygon,
    normal: DVec3,
    center: DVec3,
    radius: f64,
) -> (f64, DVec3) {
    let mut points = [DVec3::ZERO; MOST_VERTICES];
    let count = polygon.vertices().len();
    points.iter_mut().zip(polygon.points()).for_each(|(to, p)| *to = p);
    let points = &points[..count];
    let mut best = (f64::INFINITY, center);
    let mut offer = |face: u32| {
        let triangle = asset.local_triangle(face as usize);
        if triangle.closest(center).distance - radius <= best.0 {
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

/// What lies beyond the border of a face by less than this (local frame) does so by rounding.
const BEYOND: f64 = 1e-13;

/// A part of the polygon that is still open.
struct Piece {
    /// No point of it has a lower signed distance.
    bound: f64,
    corners: [DVec3; 3],
    /// The face that is nearest at its centre, by position.
    nearest: u32,
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
    fan(polygon).for_each(|corners| open.push(search.piece(corners)));
    while let Some(piece) = open.pop() {
        if piece.bound >= search.best.0 - tolerance {
            return Lowest { point: search.best.1, converged: true };
        }
        if search.evaluations > MOST_EVALUATIONS {
            return Lowest { point: search.best.1, converged: false };
        }
        let mut go_on = |part: [DVec3; 3], search: &mut Branches| {
            let piece = search.piece(part);
            if piece.bound < search.best.0 - tolerance {
                open.push(piece);
            }
        };
        if let Some((at, inward)) = search.border(&piece, search.best.0 - tolerance) {
            let (over, beyond) = Polygon::new(&piece.corners).cut(|v| inward.dot(v.point - at));
            [over, beyond].iter().flat_map(fan).for_each(|part| go_on(part, &mut search));
        } else {
            halves(piece.corners).into_iter().for_each(|part| go_on(part, &mut search));
        }
    }
    Lowest { point: search.best.1, converged: true }
}

/// The triangles of a polygon; a segment is a triangle with two equal corners.
fn fan(polygon: &Polygon) -> impl Iterator<Item = [DVec3; 3]> {
    let v = polygon.vertices();
    let last = if v.is_empty() { 2 } else { v.len().max(3) };
    (2..last).map(move |k| [0, k - 1, k].map(|i| v[i.min(v.len() - 1)].point))
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
        Piece { bound: lipschitz.max(bound), corners, nearest: value.position }
    }

    /// Where the face that is nearest at a piece's centre ends within the piece: a point of that border, and the way from there over
    /// the face; only if the part over the face is settled then, its bound being `enough`.
    ///
    /// Halving alone needs pieces of the size of the tolerance along the border of two faces of one plane: a box on a floor of a
    /// hundred triangles ran into the limit.
    fn border(&self, piece: &Piece, enough: f64) -> Option<(DVec3, DVec3)> {
        let CellField::Mesh { asset, .. } = *self.cell else { return None };
        let Triangle { corners, normal, .. } = asset.local_triangle(piece.nearest as usize);
        let height = |p: &DVec3| normal.dot(*p - corners[0]).abs();
        if -piece.corners.iter().map(height).fold(0.0, f64::max) < enough {
            return None;
        }
        let center = piece.corners.iter().sum::<DVec3>() / 3.0;
        (0..3)
            .map(|k| {
                let at = corners[k];
                let inward = normal.cross(corners[(k + 1) % 3] - at).normalize_or_zero();
                let outermost =
                    piece.corners.iter().map(|p| inward.dot(*p - at)).fold(f64::INFINITY, f64::min);
                (outermost, at, inward)
            })
            .filter(|(outermost, at, inward)| *outermost < -BEYOND && inward.dot(center - *at) > 0.0)
            .min_by(|x, y| x.0.total_cmp(&y.0))
            .map(|(_, at, inward)| (at, inward))
    }
}
