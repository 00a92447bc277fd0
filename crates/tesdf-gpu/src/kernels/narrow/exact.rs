//! The exact mode: finds the least signed distance over a polygon, within a tolerance.
//!
//! Outside of the solid, it is the least distance between the polygon and a face of the list. It
//! has a closed form, and each thread takes a face. Inside the solid, branch and bound finds it,
//! and each thread takes a piece of the polygon.
//!
//! Mirrors `collide/narrow/exact.rs` of `tesdf`.
use cubecl::prelude::*;

use crate::kernels::counters::{self, Counters};
use crate::kernels::detect::candidates::{Polygons, Weights};
use crate::kernels::detect::ordered_pair::{OrderedPair, OrderedPairs};
use crate::kernels::geometry::polygon_distance::{Disk, Polygon};
use crate::kernels::geometry::vector::V3;
use crate::kernels::narrow::exchange::LANES;
use crate::kernels::narrow::operations::Work;
use crate::kernels::pairs::meshlets::ROUNDING;
use crate::kernels::query::nearest::FAR;
use crate::kernels::report::contact::{CONVERGED, Contacts, NO_CORNER, Touch};
use crate::kernels::scene::shape::Shapes;
use crate::kernels::search::piece::{Lowest, POOL, Piece, Pool, Region, empty_pool, region};

/// Rounds after which a search gives up. In each round the group halves up to [`LANES`] pieces. The
/// processor counts evaluations instead (`MAX_EVALUATIONS` in `tesdf::collide::narrow`).
const ROUNDS: u32 = 96;
/// Closer to the surface than this, a polygon may cross it. On the processor, which computes in
/// `f64`, the limit is 1e-9 (`CLEAR` in `tesdf::collide::narrow`).
pub const CLEAR: f32 = 1e-6;
/// The smallest tolerance, in the frame of a field: a few times the rounding error of distances in
/// `f32`.
const FINEST: f32 = 1e-6;

/// The goal of a search: distances up to `reach` that are lower than the best distance so far by
/// more than `tolerance`.
#[derive(CubeType, Clone, Copy)]
#[expand(derive(Clone, Copy))]
pub struct Goal {
    pub reach: f32,
    pub tolerance: f32,
}

#[cube]
impl Goal {
    /// Whether a piece with this lower bound can still improve the result.
    fn is_open(self, bound: f32, best: Lowest) -> bool {
        bound < best.distance - self.tolerance && bound <= self.reach
    }
}

/// The result of a search.
#[derive(CubeType, CubeTypeMut, Clone, Copy)]
#[expand(derive(Clone, Copy))]
pub struct Searched {
    pub best: Lowest,
    pub converged: bool,
}

/// The least distance between a polygon and the faces of the cell's list. Each thread takes every
/// [`LANES`]-th face.
#[cube]
fn nearest_listed(region: Region<'_>, polygon: Polygon<'_>, normal: V3, pool: &mut Pool) -> Lowest {
    let ball = polygon.ball();
    let center = polygon.part.at(ball.center.s, ball.center.t);
    let disk = Disk { normal, center, radius: ball.radius };
    let field = region.field;
    let faces = field.list(region.cell.offset());
    let mut mine = Lowest { distance: FAR.runtime(), at: ball.center };
    let mut i = UNIT_POS;
    while i < faces.count {
        let apart = polygon.distance_to(disk, field.face(field.listed(faces, i)));
        pool.work.measure(1u32);
        mine = mine.or(apart.distance, apart.at);
        i += LANES;
    }
    pool.lowest(mine)
}

/// Puts the first pieces of a search into the pool: a fan of triangles, one for each thread. A
/// polygon without area is a triangle with equal corners. Returns the lowest value at a vertex.
#[cube]
fn fan(region: Region<'_>, polygon: Polygon<'_>, triangles: u32, pool: &mut Pool) -> Lowest {
    let at = polygon.vertex(UNIT_POS.min(polygon.count - 1u32));
    let here = region.value(at, UNIT_POS < polygon.count, &mut pool.work);
    pool.exchange(here.face);
    if UNIT_POS < triangles {
        let second = (UNIT_POS + 1u32).min(polygon.count - 1u32);
        let third = (UNIT_POS + 2u32).min(polygon.count - 1u32);
        let piece = Piece {
            a: polygon.vertex(0u32),
            b: polygon.vertex(second),
            c: polygon.vertex(third),
            face_a: pool.exchanged(0u32),
            face_b: pool.exchanged(second),
            face_c: pool.exchanged(third),
            // Nothing is known yet.
            bound: -FAR.runtime(),
        };
        pool.put(UNIT_POS, piece);
    }
    pool.lowest(Lowest { distance: here.distance, at })
}

/// Both halves of a piece, whether they are open, and the lowest value found.
#[derive(CubeType, CubeTypeMut, Clone, Copy)]
#[expand(derive(Clone, Copy))]
struct Halves {
    first: Piece,
    second: Piece,
    first_open: bool,
    second_open: bool,
    lowest: Lowest,
}

/// Halves a piece that is open.
#[cube]
fn halve(region: Region<'_>, goal: Goal, whole: Piece, best: Lowest, work: &mut Work) -> Halves {
    let piece = whole.turned(region.part);
    let middle = Weights { s: 0.5f32 * (piece.a.s + piece.b.s), t: 0.5f32 * (piece.a.t + piece.b.t) };
    let mut halves = no_halves(best);
    let mut face = piece.face_a;
    // The middle of the longest edge, then the centers of both halves. This is a loop, so that the
    // long code of the field stands here once.
    let mut turn = 0u32;
    while turn < 3u32 {
        let is_middle = turn == 0u32;
        let is_first = turn == 1u32;
        let mut half = piece.half(is_first, middle, face);
        let center = half.center();
        let at =
            Weights { s: select(is_middle, middle.s, center.s), t: select(is_middle, middle.t, center.t) };
        let here = region.value(at, true.runtime(), work);
        halves.lowest = halves.lowest.or(here.distance, at);
        if is_middle {
            face = here.face;
        } else {
            half.bound = region.bound(half, here, work);
            let open = goal.is_open(half.bound, best);
            if is_first {
                halves.first = half;
                halves.first_open = open;
            } else {
                halves.second = half;
                halves.second_open = open;
            }
        }
        turn += 1u32;
    }
    halves
}

/// Branch and bound over the pieces of a polygon.
#[cube]
pub fn search(
    region: Region<'_>,
    polygon: Polygon<'_>,
    goal: Goal,
    start: Lowest,
    pool: &mut Pool,
) -> Searched {
    let triangles = select(polygon.count > 2u32, polygon.count - 2u32, 1u32);
    let mut best = start;
    let found = fan(region, polygon, triangles, pool);
    best = best.or(found.distance, found.at);
    let mut waiting = triangles;
    let mut round = 0u32;
    while waiting > 0u32 && round < ROUNDS {
        sync_cube();
        // Take the newest pieces, as many as the pool has room for their halves.
        let taken = waiting.min(LANES).min(POOL - waiting).max(1u32);
        let base = waiting - taken;
        let mut halves = no_halves(best);
        if UNIT_POS < taken {
            let at = base + UNIT_POS;
            if goal.is_open(pool.bound(at), best) {
                halves = halve(region, goal, pool.get(at), best, &mut pool.work);
            }
        }
        let mine = select(halves.first_open, 1u32, 0u32) + select(halves.second_open, 1u32, 0u32);
        let kept = pool.count(mine);
        let mut to = base + kept.before;
        if halves.first_open {
            pool.put(to, halves.first);
            to += 1u32;
        }
        if halves.second_open {
            pool.put(to, halves.second);
        }
        let found = pool.lowest(halves.lowest);
        best = best.or(found.distance, found.at);
        waiting = base + kept.all;
        round += 1u32;
        if waiting >= POOL {
            round = ROUNDS.runtime();
        }
    }
    Searched { best, converged: waiting == 0u32 }
}

/// No point.
#[cube]
pub fn nowhere() -> Lowest {
    Lowest { distance: FAR.runtime(), at: Weights { s: 0.0f32, t: 0.0f32 } }
}

/// The result of a thread without a piece.
#[cube]
fn no_halves(best: Lowest) -> Halves {
    let none =
        Piece { a: best.at, b: best.at, c: best.at, face_a: 0u32, face_b: 0u32, face_c: 0u32, bound: 0.0f32 };
    Halves {
        first: none,
        second: none,
        first_open: false,
        second_open: false,
        lowest: Lowest { distance: FAR.runtime(), at: best.at },
    }
}

/// Finds the least signed distance over a polygon. Evaluates the center first: most polygons are
/// out of reach.
#[cube]
fn minimize(region: Region<'_>, polygon: Polygon<'_>, normal: V3, goal: Goal, pool: &mut Pool) -> Searched {
    let (field, cell) = (region.field, region.cell);
    let ball = polygon.ball();
    let is_first = UNIT_POS == 0u32;
    let at_center = region.value(ball.center, is_first, &mut pool.work).distance;
    let mut found = Searched { best: Lowest { distance: at_center, at: ball.center }, converged: true };
    if at_center - ball.radius <= goal.reach + ROUNDING {
        let crossing = cell.is_crossing();
        let all_inside = cell.is_inside() || (crossing && at_center < -ball.radius - ROUNDING);
        let mut searches = true;
        if field.is_mesh() && cell.is_listed() && !all_inside {
            let nearest = nearest_listed(region, polygon, normal, pool);
            let here = region.value(nearest.at, is_first, &mut pool.work);
            found.best = Lowest { distance: here.distance, at: nearest.at };
            // The polygon may cross the surface, or be inside the solid.
            searches = crossing && (nearest.distance <= CLEAR || here.distance < 0.0f32);
        }
        if searches {
            found = search(region, polygon, goal, found.best, pool);
        }
    } else {
        found.best.distance = FAR.runtime();
    }
    found
}

/// Parameters of the exact mode.
#[derive(CubeType, CubeLaunch)]
pub struct AskedExact {
    /// Tolerance for each instance that has the field, in its frame.
    pub tolerances: Box<[f32]>,
    /// A contact is dropped when the cosine between its gradient and the face's normal is above
    /// minus this number.
    pub cos_theta: f32,
}

#[cube]
impl AskedExact {
    /// The tolerance in the field of an ordered pair.
    pub fn tolerance(&self, pair: OrderedPair) -> f32 {
        self.tolerances[pair.b as usize].max(FINEST)
    }
}

/// Finds the contact of a polygon per group.
#[cube(launch, create_dummy_kernel)]
pub fn narrow_exact(
    shapes: &Shapes,
    pairs: &OrderedPairs,
    polygons: &Polygons,
    counters: &Counters,
    contacts: &mut Contacts,
    asked: &AskedExact,
    #[comptime] counting: bool,
) {
    let mut pool = empty_pool(counting);
    let number = CUBE_POS as u32;
    let count = counters.within(counters::POLYGONS, polygons.items.room);
    if number < count {
        let item = polygons.items.get(number);
        let pair = pairs.get(item.pair);
        let part = shapes.part(pair, item.face);
        let normal = shapes.part_normal(pair, item.face);
        let field = shapes.field(pair.shape_b);
        let cell = field.cell(item.cell);
        let region = region(field, cell, part);
        let reach = pairs.reach_of(pair, part);
        let goal = Goal { reach, tolerance: asked.tolerance(pair) };
        let found = minimize(region, polygons.polygon(number, part), normal, goal, &mut pool);
        pool.work.add_to(counters);
        if found.best.distance <= reach && UNIT_POS == 0u32 {
            let point = part.at(found.best.at.s, found.best.at.t);
            let v = field.value_in_cell(cell, point);
            if v.distance <= reach {
                let cosine = v.gradient.dot(normal);
                if pair.is_filtered(cosine, asked.cos_theta) {
                    counters.append(counters::FILTERED);
                } else {
                    let corner = NO_CORNER + select(found.converged, CONVERGED, 0u32);
                    let touch = Touch { face: item.face, cell: cell.name(), corner, point, cosine };
                    contacts.append(counters, pair, touch, v);
                }
            }
        }
        counters.tell_if_broken_off(count);
    }
}
