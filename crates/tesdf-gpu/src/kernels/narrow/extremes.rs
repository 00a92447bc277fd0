//! The contacts of a whole face, from the point with its least signed distance: that point, and
//! where the face is flat on the other body, or large, the extremes of what touches.
//!
//! Eight directions are searched at once, then once more those out of the lines between neighbours
//! of what was found. Four threads share a direction: they look for the farthest candidate, each
//! among a quarter of the faces nearby.
//!
//! Mirrors `collide/narrow/extremes.rs` of `tesdf`.
use cubecl::prelude::*;
use tesdf::collide::internal;

use crate::kernels::counters::{self, Counters};
use crate::kernels::detect::candidates::Weights;
use crate::kernels::detect::ordered_pair::{OrderedPair, OrderedPairs, Part, PartExpand};
use crate::kernels::geometry::polygon_distance::weights_of;
use crate::kernels::geometry::triangle::Face;
use crate::kernels::geometry::vector::{LEAST_DIVISOR, V3, pick, zero};
use crate::kernels::narrow::contact_points::{BETWEEN, DIRECTIONS, MINIMUM, Memory, SAME, Taken, nothing_at};
use crate::kernels::narrow::operations::Work;
use crate::kernels::narrow::tree_walk::{FACES, Walk, axes_of};
use crate::kernels::query::locate::no_cell;
use crate::kernels::query::nearest::FAR;
use crate::kernels::report::contact::{CONVERGED, Contacts, NO_CORNER, Touch};
use crate::kernels::scene::shape::{BOX, FACE_COUNT, Field, FieldExpand, KIND, NONE, PLANE, Shapes};
use crate::kernels::search::piece::{Lowest, Pool};

/// A face is large when its longest edge exceeds this fraction of the smaller body's diagonal.
const LARGE: f32 = internal::LARGE as f32;
/// The field opposes a face when the cosine between gradient and normal is below this.
const OPPOSES: f32 = internal::OPPOSES as f32;
/// Number of times that a candidate beside the patch is moved inwards.
const MOVES: u32 = internal::MOVES as u32;
/// A candidate is moved by this multiple of what is missing.
const BEYOND: f32 = internal::BEYOND as f32;
/// A gradient whose part along the face is shorter does not lead inwards.
const LEVEL: f32 = internal::LEVEL as f32;
/// Number of candidates along one direction after which the search for its extreme ends.
const TRIALS: u32 = internal::TRIALS as u32;
/// Rounding of a height, in the local frame. On the processor, which computes in `f64`, it is
/// 1e-12.
const HEIGHT: f32 = 1e-6;

/// A face, the field of the other body, and the limits of the contacts.
#[derive(CubeType, Clone, Copy)]
#[expand(derive(Clone, Copy))]
pub struct Facing<'a> {
    /// The field of the other body.
    pub field: Field<'a>,
    pub pair: OrderedPair,
    pub face: u32,
    pub part: Part,
    /// Unit normal, or zero.
    pub normal: V3,
    /// Contact distance for the part: smaller distances are contacts.
    pub reach: f32,
    /// The body that has the face.
    surface: Field<'a>,
    limits: Limits,
}

/// Limits of the contacts of a face.
#[derive(CubeType, Clone, Copy)]
#[expand(derive(Clone, Copy))]
pub struct Limits {
    /// Distances that differ by less are equal.
    pub tolerance: f32,
    /// A contact is dropped when the cosine between its gradient and the face's normal is above
    /// minus this number.
    pub cos_theta: f32,
}

/// A face of an ordered pair.
#[cube]
pub fn facing<'a>(
    shapes: &'a Shapes,
    pairs: &OrderedPairs,
    pair: OrderedPair,
    face: u32,
    limits: Limits,
) -> Facing<'a> {
    let part = shapes.part(pair, face);
    Facing::<'a> {
        field: shapes.field(pair.shape_b),
        pair,
        face,
        part,
        normal: shapes.part_normal(pair, face),
        reach: pairs.reach_of(pair, part),
        surface: shapes.field(pair.shape_a),
        limits,
    }
}

/// What a point must fulfil to be a contact.
#[derive(CubeType, CubeTypeMut, Clone, Copy)]
#[expand(derive(Clone, Copy))]
struct Patch {
    /// The greatest signed distance.
    limit: f32,
    /// The greatest cosine between gradient and normal.
    opposes: f32,
    /// The depth of the minimum, to which other points are moved inwards; 0 where none are.
    depth: f32,
    /// Faces of the other body that are nearest to a point of the patch are within this.
    near: f32,
}

/// A direction in the plane of a face: its products with both edges at the first corner.
#[derive(CubeType, CubeTypeMut, Clone, Copy)]
#[expand(derive(Clone, Copy))]
struct Direction {
    s: f32,
    t: f32,
    /// Only candidates whose height along the direction is between these are looked at.
    above: f32,
    below: f32,
}

#[cube]
impl Direction {
    fn height(self, at: Weights) -> f32 {
        self.s * at.s + self.t * at.t
    }

    /// The farther of two candidates. Their "distance" is minus their height.
    fn farther(self, best: Lowest, at: Weights) -> Lowest {
        let height = self.height(at);
        best.or(select(height > self.above && height < self.below, -height, FAR), at)
    }
}

/// A point in the plane of a face, and whether the face has it.
#[derive(CubeType, Clone, Copy)]
#[expand(derive(Clone, Copy))]
struct Inwards {
    point: V3,
    is_inside: bool,
}

/// Corner `k` of a face in weights.
#[cube]
fn corner_at(k: u32) -> Weights {
    Weights { s: select(k == 1u32, 1.0f32, 0.0f32), t: select(k == 2u32, 1.0f32, 0.0f32) }
}

/// The corner of a part that a point is; [`NO_CORNER`] when it is none.
#[cube]
fn corner_of(part: Part, at: Weights) -> u32 {
    let is_a = at.s == 0.0f32 && at.t == 0.0f32;
    let is_b = at.s == 1.0f32 && at.t == 0.0f32 && part.count > 1u32;
    let is_c = at.s == 0.0f32 && at.t == 1.0f32 && part.count > 2u32;
    select(is_a, 0u32, select(is_b, 1u32, select(is_c, 2u32, NO_CORNER)))
}

#[cube]
impl Part {
    /// The longest edge; zero for a point.
    fn longest(self) -> V3 {
        let (ab, bc, ca) = (self.b - self.a, self.c - self.b, self.a - self.c);
        let (u, v, w) = (ab.dot(ab), bc.dot(bc), ca.dot(ca));
        pick(u >= v && u >= w, ab, pick(v >= w, bc, ca))
    }

    /// Whether a point lies over the part, or beyond a side by less than `beyond`.
    fn holds(self, normal: V3, p: V3, beyond: f32) -> bool {
        let mut holds = true;
        let mut k = 0u32;
        while k < 3u32 {
            let start = self.corner(k);
            let edge = self.corner(select(k == 2u32, 0u32, k + 1u32)) - start;
            holds = holds && normal.cross(edge).dot(p - start) >= -beyond * edge.length();
            k += 1u32;
        }
        holds
    }
}

#[cube]
impl Field<'_> {
    /// The diagonal of the bounds.
    fn diagonal(self) -> f32 {
        let bounds = self.bounds();
        select(self.entry(KIND) == PLANE, FAR, (bounds.high - bounds.low).length())
    }
}

#[cube]
impl Facing<'_> {
    fn has_plane(self) -> bool {
        self.normal.dot(self.normal) > 0.5f32
    }

    fn is_large(self) -> bool {
        let diagonal = (self.surface.diagonal() * self.pair.scale).min(self.field.diagonal());
        self.part.longest().length() > LARGE * diagonal
    }

    /// A direction in the plane of the face.
    fn along(self, to: V3) -> Direction {
        let (ab, ac) = (self.part.b - self.part.a, self.part.c - self.part.a);
        Direction { s: to.dot(ab), t: to.dot(ac), above: -FAR.runtime(), below: FAR.runtime() }
    }

    /// The direction out of the line between two neighbours of a patch. The corners between them
    /// stand out from the line. Where both are the same, nothing does.
    fn out_of(self, from: V3, to: V3) -> Direction {
        let line = to - from;
        let length = line.length();
        let outward = line.cross(self.normal) * (1.0f32 / length.max(LEAST_DIVISOR));
        let mut direction = self.along(outward);
        direction.above = select(length > SAME, outward.dot(from - self.part.a) + SAME, FAR);
        direction
    }

    /// Direction `k`. Those of a face without a plane lead along its longest edge.
    fn direction(self, k: u32) -> Direction {
        let longest = self.part.longest();
        let along = longest * (1.0f32 / longest.length().max(LEAST_DIVISOR));
        let across = self.normal.cross(along);
        // Not along an edge, where all points of the edge would be extremes: 22.5 degrees, and so
        // on.
        let steep = k % 4u32 == 1u32 || k % 4u32 == 2u32;
        let x =
            select(steep, 0.382_683_43f32, 0.923_879_5f32) * select(k >= 2u32 && k < 6u32, -1.0f32, 1.0f32);
        let y = select(steep, 0.923_879_5f32, 0.382_683_43f32) * select(k >= 4u32, -1.0f32, 1.0f32);
        self.along(along * x + across * y)
    }

    /// Where the field is level from the minimum to another corner, within the tolerance, or the
    /// face is large: what other points must fulfil. Otherwise nothing fulfils it.
    fn patch(self, minimum: Taken) -> Patch {
        let is_large = self.is_large();
        let v = minimum.value;
        let mut level = 0u32;
        let mut radius = 0.0f32;
        let mut k = 0u32;
        while k < self.part.count {
            let way = self.part.corner(k) - minimum.point;
            level += select(v.gradient.dot(way).abs() <= self.limits.tolerance, 1u32, 0u32);
            radius = radius.max(way.length());
            k += 1u32;
        }
        let own = select(minimum.corner == NO_CORNER, 0u32, 1u32);
        let is_flat = self.part.count > 1u32 && (is_large || level > own);
        let limit = select(is_large, self.reach, v.distance + self.limits.tolerance);
        let opposes = v.gradient.dot(self.normal) < OPPOSES;
        Patch {
            limit: select(is_flat, limit, -FAR),
            opposes: select(self.has_plane(), OPPOSES, 2.0f32),
            depth: select(opposes, -v.distance, 0.0f32).max(0.0f32),
            near: limit.abs().min(v.distance + radius).max(v.distance.abs()),
        }
    }

    /// The contact at a point, or near it, if it fulfils what the patch demands.
    ///
    /// At a border of the other body's face, a point is nearer to the side of the body than to this
    /// face. It is moved inwards until the side is as deep as the face.
    fn take(self, patch: Patch, at: V3, corner: u32, is_own: bool, work: &mut Work) -> Taken {
        let mut found = nothing_at(at, corner);
        let mut turn = 0u32;
        let mut open = true;
        while open {
            let mut cell = no_cell();
            if self.field.is_mesh() {
                cell = self.field.locate(found.point);
            }
            if comptime!(work.counting) {
                work.evaluate(self.field.exact_distances(cell, found.point), is_own);
            }
            let v = self.field.exact_value_in(cell, found.point);
            let v = self.field.opposing(cell, found.point, self.normal, v);
            let along = v.gradient.dot(self.normal);
            found.value = v;
            found.cell = cell.name();
            found.is_taken = v.distance <= patch.limit && along < patch.opposes;
            let missing = v.distance + patch.depth;
            let sideways = v.gradient + self.normal * -along;
            let square = sideways.dot(sideways);
            let slope = square.sqrt().max(LEVEL);
            let way = (BEYOND * missing.max(0.0f32) + HEIGHT) / slope;
            let next = self.inwards(found.point, sideways * (1.0f32 / slope), way);
            let leads = square >= LEVEL * LEVEL && missing <= 2.0f32 * patch.depth;
            turn += 1u32;
            open = !found.is_taken && patch.depth > 0.0f32 && leads && turn <= MOVES && next.is_inside;
            found.point = pick(open, next.point, found.point);
            found.corner = select(open, NO_CORNER, found.corner);
        }
        found
    }

    /// The point of the face by this way from `p` against a direction: straight, or along a side
    /// where that leaves the face, as at a sharp corner of the patch.
    fn inwards(self, p: V3, outward: V3, way: f32) -> Inwards {
        let straight = p + outward * -way;
        let is_straight = self.part.holds(self.normal, straight, 0.0f32);
        let mut point = straight;
        let mut is_inside = is_straight;
        let mut nearest = FAR.runtime();
        let mut k = 0u32;
        while k < 3u32 {
            let side = self.part.corner(select(k == 2u32, 0u32, k + 1u32)) - self.part.corner(k);
            let along = side * (1.0f32 / side.length().max(LEAST_DIVISOR));
            let rise = along.dot(outward);
            let length = way / rise.abs().max(LEVEL);
            let next = p + along * select(rise < 0.0f32, length, -length);
            let is_nearer = rise.abs() > LEVEL && length < nearest;
            let taken = !is_straight && is_nearer && self.part.holds(self.normal, next, HEIGHT);
            nearest = select(taken, length, nearest);
            point = pick(taken, next, point);
            is_inside = is_inside || taken;
            k += 1u32;
        }
        Inwards { point, is_inside }
    }

    /// The farthest candidate along the direction of this thread: a corner of the face, a corner of
    /// the other body's faces over it, or a crossing of their edges. All threads of the group must
    /// call it.
    fn farthest(self, to: Direction, patch: Patch, walk: &mut Walk, pool: &mut Pool) -> Lowest {
        let quarter = UNIT_POS / DIRECTIONS;
        let axes = axes_of(self.part, self.normal);
        let near = patch.near;
        let limit = near + axes.rounding;
        let is_mesh = self.field.is_mesh();
        let sides = select(self.field.entry(KIND) == BOX, self.field.entry(FACE_COUNT), 0u32);
        let mut best = Lowest { distance: FAR.runtime(), at: corner_at(0u32) };
        let mut k = 0u32;
        while k < self.part.count {
            best = to.farther(best, corner_at(k));
            k += 1u32;
        }
        walk.start();
        let mut open = true;
        while open {
            let mut taken = 0u32;
            if is_mesh {
                taken = walk.next(self.field, axes, limit, pool);
            }
            let mut i = 0u32;
            while i < FACES {
                let number = quarter * FACES + i;
                let mut face = walk.face(taken, number);
                if !is_mesh && number < sides {
                    face = number;
                }
                if face != NONE {
                    let f = self.field.face(face);
                    if !is_mesh || axes.to_face(f) <= limit {
                        best = self.overlay(to, f, select(is_mesh, near + HEIGHT, FAR), best);
                    }
                }
                i += 1u32;
            }
            open = taken > 0u32;
        }
        pool.lowest_of_every(best, UNIT_POS % DIRECTIONS, DIRECTIONS)
    }

    /// Offers the corners of the overlay of the part and a face of the other body, as far as the
    /// face is within `limit` there.
    fn overlay(self, to: Direction, f: Face, limit: f32, start: Lowest) -> Lowest {
        let (part, normal) = (self.part, self.normal);
        let mut best = start;
        if !f.is_flat() && f.normal.dot(normal) <= 0.0f32 {
            let edges = select(part.count == 3u32, 3u32, 1u32);
            let mut k = 0u32;
            while k < 3u32 {
                let c = f.corner(k);
                let height = normal.dot(c - part.a);
                if self.has_plane() && height.abs() <= limit && part.holds(normal, c, 0.0f32) {
                    best = to.farther(best, weights_of(part, normal, c + normal * -height));
                }
                if k < edges {
                    best = self.edge_over(to, f, limit, k, best);
                }
                k += 1u32;
            }
        }
        best
    }

    /// Offers the ends of the part of edge `k` that is over a face.
    fn edge_over(self, to: Direction, f: Face, limit: f32, k: u32, start: Lowest) -> Lowest {
        let next = select(k + 1u32 == self.part.count, 0u32, k + 1u32);
        let (a, b) = (self.part.corner(k), self.part.corner(next));
        let mut from = 0.0f32;
        let mut end = 1.0f32;
        let mut e = 0u32;
        while e < 3u32 {
            let c = f.corner(e);
            let inward = f.normal.cross(f.corner(select(e == 2u32, 0u32, e + 1u32)) - c);
            let (at_a, at_b) = (inward.dot(a - c), inward.dot(b - c));
            let t = at_a / select(at_a == at_b, 1.0f32, at_a - at_b);
            let (a_out, b_out) = (at_a < 0.0f32, at_b < 0.0f32);
            from = select(a_out, select(b_out, 1.0f32, from.max(t)), from);
            end = select(b_out, select(a_out, 0.0f32, end.min(t)), end);
            e += 1u32;
        }
        let mut best = start;
        let (at_a, at_b) = (corner_at(k), corner_at(next));
        let mut turn = 0u32;
        while turn < 2u32 {
            let t = select(turn == 0u32, from, end);
            let height = f.normal.dot((a + (b - a) * t) - f.a);
            if from <= end && t > 0.0f32 && t < 1.0f32 && height.abs() <= limit {
                let at = Weights { s: at_a.s + t * (at_b.s - at_a.s), t: at_a.t + t * (at_b.t - at_a.t) };
                best = to.farther(best, at);
            }
            turn += 1u32;
        }
        best
    }

    /// Writes a contact, or counts it as filtered.
    fn write(self, taken: Taken, converged: bool, counters: &Counters, contacts: &mut Contacts) {
        let cosine = taken.value.gradient.dot(self.normal);
        if self.pair.is_filtered(cosine, self.limits.cos_theta) {
            counters.append(counters::FILTERED);
        } else {
            let corner = taken.corner + select(converged, CONVERGED, 0u32);
            let touch = Touch { face: self.face, cell: taken.cell, corner, point: taken.point, cosine };
            contacts.append(counters, self.pair, touch, taken.value);
        }
    }

    /// Writes the contacts of a face whose least signed distance is at `at`. All threads of the
    /// group must call it.
    pub fn report(
        self,
        at: Weights,
        converged: bool,
        counters: &Counters,
        contacts: &mut Contacts,
        memory: &mut Memory,
    ) {
        let direction = UNIT_POS % DIRECTIONS;
        memory.points.clear();
        let anywhere = Patch { limit: FAR.runtime(), opposes: 2.0f32, depth: 0.0f32, near: 0.0f32 };
        let mut patch = anywhere;
        let mut to = self.direction(direction);
        // Whether this thread's direction has no extreme yet.
        let mut searches = true;
        // First the minimum itself, then candidates in all directions, then those that stand out
        // between two of them.
        let mut slot = MINIMUM.runtime();
        let mut round = 0u32;
        let mut rounds = 1u32;
        while round < rounds {
            let is_minimum = slot == MINIMUM;
            let mut candidate = Lowest { distance: 0.0f32, at };
            if !is_minimum {
                candidate = self.farthest(to, patch, &mut memory.walk, &mut memory.pool);
            }
            searches = searches && candidate.distance < FAR;
            let mut taken = nothing_at(zero(), NO_CORNER.runtime());
            let writes = select(is_minimum, UNIT_POS == 0u32, UNIT_POS < DIRECTIONS);
            if searches {
                let point = self.part.at(candidate.at.s, candidate.at.t);
                let corner = corner_of(self.part, candidate.at);
                taken = self.take(patch, point, corner, writes, &mut memory.pool.work);
                to.below = -candidate.distance - SAME;
            }
            memory.points.put(slot, round + 1u32, taken);
            let is_new = memory.points.is_new(slot, round + 1u32, taken);
            if writes && taken.is_taken && is_new {
                self.write(taken, converged, counters, contacts);
            }
            searches = searches && !taken.is_taken;
            let open = memory.pool.count(select(searches, 1u32, 0u32));
            round += 1u32;
            if is_minimum {
                patch = self.patch(taken);
                rounds = select(patch.limit > -FAR, 1u32 + TRIALS, 1u32);
                to.below = FAR.runtime();
                searches = true;
                slot = direction;
            } else if open.all == 0u32 || round == rounds {
                let next = memory.points.next(direction);
                to = self.out_of(memory.points.get(direction), memory.points.get(next));
                searches = slot == direction && next != direction && self.has_plane();
                rounds = select(slot == direction, round + TRIALS, round);
                slot = BETWEEN + direction;
            }
        }
    }
}
