//! The least signed distance over a polygon inside the solid: the depth is a minimum of convex
//! functions, and its maximum is sought.
use std::ops::ControlFlow;

use arrayvec::ArrayVec;
use glam::DVec3;

use super::Lowest;
use crate::TeSdf;
use crate::base::elementary;
use crate::collide::bodies::field::{CellField, ROUNDING};
use crate::collide::bodies::polygon::{MAX_VERTICES, Polygon};
use crate::collide::scene::field_value::FieldValue;
use crate::collide::search::depth_bounds::{Bound, DepthBounds, Kind};
use crate::collide::search::greatest_minimum::value;
use crate::collide::search::longest_edge::longest_edge;
use crate::collide::search::queue::Queue;
use crate::geometry::Triangle;
use crate::query::{Precision, Surroundings};

/// Number of evaluations after which a search gives up. The kernel `narrow_exact` counts rounds
/// instead (`ROUNDS`), because its threads evaluate pieces together.
pub const MAX_EVALUATIONS: usize = 20_000;

/// A corner of a part of the polygon.
#[derive(Clone, Copy, Debug)]
pub struct Corner {
    pub point: DVec3,
    pub value: FieldValue,
}

/// A part of the polygon that is still to be searched.
pub struct BoundedTriangle {
    /// Lower bound of the signed distances on it.
    pub bound: f64,
    pub corners: [Corner; 3],
    /// The value at the centre.
    pub center: FieldValue,
    /// The edge at which it is halved, by the corner at which that starts.
    edge: usize,
}

/// The point with the least signed distance, within `tolerance`, if that distance is at most
/// `reach`. Otherwise the result is only the lowest point seen.
pub fn branch_and_bound(
    cell: &CellField,
    polygon: &Polygon,
    tolerance: f64,
    reach: f64,
    precision: Precision,
) -> Lowest {
    let mut search = Branches::new(cell, polygon, precision, tolerance, reach);
    let corners = search.corners(polygon);
    let mut open = Queue::new();
    triangles(&corners).for_each(|corners| search.push(corners, &mut open, |piece| piece));
    let converged = search.run(&mut open, |search, piece, open| {
        for part in search.parts(&piece) {
            search.push(part, open, |piece| piece);
        }
    });
    Lowest { point: search.best.1, converged, face: None }
}

/// Whether `best`, the signed distance at a point of the polygon and its nearest face, is the least
/// one up to `tolerance`, as far as bounds show without a search.
pub fn is_least(cell: &CellField, polygon: &Polygon, best: (f64, DVec3, u32), tolerance: f64) -> bool {
    let mut search = Branches::new(cell, polygon, Precision::F64, tolerance, f64::INFINITY);
    let (least, point, face) = best;
    search.slack = f64::INFINITY;
    (search.best, search.best_face) = ((least, point), face);
    search.enough = least - tolerance;
    let corners = search.corners(polygon);
    triangles(&corners)
        .all(|corners| search.best.0 >= search.enough && search.piece(corners).bound >= least - tolerance)
}

/// The search over triangles.
pub struct Branches<'a> {
    cell: &'a CellField<'a>,
    precision: Precision,
    /// Error bound of the `f32` values that are tried before `f64`. Where it is infinite, all
    /// values are in `f64`.
    slack: f64,
    tolerance: f64,
    reach: f64,
    /// The search ends at a distance below this.
    enough: f64,
    /// The lowest signed distance so far, and its point.
    pub best: (f64, DVec3),
    /// The face nearest to the best point.
    best_face: u32,
    /// Number of values so far.
    pub evaluations: usize,
    /// Whether only the distance without its sign is 1-Lipschitz.
    jumps: bool,
}

impl<'a> Branches<'a> {
    /// A search that has seen nothing.
    pub fn new(
        cell: &'a CellField<'a>,
        polygon: &Polygon,
        precision: Precision,
        tolerance: f64,
        reach: f64,
    ) -> Self {
        let best = (f64::INFINITY, polygon.center());
        let (slack, enough) = (ROUNDING, f64::NEG_INFINITY);
        let jumps = cell.jump().is_some();
        Self { cell, precision, slack, tolerance, reach, enough, best, best_face: 0, evaluations: 0, jumps }
    }

    /// The value at a point. Where `f32` shows that it is not the best, the distance is only a
    /// lower bound.
    pub fn value(&mut self, p: DVec3) -> FieldValue {
        self.evaluations += 1;
        if self.precision == Precision::F64 && self.slack.is_finite() {
            let rough = self.cell.value(p, Precision::F32);
            let distance = rough.distance - self.slack;
            if distance >= self.best.0 {
                return FieldValue { distance, ..rough };
            }
        }
        let value = self.cell.value(p, self.precision);
        if value.distance < self.best.0 {
            self.best = (value.distance, p);
            self.best_face = value.position;
        }
        value
    }

    /// The value at a point in `f64`, which is no candidate.
    pub fn exact(&self, p: DVec3) -> FieldValue {
        self.cell.value(p, Precision::F64)
    }

    /// A corner with its value.
    pub fn corner(&mut self, point: DVec3) -> Corner {
        Corner { point, value: self.value(point) }
    }

    /// The corners of a polygon, with their values.
    pub fn corners(&mut self, polygon: &Polygon) -> ArrayVec<Corner, MAX_VERTICES> {
        polygon.points().map(|p| self.corner(p)).collect()
    }

    /// Whether a part with this bound can still improve the result.
    pub fn is_open(&self, bound: f64) -> bool {
        bound < self.best.0 - self.tolerance && bound <= self.reach && self.best.0 >= self.enough
    }

    /// Adds a triangle to a queue, as the item of its piece, if it can still improve the result.
    pub fn push<T>(
        &mut self,
        corners: [Corner; 3],
        open: &mut Queue<T>,
        item: impl Fn(BoundedTriangle) -> T,
    ) {
        let piece = self.piece(corners);
        if self.is_open(piece.bound) {
            open.push(piece.bound, item(piece));
        }
    }

    /// Searches all parts that can improve the result; `expand` replaces a part by smaller ones.
    /// Returns whether the search was not cut short.
    pub fn run<T>(
        &mut self,
        open: &mut Queue<T>,
        mut expand: impl FnMut(&mut Self, T, &mut Queue<T>),
    ) -> bool {
        let converged = open.search(|open, bound, part| {
            if !self.is_open(bound) {
                return ControlFlow::Break(true);
            }
            if self.evaluations > MAX_EVALUATIONS {
                return ControlFlow::Break(false);
            }
            expand(self, part, open);
            ControlFlow::Continue(())
        });
        converged.unwrap_or(true)
    }

    /// Divides a triangle, along a side of the face nearest to its centre where that helps.
    pub fn parts(&mut self, piece: &BoundedTriangle) -> ArrayVec<[Corner; 3], 3> {
        self.along_side(piece).unwrap_or_else(|| self.halves(piece).into_iter().collect())
    }

    /// Cuts a triangle near the surface where it leaves the space over the nearest face. The
    /// distance to the face is linear over it, and beside it bounds the depth badly: halves that
    /// reach across would be as short as the depth before they are closed.
    fn along_side(&mut self, piece: &BoundedTriangle) -> Option<ArrayVec<[Corner; 3], 3>> {
        let (CellField::Mesh { asset, .. } | CellField::Whole(&Surroundings { asset, .. })) = *self.cell
        else {
            return None;
        };
        let points = piece.corners.map(|c| c.point);
        let longest = (0..3).map(|i| points[i].distance_squared(points[(i + 1) % 3])).fold(0.0, f64::max);
        if elementary::powi(SHALLOW * piece.center.distance, 2) > longest {
            return None;
        }
        let face = asset.local_triangle(piece.center.position as usize);
        let mut deepest = (0.1 * self.tolerance, [0.0; 3]);
        for k in 0..3 {
            let side = face.corners[(k + 1) % 3] - face.corners[k];
            let Some(inward) = face.normal.cross(side).try_normalize() else { continue };
            let heights = points.map(|p| inward.dot(p - face.corners[k]));
            let (low, high) =
                heights.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), x| (l.min(*x), h.max(*x)));
            if high.min(-low) > deepest.0 {
                deepest = (high.min(-low), heights);
            }
        }
        let heights = deepest.1;
        // The corner that is alone on its side.
        let alone = (0..3).find(|&i| {
            let (j, k) = ((i + 1) % 3, (i + 2) % 3);
            (heights[i] < 0.0) != (heights[j] < 0.0) && (heights[i] < 0.0) != (heights[k] < 0.0)
        })?;
        let [(a, x), (b, y), (c, z)] =
            [0, 1, 2].map(|i| (piece.corners[(alone + i) % 3], heights[(alone + i) % 3]));
        let ab = self.corner(a.point.lerp(b.point, x / (x - y)));
        let ac = self.corner(a.point.lerp(c.point, x / (x - z)));
        Some([[a, ab, ac], [ab, b, c], [ab, c, ac]].into_iter().collect())
    }

    /// Halves an edge.
    fn halves(&mut self, piece: &BoundedTriangle) -> [[Corner; 3]; 2] {
        let mut corners = piece.corners;
        corners.rotate_left(piece.edge);
        let [a, b, c] = corners;
        let m = self.corner(0.5 * (a.point + b.point));
        [[a, m, c], [m, b, c]]
    }

    /// A triangle, with its bound.
    pub fn piece(&mut self, corners: [Corner; 3]) -> BoundedTriangle {
        let points = corners.map(|c| c.point);
        let center = (points[0] + points[1] + points[2]) / 3.0;
        let value = self.value(center);
        let radius = points.iter().map(|c| c.distance_squared(center)).fold(0.0, f64::max).sqrt();
        let mut bound = match self.jumps {
            // The value may be lower than the distance by twice the slack.
            true => -(value.distance.abs() + 2.0 * ROUNDING) - radius,
            false => value.distance - radius,
        };
        let mut edge = None;
        match *self.cell {
            CellField::Mesh { asset, .. } | CellField::Whole(&Surroundings { asset, .. }) => {
                let triangle = |face: u32| asset.local_triangle(face as usize);
                let distances = |t: &Triangle| points.map(|p| t.closest(p).distance);
                // The distance to one face is convex, so over a triangle it is at most its greatest
                // value at a corner.
                let near = distances(&triangle(value.position));
                bound = bound.max(-near.into_iter().fold(0.0, f64::max));
                if self.is_open(bound) {
                    for face in corners.map(|c| c.value.position) {
                        bound = bound.max(-coplanar_pair(asset, [value.position, face], points));
                    }
                }
                if self.is_open(bound) {
                    let chord = |face, at| Bound { face, kind: Kind::Chord, at };
                    let mut bounds = DepthBounds::NONE;
                    bounds.add(chord(value.position, near));
                    for face in corners.map(|c| c.value.position).into_iter().chain([self.best_face]) {
                        if !bounds.holds(face) {
                            bounds.add(chord(face, distances(&triangle(face))));
                        }
                    }
                    let chord = |face| chord(face, distances(&triangle(face)));
                    bound = bound.max(self.bound_by_faces(&mut bounds, points, chord));
                    // Where the sign jumps, the side of a part is to be told, too: the shorter it is in
                    // every direction, the sooner.
                    if self.is_open(bound) && !self.jumps {
                        edge = curved_edge(asset, &bounds, points, self.tolerance);
                    }
                }
            }
            // Their lowest points have a closed form.
            CellField::Simple(_) => {}
        }
        BoundedTriangle { bound, corners, center: value, edge: edge.unwrap_or_else(|| longest_edge(points)) }
    }

    /// Bounds the depth over a triangle by one face after the other: each is the nearest one to the
    /// place where the faces so far leave the greatest depth. Returns a lower bound of the signed
    /// distance.
    fn bound_by_faces(
        &mut self,
        bounds: &mut DepthBounds,
        points: [DVec3; 3],
        chord: impl Fn(u32) -> Bound,
    ) -> f64 {
        let mut bound = -bounds.greatest;
        for _ in 0..MAX_ADDED {
            if !self.is_open(bound) {
                break;
            }
            // Where the faces that matter are among these, this is the deepest point.
            let [u, v, w] = bounds.at;
            let found = self.value(u * points[0] + v * points[1] + w * points[2]);
            if !self.is_open(bound) || bounds.holds(found.position) {
                break;
            }
            bounds.add(chord(found.position));
            bound = bound.max(-bounds.greatest);
        }
        bound
    }
}

/// The triangles of a polygon. A segment is a triangle with two equal corners.
pub fn triangles(corners: &[Corner]) -> impl Iterator<Item = [Corner; 3]> {
    let last = corners.len() - 1;
    (2..corners.len().max(3)).map(move |k| [corners[0], corners[k - 1], corners[k.min(last)]])
}

/// A triangle whose longest edge is shorter than this multiple of its depth is halved.
const SHALLOW: f64 = 4.0;

/// A distance that bends by less than this share of the tolerance along an edge is as good as
/// linear.
const BENT: f64 = 0.25;

/// Number of times that a face is added before a triangle is halved.
const MAX_ADDED: usize = 16;

/// The edge of a triangle along which the distance to a face that bounds the depth where it can be
/// greatest bends most: there the bound, which is linear between the corners, lies highest above
/// it. `None` where it bends nowhere by much.
///
/// The deepest points of parallel prisms are a whole line. Halves of the longest edge would be as
/// short along this line as they have to be across it.
fn curved_edge(asset: &TeSdf, bounds: &DepthBounds, points: [DVec3; 3], tolerance: f64) -> Option<usize> {
    let mut most = (BENT * tolerance, None);
    for bound in bounds.iter().filter(|b| value(&b.at, bounds.at) <= bounds.greatest + tolerance) {
        let triangle = asset.local_triangle(bound.face as usize);
        for k in 0..3 {
            let l = (k + 1) % 3;
            let middle = triangle.closest(0.5 * (points[k] + points[l])).distance;
            let bend = 0.5 * (bound.at[k] + bound.at[l]) - middle;
            if bend > most.0 {
                most = (bend, Some(k));
            }
        }
    }
    most.1
}

/// Upper bound, over a triangle, of the distance to two coplanar faces that share an edge; infinite
/// when the faces are not such a pair.
///
/// Suppose that the nearest points of the corners are in the union of the faces, and that segments
/// between nearest points in different faces pass through the shared edge. Then the triangle of the
/// nearest points lies in the union. Every point is as near to its image as some corner, or nearer.
fn coplanar_pair(asset: &TeSdf, [f, g]: [u32; 2], points: [DVec3; 3]) -> f64 {
    if f == g {
        return f64::INFINITY;
    }
    let ids = [f, g].map(|face| asset.faces[face as usize]);
    let Some(apex) = ids[0].iter().position(|v| !ids[1].contains(v)) else { return f64::INFINITY };
    let (start, end) = (ids[0][(apex + 1) % 3], ids[0][(apex + 2) % 3]);
    if !(ids[1].contains(&start) && ids[1].contains(&end)) {
        return f64::INFINITY;
    }
    let triangles = [f, g].map(|face| asset.local_triangle(face as usize));
    let (a, b) = (triangles[0].corners[(apex + 1) % 3], triangles[0].corners[(apex + 2) % 3]);
    let normal = triangles[0].normal;
    let off = triangles[1].corners.iter().map(|c| normal.dot(*c - a).abs()).fold(0.0, f64::max);
    // In-plane direction perpendicular to the shared edge.
    let across = normal.cross(b - a).normalize_or_zero();
    let cosine = normal.dot(triangles[1].normal);
    // Faces that do not all look outward may lie beside each other and look in opposite directions.
    let is_beside = || {
        let [one, other] = triangles.each_ref().map(|t| {
            t.corners
                .iter()
                .map(|c| across.dot(*c - a))
                .fold(0.0, |m: f64, h| if h.abs() > m.abs() { h } else { m })
        });
        cosine <= -0.5 && !asset.faces_look_outward() && one * other < 0.0
    };
    if off > COPLANAR || !(cosine >= 0.5 || is_beside()) || across == DVec3::ZERO {
        return f64::INFINITY;
    }
    let nearest = points.map(|p| {
        let [x, y] = [0, 1].map(|k| triangles[k].closest(p));
        if x.distance <= y.distance { (x, true) } else { (y, false) }
    });
    let along = (b - a) / (b - a).length_squared();
    for i in 0..3 {
        let ((p, p_first), (q, q_first)) = (nearest[i], nearest[(i + 1) % 3]);
        if p_first == q_first {
            continue;
        }
        let (h, k) = (across.dot(p.point - a), across.dot(q.point - a));
        let crossing = if h == k { p.point } else { p.point + h / (h - k) * (q.point - p.point) };
        if !(0.0..=1.0).contains(&along.dot(crossing - a)) {
            return f64::INFINITY;
        }
    }
    nearest.iter().map(|n| n.0.distance).fold(0.0, f64::max) + off
}

/// Faces within this distance of one plane (local frame) count as coplanar. Their deviation is
/// added to the bound.
const COPLANAR: f64 = 1e-12;
