//! Where a part is flat on the other body, or large: the extremes of what touches.
//!
//! The least signed distance over a face may be attained on a whole patch, for example under a box
//! that stands on a table. One point of the patch cannot hold the box up. So the contacts are the
//! points of the patch that are farthest along some directions in the face's plane, and those that
//! stand out between them.
//!
//! A patch between plane faces is a polygon. Its corners are corners of the face, corners of the
//! other body's faces over it, or crossings of edges of both. These points are the candidates. A
//! candidate is taken when the field there is within the limit and opposes the face.
use std::cell::RefCell;

use arrayvec::ArrayVec;
use glam::DVec3;

use super::{Minimum, Search, cell_of};
use crate::base::elementary;
use crate::collide::bodies::field::CellField;
use crate::collide::bodies::surface::{Part, PartFacing};
use crate::collide::scene::field_value::FieldValue;
use crate::geometry::{Feature, Triangle};
use crate::query::Faces;

/// Number of directions in the plane of a face. A polygon's corner with a right angle is an extreme
/// of two of them.
pub const DIRECTIONS: usize = 8;

/// Most corners of a patch that are found.
const MOST: usize = 2 * DIRECTIONS;

/// A corner of a patch stands out from the line between its neighbours by more than this part of the
/// longest edge of the face.
const STANDS_OUT: f64 = 1e-6;

/// The field opposes a face when the cosine between gradient and normal is below this.
pub const OPPOSES: f64 = -0.5;

/// A patch along a line that ends nearer to the minimum than this fraction of the longest edge adds
/// nothing. Two edges that cross are within the tolerance of each other on such a short piece.
const SMALL: f64 = 1.0 / 16.0;

/// A line whose sine of the angle to a side is smaller runs along the side.
const ALONG: f64 = 1e-9;

/// Number of times that a candidate beside the patch is moved inwards: once for each side at a
/// corner, and once more.
pub const MOVES: usize = 3;

/// A candidate is moved by this multiple of what is missing, so that rounding does not decide.
pub const BEYOND: f64 = 1.01;

/// A gradient whose part along the face is shorter does not lead inwards.
pub const LEVEL: f64 = 0.1;

/// Number of candidates along one direction after which the search for its extreme ends.
pub const TRIALS: usize = 16;

/// A face that opposes the part is over it within this multiple of its height: the tangent of the
/// angle between them, which is below 60° ([`OPPOSES`]), with a margin.
const BESIDE: f64 = 4.0;

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
    is_large: bool,
    /// The greatest signed distance of the patch.
    limit: f64,
    /// Where the patch can be: the part, or a chord of it.
    within: ArrayVec<DVec3, 3>,
    /// The normal of `within`; zero for a chord.
    normal: DVec3,
    /// The normal of the part on the side that touches.
    facing: DVec3,
    sides: [Side; 3],
}

/// A side of a triangle.
#[derive(Clone, Copy, Default)]
struct Side {
    start: DVec3,
    /// Perpendicular to the side in the triangle's plane, as long as the side.
    inward: DVec3,
    /// The least height over the side, along `inward`, that counts as on it.
    least: f64,
}

/// A point of the part that may be a corner of the patch.
#[derive(Clone, Copy)]
struct Candidate {
    point: DVec3,
    /// The corner of the part that it is, if it is one.
    corner: Option<u8>,
    taken: Taken,
}

/// What is known of the contact of a candidate.
#[derive(Clone, Copy)]
enum Taken {
    Unknown,
    /// There is none.
    Never,
    /// Its index among the contacts.
    Contact(usize),
}

/// The candidates of a patch, and the contacts of some of them.
#[derive(Default)]
struct Candidates {
    all: Vec<Candidate>,
    contacts: Vec<Minimum>,
}

impl<'a> Patch<'a> {
    /// `field` is that of all cells. `minimum` is the least signed distance over `part`, as
    /// `search` found it.
    pub fn new(field: &'a CellField<'a>, part: &'a Part, minimum: &'a Minimum, search: &'a Search) -> Self {
        let points = part.points();
        let edges = (0..points.len()).map(|i| points[(i + 1) % points.len()] - points[i]);
        let longest =
            edges.fold(DVec3::ZERO, |l, e| if e.length_squared() > l.length_squared() { e } else { l });
        let within = points.iter().copied().collect();
        let is_large = search.is_large(part);
        let Search { tolerance, reach, .. } = *search;
        let limit = if is_large { reach + part.radius } else { minimum.value.distance + tolerance };
        let normal = part.normal;
        // A normal that may be that of the other side is turned against the gradient.
        let is_turned = part.facing == PartFacing::AtCenter && minimum.value.gradient.dot(part.normal) > 0.0;
        let facing = if is_turned { -part.normal } else { part.normal };
        Self {
            field,
            part,
            minimum,
            search,
            longest,
            is_large,
            limit,
            within,
            normal,
            facing,
            sides: Default::default(),
        }
    }

    /// Points of the patch other than the minimum: its corners, at most [`MOST`].
    pub fn extremes(mut self) -> ArrayVec<Minimum, MOST> {
        thread_local! {
            static CANDIDATES: RefCell<Candidates> = RefCell::default();
        }
        if self.part.points().len() < 2 || !(self.is_large || self.may_be_flat()) {
            return ArrayVec::new();
        }
        self.sides = sides(self.part);
        CANDIDATES.with_borrow_mut(|candidates| self.extremes_of(candidates))
    }

    /// The same, with memory for the candidates.
    fn extremes_of(&self, candidates: &mut Candidates) -> ArrayVec<Minimum, MOST> {
        let mut found = ArrayVec::<Minimum, MOST>::new();
        candidates.contacts.clear();
        self.find(&mut candidates.all);
        candidates.all.retain(|candidate| self.may_hold(candidate.point));
        for direction in self.directions() {
            let Some(extreme) = self.farthest(direction, f64::NEG_INFINITY, candidates) else {
                continue;
            };
            if found.iter().all(|other| other.point != extreme.point) {
                found.push(extreme);
            }
        }
        // The extremes are in their order around the patch. Corners between two of them stand out from
        // the line through both.
        let stands_out = STANDS_OUT * self.longest.length();
        let mut k = 0;
        let is_area = self.normal != DVec3::ZERO;
        while is_area && k < found.len() && !found.is_full() {
            let (from, to) = (found[k].point, found[(k + 1) % found.len()].point);
            let outward = (to - from).cross(self.normal).normalize_or_zero();
            match self.farthest(outward, outward.dot(from) + stands_out, candidates) {
                Some(corner) if found.iter().all(|other| other.point != corner.point) => {
                    found.insert(k + 1, corner);
                }
                _ => k += 1,
            }
        }
        found.retain(|corner| corner.point != self.minimum.point);
        found
    }

    /// Whether the field may be constant, up to the tolerance, from the minimum to other points of
    /// the part. If it can be so along one line only, the patch is limited to this chord.
    fn may_be_flat(&mut self) -> bool {
        let gradient = self.minimum.value.gradient;
        let length = self.longest.length();
        let slope = if self.normal == DVec3::ZERO {
            gradient.project_onto_normalized(self.longest / length)
        } else {
            gradient.reject_from_normalized(self.normal)
        };
        if is_level(slope.length(), length, self.search.tolerance) {
            return true;
        }
        let Some(level) = self.normal.cross(slope).try_normalize() else { return false };
        let Some(ends) = self.chord(level) else { return false };
        // Where the field rises soon on both sides, nothing else needs to be found.
        let point = self.minimum.point;
        let may_hold = |end: &DVec3| {
            let way = *end - point;
            let near = SMALL * length;
            way.length_squared() > near * near && {
                let (distance, slack) = self.field.rough(point + near * way.normalize());
                distance <= self.limit + slack
            }
        };
        if !ends.iter().any(may_hold) {
            return false;
        }
        (self.within, self.normal) = (ends.into_iter().collect(), DVec3::ZERO);
        true
    }

    /// The ends of the part along a line through the minimum.
    fn chord(&self, direction: DVec3) -> Option<[DVec3; 2]> {
        let (points, from) = (self.part.points(), self.minimum.point);
        let (mut low, mut high) = (f64::NEG_INFINITY, f64::INFINITY);
        for i in 0..points.len() {
            let (a, b) = (points[i], points[(i + 1) % points.len()]);
            let inward = self.part.normal.cross(b - a).normalize_or_zero();
            let (height, rise) = ((from - a).dot(inward), direction.dot(inward));
            match rise {
                // Along the side: the minimum may be on it.
                _ if rise.abs() <= ALONG => {}
                _ if rise > 0.0 => low = low.max(-height.max(0.0) / rise),
                _ => high = high.min(-height.max(0.0) / rise),
            }
        }
        let at = |t: f64| {
            let p = from + t * direction;
            let is_near = |corner: &&DVec3| corner.distance_squared(p) <= HEIGHT * HEIGHT;
            points.iter().find(is_near).copied().unwrap_or(p)
        };
        (low.is_finite() && high.is_finite()).then(|| [at(low), at(high)])
    }

    /// Whether a candidate may be in the patch and matters beside the minimum.
    fn may_hold(&self, p: DVec3) -> bool {
        let from = p - self.minimum.point;
        let beside = if self.normal == DVec3::ZERO { SMALL * self.longest.length() } else { 0.0 };
        from.length_squared() > beside * beside && (self.is_large || self.is_level(from))
    }

    /// Whether the field is constant, to first order and up to the tolerance, along a way from the
    /// minimum.
    fn is_level(&self, way: DVec3) -> bool {
        self.minimum.value.gradient.dot(way).abs() <= self.search.tolerance
    }

    fn directions(&self) -> ArrayVec<DVec3, DIRECTIONS> {
        if self.normal == DVec3::ZERO {
            let along = (self.within[1] - self.within[0]).normalize_or_zero();
            return [along, -along].into_iter().collect();
        }
        let along = self.longest.normalize_or_zero();
        let across = self.normal.cross(along);
        // Not along an edge, where all points of the edge would be extremes.
        let angle = |k: usize| (k as f64 + 0.5) * std::f64::consts::TAU / DIRECTIONS as f64;
        (0..DIRECTIONS)
            .map(|k| elementary::cos(angle(k)) * along + elementary::sin(angle(k)) * across)
            .collect()
    }

    /// The contact of the candidate that is farthest along a direction among those that have one, if
    /// it is farther than `least`. Removes candidates that have none.
    fn farthest(&self, direction: DVec3, least: f64, candidates: &mut Candidates) -> Option<Minimum> {
        let Candidates { all, contacts } = candidates;
        let mut limit = f64::INFINITY;
        for _ in 0..TRIALS {
            let mut next: Option<(f64, usize)> = None;
            for (i, candidate) in all.iter().enumerate() {
                let at = direction.dot(candidate.point);
                if at > least && at < limit && next.is_none_or(|(best, _)| at > best) {
                    next = Some((at, i));
                }
            }
            let (at, i) = next?;
            let Candidate { point, corner, taken } = all[i];
            match taken {
                Taken::Contact(index) => return contacts.get(index).copied(),
                Taken::Unknown => {
                    if let Some(taken) = self.take(point, corner) {
                        all[i].taken = Taken::Contact(contacts.len());
                        contacts.push(taken);
                        return Some(taken);
                    }
                }
                Taken::Never => {}
            }
            all.remove(i);
            // Faces that share a corner have offered it, too.
            let same = all.iter_mut().filter(|candidate| candidate.point == point);
            same.for_each(|candidate| candidate.taken = Taken::Never);
            limit = at;
        }
        None
    }

    /// The contact at a point, or near it, if the field there is within the limit and opposes the
    /// face.
    fn take(&self, point: DVec3, corner: Option<u8>) -> Option<Minimum> {
        let normal = self.facing;
        let value = |p: DVec3| self.field.opposing(p, normal, self.search.precision);
        let holds = |v: &FieldValue| {
            v.distance <= self.limit && (normal == DVec3::ZERO || v.gradient.dot(normal) < OPPOSES)
        };
        let minimum = |point, value, corner| Minimum {
            point,
            value,
            cell: cell_of(self.field, point),
            converged: self.minimum.converged,
            corner,
            is_lowest: false,
        };
        // From the nearest point of the other body, along the face.
        let offset = |p: DVec3, v: &FieldValue| self.along_face(p - v.closest_point);
        let is_over = |p, v: &FieldValue| v.feature == Feature::Face || offset(p, v).length() < HEIGHT;
        let first = value(point);
        let taken = holds(&first).then(|| minimum(point, first, corner));
        if normal == DVec3::ZERO || (taken.is_some() && is_over(point, &first)) {
            return taken;
        }
        // At a border of the other body's face, a point is nearer to the side of the body than to
        // this face, or it lies beside the body. If only rounding or less than the tolerance puts
        // it there, it is moved inwards until the side is as deep as the face.
        let depth = self.search.tolerance.max(-self.minimum.value.distance);
        let (mut at, mut moved) = (first, point);
        for _ in 0..MOVES {
            let missing = at.distance + depth;
            let gradient = self.along_face(at.gradient);
            let (outward, slope) = match at.distance < 0.0 {
                true => (gradient, gradient.length()),
                // The gradient on the surface does not say on which side of an edge the point lies.
                false if gradient.length() < LEVEL => (offset(moved, &at), 1.0),
                false => (gradient, 1.0),
            };
            if missing > 2.0 * depth || outward.length() < HEIGHT || slope < LEVEL {
                break;
            }
            let way = BEYOND * missing.max(0.0) / slope + HEIGHT;
            let Some(inside) = self.inwards(moved, outward.normalize(), way) else { break };
            moved = inside;
            at = value(moved);
            if holds(&at) && is_over(moved, &at) {
                return Some(minimum(moved, at, None));
            }
        }
        taken
    }

    /// The component of a vector in the plane of the face.
    fn along_face(&self, v: DVec3) -> DVec3 {
        v.reject_from_normalized(self.part.normal)
    }

    /// The point of the face by this way from `p` against a direction: straight, or along a side
    /// where that leaves the face, as at a sharp corner of the patch.
    fn inwards(&self, p: DVec3, outward: DVec3, way: f64) -> Option<DVec3> {
        let along_side = |side: &Side| {
            let along = side.inward.cross(self.part.normal).normalize_or_zero();
            let rise = along.dot(outward);
            (rise.abs() > LEVEL).then(|| p - way / rise * along)
        };
        let straight = p - way * outward;
        if self.holds(straight) {
            return Some(straight);
        }
        let inside = self.sides.iter().filter_map(along_side).filter(|q| self.holds(*q));
        inside.min_by(|q, r| q.distance_squared(p).total_cmp(&r.distance_squared(p)))
    }

    /// Whether a point lies over the face, or on it.
    fn holds(&self, p: DVec3) -> bool {
        self.sides.iter().all(|side| side.inward.dot(p - side.start) >= side.least)
    }

    /// Whether a face of the other body lies beside the part, by more than the patch can be high.
    fn is_beside(&self, points: &[DVec3]) -> bool {
        let high = BESIDE * (self.limit.abs() + self.minimum.value.distance.abs());
        let is_beyond = |side: &Side, p: &DVec3| {
            let height = side.inward.dot(*p - side.start);
            height < 0.0 && height * height > high * high * side.inward.length_squared()
        };
        points.len() == 3 && self.sides.iter().any(|side| points.iter().all(|p| is_beyond(side, p)))
    }

    /// Finds the corners of the overlay of the part and the faces of the other body near it.
    fn find(&self, candidates: &mut Vec<Candidate>) {
        let corner = |point: DVec3| self.part.points().iter().position(|p| *p == point).map(|k| k as u8);
        let taken = Taken::Unknown;
        candidates.clear();
        candidates.extend(self.within.iter().map(|&point| Candidate { point, corner: corner(point), taken }));
        let mut offer = |point| candidates.push(Candidate { point, corner: None, taken });
        match *self.field {
            CellField::Whole(around) => {
                let limit = self.nearest_within();
                around.near_polygon(&self.within, self.normal, limit, &mut |face| {
                    self.overlay(&around.asset.local_triangle(face as usize), limit + HEIGHT, &mut offer);
                    limit
                });
            }
            // A cell is not searched for extremes.
            CellField::Mesh { .. } => {}
            CellField::Simple(simple) => {
                // Faces that share a corner offer it once: a box has few.
                let mut offer = |point| {
                    if candidates.iter().all(|candidate| candidate.point != point) {
                        candidates.push(Candidate { point, corner: None, taken });
                    }
                };
                for points in simple.parts_against(self.facing).filter(|points| !self.is_beside(points)) {
                    match points[..] {
                        [a, b, c] => self.overlay(&Triangle::new([a, b, c]), f64::INFINITY, &mut offer),
                        // The feet of the ends of a capsule's core.
                        [a, b] => [a, b].into_iter().for_each(|end| offer(self.foot(end))),
                        _ => {}
                    }
                }
            }
        }
    }

    /// Faces of the other body that are nearest to a point of the patch are within this. No point is
    /// farther from the surface than the minimum by more than its distance from there.
    fn nearest_within(&self) -> f64 {
        let Minimum { point, value, .. } = self.minimum;
        let radius = self.within.iter().map(|p| p.distance(*point)).fold(0.0, f64::max);
        self.limit.abs().min(value.distance + radius).max(value.distance.abs())
    }

    /// Offers the corners of the overlay of the part and a face of the other body, as far as the
    /// face is within `limit` there.
    fn overlay(&self, face: &Triangle, limit: f64, offer: &mut impl FnMut(DVec3)) {
        let (points, normal) = (&self.within, self.normal);
        let none = Faces::default();
        let looks_outward = self.field.mesh(&none).is_none_or(|(asset, ..)| asset.faces_look_outward());
        let is_behind = looks_outward && face.normal.dot(self.facing) > 0.0;
        if face.normal == DVec3::ZERO || is_behind {
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
        let inward: [DVec3; 3] =
            std::array::from_fn(|k| face.normal.cross(face.corners[(k + 1) % 3] - face.corners[k]));
        let heights: ArrayVec<[f64; 3], 3> =
            points.iter().map(|p| std::array::from_fn(|k| inward[k].dot(*p - face.corners[k]))).collect();
        let count = points.len();
        for i in 0..if count == 3 { 3 } else { 1 } {
            let j = (i + 1) % count;
            // The part of the edge over the face.
            let (mut from, mut to) = (0.0f64, 1.0f64);
            for (start, end) in heights[i].into_iter().zip(heights[j]) {
                match (start < 0.0, end < 0.0) {
                    (true, true) => (from, to) = (1.0, 0.0),
                    (true, false) => from = from.max(start / (start - end)),
                    (false, true) => to = to.min(start / (start - end)),
                    (false, false) => {}
                }
            }
            if from > to {
                continue;
            }
            for t in [from, to] {
                let point = points[i] + t * (points[j] - points[i]);
                let height = face.normal.dot(point - face.corners[0]);
                if t > 0.0 && t < 1.0 && height.abs() <= limit {
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

/// Whether a field that rises along a part with this slope is constant, up to the tolerance, over a
/// piece of the part that matters. `length` is that of the longest edge.
pub fn is_level(slope: f64, length: f64, tolerance: f64) -> bool {
    slope * SMALL * length <= tolerance
}

/// The sides of a part that is a triangle.
fn sides(part: &Part) -> [Side; 3] {
    let &[a, b, c] = part.points() else { return Default::default() };
    [(a, b), (b, c), (c, a)].map(|(start, end)| {
        let edge = end - start;
        Side { start, inward: part.normal.cross(edge), least: -HEIGHT * edge.length() }
    })
}
