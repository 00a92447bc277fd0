//! Where a part is flat on the other body, or large: the extremes of what touches.
//!
//! The least signed distance over a face may be attained on a whole patch, for example under a box
//! that stands on a table. One point of the patch cannot hold the box up. So the contacts are the
//! points of the patch that are farthest along some directions in the face's plane.
//!
//! A patch between plane faces is a polygon. Its corners are corners of the face, corners of the
//! other body's faces over it, or crossings of edges of both. These points are the candidates. A
//! candidate is taken when the field there is within the limit and opposes the face.
use arrayvec::ArrayVec;
use glam::DVec3;

use super::{Minimum, Search, cell_of};
use crate::collide::field::CellField;
use crate::collide::field_value::FieldValue;
use crate::collide::surface::Part;
use crate::geometry::Triangle;

/// Number of directions in the plane of a face. A polygon's corner with a right angle is an extreme
/// of two of them.
const DIRECTIONS: usize = 8;

/// The field opposes a face when the cosine between gradient and normal is below this.
const OPPOSES: f64 = -0.5;

/// Number of times that a candidate beside the patch is moved inwards: once for each side at a
/// corner, and once more.
const MOVES: usize = 3;

/// A candidate is moved by this multiple of what is missing, so that rounding does not decide.
const BEYOND: f64 = 1.01;

/// A gradient whose part along the face is shorter does not lead inwards.
const LEVEL: f64 = 0.1;

/// Number of candidates along one direction after which the search for its extreme ends.
const TRIALS: usize = 16;

/// Rounding of a height, in the local frame.
const HEIGHT: f64 = 1e-12;

/// The part of a face that touches.
pub struct Patch<'a> {
    field: &'a CellField<'a>,
    part: &'a Part,
    minimum: &'a Minimum,
    search: &'a Search,
    /// The longest edge of the part; zero for a point.
    longest: DVec3,
    /// The greatest signed distance of the patch.
    limit: f64,
}

/// A point of the part that may be a corner of the patch.
#[derive(Clone, Copy)]
struct Candidate {
    point: DVec3,
    /// The corner of the part that it is, if it is one.
    corner: Option<u8>,
    /// Its contact, once it is known.
    taken: Option<Minimum>,
}

impl<'a> Patch<'a> {
    /// `field` is that of all cells. `minimum` is the least signed distance over `part`, as `search`
    /// found it.
    pub fn new(field: &'a CellField<'a>, part: &'a Part, minimum: &'a Minimum, search: &'a Search) -> Self {
        let points = part.points();
        let edges = (0..points.len()).map(|i| points[(i + 1) % points.len()] - points[i]);
        let longest =
            edges.fold(DVec3::ZERO, |l, e| if e.length_squared() > l.length_squared() { e } else { l });
        let mut patch = Self { field, part, minimum, search, longest, limit: 0.0 };
        let Search { tolerance, reach, .. } = *search;
        patch.limit = if patch.is_large() { reach + part.radius } else { minimum.value.distance + tolerance };
        patch
    }

    /// Points of the patch other than the minimum, at most one for each direction.
    pub fn extremes(&self) -> ArrayVec<Minimum, DIRECTIONS> {
        let mut found = ArrayVec::<Minimum, DIRECTIONS>::new();
        if self.part.points().len() < 2 || !self.may_be_flat() {
            return found;
        }
        let mut candidates = self.candidates();
        for direction in self.directions() {
            let Some(extreme) = self.farthest(direction, &mut candidates) else { continue };
            let is_new = |other: &Minimum| other.point != extreme.point;
            if is_new(self.minimum) && found.iter().all(is_new) {
                found.push(extreme);
            }
        }
        found
    }

    fn is_large(&self) -> bool {
        self.longest.length_squared() > self.search.large * self.search.large
    }

    /// Whether the part is large, or the field is constant, to first order and up to the tolerance,
    /// from the minimum to another corner of the part.
    fn may_be_flat(&self) -> bool {
        let Minimum { point, value, corner, .. } = self.minimum;
        let is_level = |p: &&DVec3| value.gradient.dot(**p - *point).abs() <= self.search.tolerance;
        let level = self.part.points().iter().filter(is_level).count();
        self.is_large() || level > usize::from(corner.is_some())
    }

    fn directions(&self) -> ArrayVec<DVec3, DIRECTIONS> {
        let Some(along) = self.longest.try_normalize() else { return ArrayVec::new() };
        if self.part.normal == DVec3::ZERO {
            return [along, -along].into_iter().collect();
        }
        let across = self.part.normal.cross(along);
        // Not along an edge, where all points of the edge would be extremes.
        let angle = |k: usize| (k as f64 + 0.5) * std::f64::consts::TAU / DIRECTIONS as f64;
        (0..DIRECTIONS).map(|k| angle(k).cos() * along + angle(k).sin() * across).collect()
    }

    /// The contact of the candidate that is farthest along a direction among those that have one.
    /// Removes candidates that have none.
    fn farthest(&self, direction: DVec3, candidates: &mut Vec<Candidate>) -> Option<Minimum> {
        let mut limit = f64::INFINITY;
        for _ in 0..TRIALS {
            let mut next: Option<(f64, usize)> = None;
            for (i, candidate) in candidates.iter().enumerate() {
                let at = direction.dot(candidate.point);
                if at < limit && next.is_none_or(|(best, _)| at > best) {
                    next = Some((at, i));
                }
            }
            let (at, i) = next?;
            let Candidate { point, corner, taken } = candidates[i];
            let taken = taken.or_else(|| self.take(point, corner));
            if taken.is_some() {
                candidates[i].taken = taken;
                return taken;
            }
            candidates.remove(i);
            limit = at;
        }
        None
    }

    /// The contact at a point, or near it, if the field there is within the limit and opposes the
    /// face.
    fn take(&self, point: DVec3, corner: Option<u8>) -> Option<Minimum> {
        let normal = self.part.normal;
        let value = |p: DVec3| {
            let precision = self.search.precision;
            self.field.opposing(p, normal, self.field.value(p, precision), precision)
        };
        let holds = |v: &FieldValue| {
            v.distance <= self.limit && (normal == DVec3::ZERO || v.gradient.dot(normal) < OPPOSES)
        };
        let minimum = |point, value, corner| Minimum {
            point,
            value,
            cell: cell_of(self.field, point),
            converged: self.minimum.converged,
            corner,
        };
        let first = value(point);
        if holds(&first) {
            return Some(minimum(point, first, corner));
        }
        // At a border of the other body's face, a point is nearer to the side of the body than to
        // this face. It is moved inwards until the side is as deep as the face.
        let depth = -self.minimum.value.distance;
        if depth <= 0.0 || normal == DVec3::ZERO || !holds(&self.minimum.value) {
            return None;
        }
        let (mut at, mut moved) = (first, point);
        for _ in 0..MOVES {
            let missing = at.distance + depth;
            let sideways = at.gradient.reject_from_normalized(normal);
            if missing > 2.0 * depth || sideways.length() < LEVEL {
                return None;
            }
            moved -= sideways * (BEYOND * missing.max(0.0) + HEIGHT) / sideways.length_squared();
            if !self.holds(moved) {
                return None;
            }
            at = value(moved);
            if holds(&at) {
                return Some(minimum(moved, at, None));
            }
        }
        None
    }

    /// Whether a point lies over the face, or on it.
    fn holds(&self, p: DVec3) -> bool {
        let (points, normal) = (self.part.points(), self.part.normal);
        (0..3).all(|i| normal.cross(points[(i + 1) % 3] - points[i]).dot(p - points[i]) >= 0.0)
    }

    /// Corners of the overlay of the part and the faces of the other body near it.
    fn candidates(&self) -> Vec<Candidate> {
        let corner = |(k, &point): (usize, &DVec3)| Candidate { point, corner: Some(k as u8), taken: None };
        let mut candidates: Vec<Candidate> = self.part.points().iter().enumerate().map(corner).collect();
        let mut offer = |point| candidates.push(Candidate { point, corner: None, taken: None });
        match *self.field {
            CellField::Mesh { asset, .. } | CellField::Whole(asset) => {
                // Faces of the patch are as near as its points.
                let limit = self.limit.abs().max(self.minimum.value.distance.abs());
                asset.near_polygon(self.part.points(), self.part.normal, limit, &mut |face| {
                    self.overlay(&asset.local_triangle(face as usize), limit + HEIGHT, &mut offer);
                    limit
                });
            }
            CellField::Simple(simple) => {
                for points in simple.parts().0 {
                    match points[..] {
                        [a, b, c] => self.overlay(&Triangle::new([a, b, c]), f64::INFINITY, &mut offer),
                        // The feet of the ends of a capsule's core.
                        [a, b] => [a, b].into_iter().for_each(|end| offer(self.foot(end))),
                        _ => {}
                    }
                }
            }
        }
        candidates
    }

    /// Offers the corners of the overlay of the part and a face of the other body, as far as the
    /// face is within `limit` there.
    fn overlay(&self, face: &Triangle, limit: f64, offer: &mut impl FnMut(DVec3)) {
        let (points, normal) = (self.part.points(), self.part.normal);
        if face.normal == DVec3::ZERO || face.normal.dot(normal) > 0.0 {
            return;
        }
        if normal != DVec3::ZERO {
            for &corner in &face.corners {
                let height = normal.dot(corner - points[0]);
                if height.abs() <= limit && self.holds(corner) {
                    offer(corner - height * normal);
                }
            }
        }
        let count = points.len();
        for i in 0..if count == 3 { 3 } else { 1 } {
            let (a, b) = (points[i], points[(i + 1) % count]);
            // The part of the edge over the face.
            let (mut from, mut to) = (0.0f64, 1.0f64);
            for k in 0..3 {
                let (c, d) = (face.corners[k], face.corners[(k + 1) % 3]);
                let inward = face.normal.cross(d - c);
                let (start, end) = (inward.dot(a - c), inward.dot(b - c));
                match (start < 0.0, end < 0.0) {
                    (true, true) => (from, to) = (1.0, 0.0),
                    (true, false) => from = from.max(start / (start - end)),
                    (false, true) => to = to.min(start / (start - end)),
                    (false, false) => {}
                }
            }
            for t in [from, to] {
                let point = a + t * (b - a);
                let height = face.normal.dot(point - face.corners[0]);
                if from <= to && t > 0.0 && t < 1.0 && height.abs() <= limit {
                    offer(point);
                }
            }
        }
    }

    /// The point of the part that is nearest to `p`.
    fn foot(&self, p: DVec3) -> DVec3 {
        match *self.part.points() {
            [a, b, c] => Triangle::new([a, b, c]).closest(p).point,
            [a, b] => a + ((p - a).dot(b - a) / (b - a).length_squared()).clamp(0.0, 1.0) * (b - a),
            _ => self.part.points()[0],
        }
    }
}
