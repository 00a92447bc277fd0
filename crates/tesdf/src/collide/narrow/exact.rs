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
    let (distance, point) = nearest_to_faces(asset, place, faces, polygon, normal, center, radius);
    // Clear of the surface, the polygon is all on one side of it.
    let all_outside = !crossing || (distance > 0.0 && cell.value(point, Precision::F64).distance > 0.0);
    if !all_outside {
        return Some(branch_and_bound(cell, polygon, tolerance, reach, precision));
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

/// What is found above `reach` is the least point seen, no more.
fn branch_and_bound(
    cell: &CellField,
    polygon: &Polygon,
    tolerance: f64,
    reach: f64,
    precision: Precision,
) -> Lowest {
    let best = (f64::INFINITY, polygon.center());
    let mut search = Branches { cell, precision, tolerance, reach, best, evaluations: 0 };
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
        if !search.is_open(piece.bound) {
            return Lowest { point: search.best.1, converged: true };
        }
        if search.evaluations > MOST_EVALUATIONS {
            return Lowest { point: search.best.1, converged: false };
        }
        for half in halves(piece.corners) {
            let piece = search.piece(half);
            if search.is_open(piece.bound) {
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

/// A bound of min(u, v) over a triangle, of convex functions with these values at its corners: the least over all mixtures
/// (1 − t) u + t v of their greatest value, which is at a corner.
fn least_mix(u: [f64; 3], v: [f64; 3]) -> f64 {
    let greatest = |t: f64| (0..3).map(|i| u[i] + t * (v[i] - u[i])).fold(f64::NEG_INFINITY, f64::max);
    // A convex function of t, with kinks only where two corners have the same value.
    let kink = |i: usize, j: usize| (u[j] - u[i]) / ((v[i] - u[i]) - (v[j] - u[j]));
    [1.0, kink(0, 1), kink(1, 2), kink(2, 0)]
        .into_iter()
        .filter(|t| (0.0..=1.0).contains(t))
        .map(greatest)
        .fold(greatest(0.0), f64::min)
}

struct Branches<'a> {
    cell: &'a CellField<'a>,
    precision: Precision,
    tolerance: f64,
    reach: f64,
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

    /// Whether something that matters can be above this bound.
    fn is_open(&self, bound: f64) -> bool {
        bound < self.best.0 - self.tolerance && bound <= self.reach
    }

    fn piece(&mut self, corners: [DVec3; 3]) -> Piece {
        let center = (corners[0] + corners[1] + corners[2]) / 3.0;
        let value = self.value(center);
        let radius = corners.iter().map(|c| c.distance_squared(center)).fold(0.0, f64::max).sqrt();
        let lipschitz = value.distance - radius;
        let bound = match *self.cell {
            // Nowhere is the surface farther than the face that is nearest at the centre.
            CellField::Mesh { asset, .. } => {
                let distances = |position: u32| {
                    let face: Triangle = asset.local_triangle(position as usize);
                    corners.map(|c| face.closest(c).distance)
                };
                let near = distances(value.position);
                let farthest = (0..3).max_by(|&i, &j| near[i].total_cmp(&near[j])).unwrap_or(0);
                let bound = -near[farthest];
                if self.is_open(bound.max(lipschitz)) {
                    // Between two walls the least is along a whole line; each wall alone would leave all of it open.
                    let other = self.value(corners[farthest]).position;
                    -least_mix(near, distances(other))
                } else {
                    bound
                }
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
