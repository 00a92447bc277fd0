//! The exact mode with one contact for each face: finds the least signed distance over a whole
//! face, within a tolerance.
//!
//! The threads of a group find the faces of the other body that are nearest to the whole face, by a
//! walk through the face tree. Where the face crosses the surface or is inside, a grid of its points
//! gives a first depth. Then the face, moved out by this depth and the tolerance, often clears the
//! surface, which proves the depth. Otherwise branch and bound finds it.
use cubecl::prelude::*;

use crate::kernels::counters::{self, Counters};
use crate::kernels::detect::candidates::{Polygons, Weights};
use crate::kernels::detect::ordered_pair::OrderedPairs;
use crate::kernels::geometry::polygon_distance::{Disk, Polygon};
use crate::kernels::geometry::vector::{V3, pick, zero};
use crate::kernels::narrow::contact_points::{Memory, memory_of};
use crate::kernels::narrow::exact::{AskedExact, CLEAR, Goal, Searched, nowhere, search};
use crate::kernels::narrow::extremes::{Limits, facing};
use crate::kernels::narrow::tree_walk::{Walk, axes_of, no_walk};
use crate::kernels::query::nearest::FAR;
use crate::kernels::report::contact::Contacts;
use crate::kernels::scene::shape::{Field, NONE, Shapes};
use crate::kernels::search::piece::{Lowest, Pool, Region, empty_pool, everywhere};

/// A moved face clears the surface when its distance is more than this share of the tolerance,
/// which is at least 1e-6. Distances between faces are off by less.
const CLEARS: f32 = 0.5;

/// Steps between two corners of a face at which a group looks first.
const STEPS: u32 = 6;
/// The number of these points.
const FIRST_LOOKS: u32 = (STEPS + 1) * (STEPS + 2) / 2;

/// Point `number` of a face at which the group looks first, row by row.
#[cube]
fn first_look(number: u32) -> Weights {
    let mut row = 0u32;
    let mut place = number;
    while row < STEPS && place > STEPS - row {
        place -= STEPS + 1u32 - row;
        row += 1u32;
    }
    let step = comptime!(1.0 / STEPS as f32);
    // The last point of a row is exactly the corner or on the side.
    let last = STEPS - row;
    let t = row as f32 * step;
    let s = select(place >= last, 1.0f32 - t, place as f32 * step);
    Weights { s: select(row == STEPS, 0.0f32, s), t: select(row == STEPS, 1.0f32, t) }
}

/// The least distance between a part and a face of the field, if it is within `limit`. Otherwise
/// [`FAR`], with the center of the part.
#[cube]
fn nearest_face(
    field: Field<'_>,
    polygon: Polygon<'_>,
    normal: V3,
    limit: f32,
    walk: &mut Walk,
    pool: &mut Pool,
) -> Lowest {
    let axes = axes_of(polygon.part, normal);
    let ball = polygon.ball();
    let disk = Disk { normal, center: polygon.part.at(ball.center.s, ball.center.t), radius: ball.radius };
    let mut best = Lowest { distance: FAR.runtime(), at: ball.center };
    walk.start();
    let mut open = true;
    while open {
        let farthest = limit.min(best.distance) + axes.rounding;
        let taken = walk.next(field, axes, farthest, pool);
        open = taken > 0u32;
        if open {
            let face = walk.face(taken, UNIT_POS);
            let mut mine = Lowest { distance: FAR.runtime(), at: ball.center };
            if face != NONE {
                let f = field.face(face);
                if axes.to_face(f) <= farthest {
                    let apart = polygon.distance_to(disk, f);
                    pool.work.measure(1u32);
                    mine = mine.or(apart.distance, apart.at);
                }
            }
            let found = pool.lowest(mine);
            best = best.or(found.distance, found.at);
        }
    }
    best
}

/// A direction that all threads of a group know.
#[derive(CubeType)]
struct Direction {
    numbers: Shared<[f32]>,
}

#[cube]
impl Direction {
    /// Takes the direction of the threads for which `mine` is true. Where there are several, they
    /// have the same. All threads of the group must call it.
    fn share(&mut self, mine: bool, along: V3) {
        sync_cube();
        if mine {
            self.numbers[0] = along.x;
            self.numbers[1] = along.y;
            self.numbers[2] = along.z;
        }
        sync_cube();
    }

    fn get(&self) -> V3 {
        V3 { x: self.numbers[0], y: self.numbers[1], z: self.numbers[2] }
    }
}

/// A state of the search before branch and bound: what is known, and whether it is enough.
#[derive(CubeType, CubeTypeMut, Clone, Copy)]
#[expand(derive(Clone, Copy))]
struct Known {
    best: Lowest,
    /// Whether a point of the face may be lower than the best by more than the tolerance.
    searches: bool,
}

/// The least signed distance of a face that keeps clear of the surface. Where a face crosses the
/// surface or is inside, the lowest of several points, which may be proved to be the least.
///
/// Suppose that the face is moved out by a length and is then outside. Then each of its points was
/// at most this length deep.
#[cube]
fn look(
    region: Region<'_>,
    polygons: &Polygons,
    normal: V3,
    goal: Goal,
    memory: &mut Memory,
    outward: &mut Direction,
) -> Known {
    let (field, part) = (region.field, region.part);
    let mut known = Known { best: nowhere(), searches: true };
    let mut limit = goal.reach + 2.0f32 * CLEAR;
    let mut by = zero();
    // First the face itself. Then it is moved along the gradient at the best point, and then
    // against its normal. This is a loop, so that the long code of distances stands here once.
    let mut attempt = 0u32;
    while attempt < 3u32 {
        let is_first = attempt == 0u32;
        let moved = part.moved(by);
        let polygon = polygons.whole(moved);
        let near = nearest_face(field, polygon, normal, limit, &mut memory.walk, &mut memory.pool);
        let looks = is_first && UNIT_POS > 0u32;
        let first = first_look(select(looks, UNIT_POS - 1u32, 0u32));
        let at = Weights { s: select(looks, first.s, near.at.s), t: select(looks, first.t, near.at.t) };
        let is_own = UNIT_POS == 0u32 || (is_first && UNIT_POS <= FIRST_LOOKS);
        let here = everywhere(field, moved).value(at, is_own, &mut memory.pool.work);
        let found = memory.pool.lowest(Lowest { distance: here.distance, at });
        if is_first {
            known.best = found;
            // The field of a sheet is nowhere below 0.
            let crosses = near.distance <= CLEAR && field.half_thickness() == 0.0f32;
            known.searches = found.distance < 0.0f32 || crosses;
            let mine = here.distance == found.distance && at.s == found.at.s && at.t == found.at.t;
            outward.share(mine, here.gradient);
        } else {
            known.searches = near.distance <= limit || found.distance < 0.0f32;
        }
        limit = CLEARS * goal.tolerance;
        let length = goal.tolerance + (-known.best.distance).max(0.0f32);
        by = pick(is_first, outward.get(), normal.negated()) * length;
        attempt = select(known.searches, attempt + 1u32, 3u32);
    }
    known
}

/// Finds the least signed distance over a face.
#[cube]
fn minimize(
    region: Region<'_>,
    polygons: &Polygons,
    normal: V3,
    goal: Goal,
    memory: &mut Memory,
) -> Searched {
    let mut outward = Direction { numbers: Shared::<[f32]>::new_slice(3usize) };
    let polygon = polygons.whole(region.part);
    let mut known =
        Known { best: Lowest { distance: FAR.runtime(), at: polygon.ball().center }, searches: true };
    if region.field.is_mesh() {
        known = look(region, polygons, normal, goal, memory, &mut outward);
    }
    let mut found = Searched { best: known.best, converged: true };
    if known.searches {
        found = search(region, polygon, goal, known.best, &mut memory.pool);
    }
    found
}

/// Finds the contact of a face per group.
#[cube(launch, create_dummy_kernel)]
pub fn narrow_exact_faces(
    shapes: &Shapes,
    pairs: &OrderedPairs,
    polygons: &Polygons,
    counters: &Counters,
    contacts: &mut Contacts,
    asked: &AskedExact,
    #[comptime] counting: bool,
) {
    let mut memory = memory_of(empty_pool(counting), no_walk());
    let number = CUBE_POS as u32;
    let count = counters.within(counters::POLYGONS, polygons.items.room);
    if number < count {
        let item = polygons.items.get(number);
        let pair = pairs.get(item.pair);
        let tolerance = asked.tolerance(pair);
        let face = facing(shapes, pairs, pair, item.face, Limits { tolerance, cos_theta: asked.cos_theta });
        let region = everywhere(face.field, face.part);
        let goal = Goal { reach: face.reach, tolerance };
        let found = minimize(region, polygons, face.normal, goal, &mut memory);
        if found.best.distance <= face.reach {
            face.report(found.best.at, found.converged, counters, contacts, &mut memory);
        }
        memory.pool.work.add_to(counters);
        counters.tell_if_broken_off(count);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kernels::narrow::exchange::LANES;

    #[test]
    fn the_first_looks_are_a_grid_with_the_corners() {
        let looks: Vec<(f32, f32)> = (0..FIRST_LOOKS).map(first_look).map(|w| (w.s, w.t)).collect();
        for corner in [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0)] {
            assert!(looks.contains(&corner), "{corner:?}");
        }
        for (k, look) in looks.iter().enumerate() {
            assert!(look.0 >= 0.0 && look.1 >= 0.0 && look.0 + look.1 <= 1.0 + 1e-6, "{look:?}");
            assert!(!looks[..k].contains(look), "{look:?} twice");
        }
        assert_eq!(first_look(LANES).t, 1.0);
    }
}
