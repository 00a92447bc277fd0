//! The least signed distance over an edge.
//!
//! Outside the solid it is the least distance between the edge and a face, in closed form. An edge
//! that passes through the surface is divided there, and only its parts inside are searched.
//! Inside, the depth is the minimum of the distances to the faces, each a convex function of the
//! place on the edge. Over a part of the edge, such a function lies below the line through its
//! values at the ends. The greatest minimum of these lines bounds the depth. The search evaluates
//! the field where this bound is attained. Either a face is nearest there that has no line yet, or
//! the bound is the depth up to the curvature of the distances.
use arrayvec::ArrayVec;
use glam::DVec3;

use super::Lowest;
use super::exact::{CLEAR, Query};
use crate::TeSdf;
use crate::collide::field::{CellField, ROUNDING};
use crate::collide::field_value::FieldValue;
use crate::collide::polygon::Polygon;
use crate::collide::queue::Queue;
use crate::query::{Faces, Precision, Surroundings};

/// Number of evaluations after which a search gives up.
const MAX_EVALUATIONS: usize = 20_000;

/// Number of lines that bound the depth over a part at a time. Two are equal at its deepest point;
/// more may be.
const LINES: usize = 6;

/// Number of times that a line is added before a part is divided.
const MAX_ADDED: usize = 16;

/// A part that keeps to one region of the nearest face is divided at least this share of its length
/// from its ends.
const INNER: f64 = 1.0 / 8.0;

/// A point whose value is below this is certainly inside: a value may be a lower bound.
const INSIDE: f64 = -3.0 * ROUNDING;

/// The lowest point of an edge in the whole field of a mesh, within `tolerance`. Lengths are in the
/// field's frame. `None` when its signed distance is above `reach`.
pub fn lowest(
    around: &Surroundings,
    ends: [DVec3; 2],
    tolerance: f64,
    reach: f64,
    precision: Precision,
) -> Option<Lowest> {
    let polygon = Polygon::new(&ends);
    let center = polygon.center();
    let radius = polygon.reach(center);
    // Distances from lists that are not exact rule out nothing.
    let first: FieldValue = around.asset.found_exactly(center).into();
    if first.distance - radius > reach + ROUNDING {
        return None;
    }
    let none = Faces::default();
    let query = Query::of_segment(around, &none, &polygon, tolerance, reach);
    let clear = radius + ROUNDING;
    if first.distance > clear {
        return of_outside(query.nearest_to_faces(first.position), reach);
    }
    let cell = CellField::Whole(around);
    let mut search = Search::new(around.asset, &cell, ends, tolerance, reach, precision);
    // The surface is farther from the middle and an end than the way between them.
    let keeps_inside = |end: &Stop| first.distance + end.distance < -(radius + 2.0 * ROUNDING);
    if first.distance < -clear || search.ends.iter().all(keeps_inside) {
        return Some(search.inside(&[], first.position));
    }
    if search.ends.iter().all(|end| end.distance >= INSIDE) && first.distance >= INSIDE {
        let nearest = query.nearest_to_faces(first.position);
        let (distance, point, _) = nearest;
        if distance > CLEAR {
            // An edge that keeps clear of the surface is on one side of it.
            let is_inside = match first.distance {
                d if d.abs() > ROUNDING => d < 0.0,
                _ => cell.value(point, Precision::F64).distance < 0.0,
            };
            return if is_inside {
                Some(search.inside(&[], first.position))
            } else {
                of_outside(nearest, reach)
            };
        }
        if distance < search.best.0 {
            search.best = (distance, point);
        }
    }
    Some(search.inside(&query.crossings(), first.position))
}

/// The lowest point of an edge outside, where its nearest point is known.
fn of_outside((distance, point, face): (f64, DVec3, Option<u32>), reach: f64) -> Option<Lowest> {
    (distance <= reach).then_some(Lowest { point, converged: true, face })
}

/// A place on the edge.
#[derive(Clone, Copy, Debug)]
struct Stop {
    /// 0 at the start of the edge, 1 at its end.
    t: f64,
    /// The signed distance there, or a lower bound.
    distance: f64,
    /// The nearest face.
    face: u32,
}

/// Upper bound of the distance to a face over a part of the edge.
#[derive(Clone, Copy, Debug)]
struct Line {
    face: u32,
    /// The distances at the ends of the part.
    depths: [f64; 2],
}

impl Line {
    fn at(&self, s: f64) -> f64 {
        (1.0 - s) * self.depths[0] + s * self.depths[1]
    }
}

/// A part of the edge that is still to be searched.
struct Piece {
    /// Lower bound of the signed distances on it.
    bound: f64,
    stops: [Stop; 2],
    lines: ArrayVec<Line, LINES>,
}

impl Piece {
    /// The place at a share of the part.
    fn t(&self, share: f64) -> f64 {
        let [start, end] = self.stops.map(|stop| stop.t);
        start + share * (end - start)
    }

    fn holds(&self, face: u32) -> bool {
        self.lines.iter().any(|line| line.face == face)
    }

    /// Adds a line. If there are too many, it takes the place of the one that is highest at a share
    /// of the part.
    fn add(&mut self, line: Line, share: f64) {
        if !self.lines.is_full() {
            return self.lines.push(line);
        }
        let height = |k: &usize| self.lines[*k].at(share);
        let highest = (0..LINES).max_by(|k, l| height(k).total_cmp(&height(l)));
        highest.into_iter().for_each(|k| self.lines[k] = line);
    }
}

struct Search<'a> {
    asset: &'a TeSdf,
    cell: &'a CellField<'a>,
    points: [DVec3; 2],
    length: f64,
    tolerance: f64,
    reach: f64,
    precision: Precision,
    best: (f64, DVec3),
    evaluations: usize,
    ends: [Stop; 2],
    /// The parts that are still to be searched, by their bounds.
    open: Queue<Piece>,
}

impl<'a> Search<'a> {
    fn new(
        asset: &'a TeSdf,
        cell: &'a CellField<'a>,
        points: [DVec3; 2],
        tolerance: f64,
        reach: f64,
        precision: Precision,
    ) -> Self {
        let (length, best) = (points[0].distance(points[1]), (f64::INFINITY, points[0]));
        let ends = [0.0, 1.0].map(|t| Stop { t, distance: f64::NEG_INFINITY, face: 0 });
        let (evaluations, open) = (0, Queue::new());
        let mut search =
            Self { asset, cell, points, length, tolerance, reach, precision, best, evaluations, ends, open };
        search.ends = [0.0, 1.0].map(|t| search.stop(t));
        search
    }

    fn at(&self, t: f64) -> DVec3 {
        let [start, end] = self.points;
        if t == 1.0 { end } else { start + t * (end - start) }
    }

    /// The value at a place. Where `f32` shows that it is not the best, the distance is only a
    /// lower bound.
    fn stop(&mut self, t: f64) -> Stop {
        self.evaluations += 1;
        let p = self.at(t);
        if self.precision == Precision::F64 && self.best.0.is_finite() {
            let rough = self.cell.value(p, Precision::F32);
            let distance = rough.distance - ROUNDING;
            if distance >= self.best.0 {
                return Stop { t, distance, face: rough.position };
            }
        }
        let value = self.cell.value(p, self.precision);
        if value.distance < self.best.0 {
            self.best = (value.distance, p);
        }
        Stop { t, distance: value.distance, face: value.position }
    }

    fn depth(&self, face: u32, t: f64) -> f64 {
        self.asset.local_triangle(face as usize).closest(self.at(t)).distance
    }

    fn line(&self, face: u32, stops: &[Stop; 2]) -> Line {
        Line { face, depths: stops.map(|stop| self.depth(face, stop.t)) }
    }

    /// Whether a part with this bound can still improve the result.
    fn is_open(&self, bound: f64) -> bool {
        bound < self.best.0 - self.tolerance && bound <= self.reach
    }

    /// Searches the parts inside. `crossings` are the places where the edge passes through the
    /// surface, in order, with the face there; `likely` is a face that may be nearest.
    fn inside(mut self, crossings: &[(f64, u32)], likely: u32) -> Lowest {
        let mut start = self.ends[0];
        let through = crossings.iter().map(|&(t, face)| Stop { t, distance: -CLEAR, face });
        for end in through.chain([self.ends[1]]) {
            if (end.t - start.t) * self.length > CLEAR {
                self.first([start, end], likely);
                start = end;
            }
        }
        while let Some(piece) = self.open.pop() {
            if !self.is_open(piece.bound) {
                break;
            }
            if self.evaluations > MAX_EVALUATIONS {
                return Lowest { point: self.best.1, converged: false, face: None };
            }
            self.look(piece);
        }
        Lowest { point: self.best.1, converged: true, face: None }
    }

    /// Takes up a part between crossings, if it is inside.
    fn first(&mut self, stops: [Stop; 2], likely: u32) {
        let mut faces: ArrayVec<u32, 3> = stops.iter().map(|stop| stop.face).collect();
        faces.push(likely);
        if stops.iter().all(|stop| stop.distance >= INSIDE) {
            let Some(face) = self.face_inside(&stops) else { return };
            faces[2] = face;
        }
        let mut piece = Piece { bound: self.lipschitz(&stops), stops, lines: ArrayVec::new() };
        for face in faces {
            if !piece.holds(face) {
                piece.lines.push(self.line(face, &stops));
            }
        }
        if self.is_open(piece.bound) {
            self.open.push(piece.bound, piece);
        }
    }

    /// The face nearest to the middle of a part between crossings; `None` when the part is outside.
    fn face_inside(&mut self, stops: &[Stop; 2]) -> Option<u32> {
        let t = |share: f64| stops[0].t + share * (stops[1].t - stops[0].t);
        for share in [0.5, 0.25, 0.75] {
            match self.stop(t(share)) {
                Stop { distance, .. } if distance > ROUNDING => return None,
                Stop { distance, face, .. } if distance < INSIDE => return Some(face),
                _ => {}
            }
        }
        let value = self.cell.value(self.at(t(0.5)), Precision::F64);
        (value.distance <= CLEAR).then_some(value.position)
    }

    /// Lower bound of the signed distances between two places: the field is 1-Lipschitz.
    fn lipschitz(&self, [start, end]: &[Stop; 2]) -> f64 {
        0.5 * (start.distance + end.distance - (end.t - start.t) * self.length)
    }

    /// Searches a part, and divides it where its bound is not good enough.
    fn look(&mut self, mut piece: Piece) {
        for _ in 0..MAX_ADDED {
            let (depth, share) = summit(&piece.lines);
            piece.bound = piece.bound.max(-depth);
            if !self.is_open(piece.bound) {
                return;
            }
            // Where the faces that matter have lines, this is the deepest point.
            let stop = self.stop(piece.t(share));
            if !self.is_open(piece.bound) {
                return;
            }
            if piece.holds(stop.face) {
                return self.divide(&piece, stop, share);
            }
            piece.add(self.line(stop.face, &piece.stops), share);
        }
        let stop = self.stop(piece.t(0.5));
        self.divide(&piece, stop, 0.5);
    }

    /// Divides a part where it enters and leaves the space over the face that is nearest at `stop`,
    /// as the distance to the face is linear there; otherwise at `stop`.
    fn divide(&mut self, piece: &Piece, stop: Stop, share: f64) {
        let mut stops: ArrayVec<Stop, 4> = [piece.stops[0]].into_iter().collect();
        let kinks = self.kinks(piece, stop.face);
        match kinks.is_empty() {
            true if (INNER..=1.0 - INNER).contains(&share) => stops.push(stop),
            true => stops.push(self.stop(piece.t(share.clamp(INNER, 1.0 - INNER)))),
            false => kinks.into_iter().for_each(|t| stops.push(self.stop(t))),
        }
        stops.push(piece.stops[1]);
        let mut parts: ArrayVec<Piece, 3> = ArrayVec::new();
        for pair in stops.windows(2) {
            let stops = [pair[0], pair[1]];
            parts.push(Piece {
                bound: piece.bound.max(self.lipschitz(&stops)),
                stops,
                lines: ArrayVec::new(),
            });
        }
        let faces: ArrayVec<u32, LINES> = piece.lines.iter().map(|line| line.face).collect();
        for part in &mut parts {
            if !self.is_open(part.bound) {
                continue;
            }
            for face in part.stops.map(|stop| stop.face).into_iter().chain(faces.iter().copied()) {
                if !part.holds(face) && !part.lines.is_full() {
                    part.lines.push(self.line(face, &part.stops));
                }
            }
            part.bound = part.bound.max(-summit(&part.lines).0);
        }
        for part in parts {
            if self.is_open(part.bound) {
                self.open.push(part.bound, part);
            }
        }
    }

    /// The places within a part where it enters and leaves the space over a face.
    fn kinks(&self, piece: &Piece, face: u32) -> ArrayVec<f64, 2> {
        let face = self.asset.local_triangle(face as usize);
        let ends = piece.stops.map(|stop| self.at(stop.t));
        let (mut enters, mut leaves) = (0.0f64, 1.0f64);
        for k in 0..3 {
            let corner = face.corners[k];
            let inward = face.normal.cross(face.corners[(k + 1) % 3] - corner);
            let [start, end] = ends.map(|p| inward.dot(p - corner));
            match (start < 0.0, end < 0.0) {
                (true, false) => enters = enters.max(start / (start - end)),
                (false, true) => leaves = leaves.min(start / (start - end)),
                (true, true) => return ArrayVec::new(),
                (false, false) => {}
            }
        }
        let inner = self.tolerance / ends[0].distance(ends[1]);
        let is_within = |share: &f64| *share > inner && *share < 1.0 - inner;
        let kinks = [enters, leaves].into_iter().filter(is_within).map(|share| piece.t(share));
        if enters < leaves { kinks.collect() } else { ArrayVec::new() }
    }
}

/// The greatest minimum of lines, and where it is attained.
fn summit(lines: &[Line]) -> (f64, f64) {
    let mut greatest = (f64::NEG_INFINITY, 0.0);
    let mut offer = |share: f64| {
        let least = lines.iter().map(|line| line.at(share)).fold(f64::INFINITY, f64::min);
        if least > greatest.0 {
            greatest = (least, share);
        }
    };
    [0.0, 1.0].into_iter().for_each(&mut offer);
    for (k, one) in lines.iter().enumerate() {
        for other in &lines[k + 1..] {
            let [start, end] = [0, 1].map(|i| one.depths[i] - other.depths[i]);
            if (start < 0.0) != (end < 0.0) {
                offer(start / (start - end));
            }
        }
    }
    let highest = lines.iter().flat_map(|line| line.depths).fold(0.0, f64::max);
    (greatest.0 + 1e-15 * highest, greatest.1)
}
