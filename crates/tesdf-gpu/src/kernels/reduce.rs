//! Keeps, of all contacts of a pair of instances, a few that can do what all can do: a group of threads for each pair that touches.
//!
//! In: the members of pairs. Out: the contacts kept, in any order, and per pair a bound on what is lost. The rules are those of `tesdf::collide`:
//! the deepest contact, the extremes along three axes, then one by one that whose wrench is farthest from the hull of those kept. Here every thread
//! shortens the ways to the wrenches of its own members in parallel, and lengths of ways stand for distances: the greatest of them were shortened last.
//!
//! Nothing depends on the order of members: of equal ones that with the lowest name is taken, and what happens to a member depends on itself, on what is
//! kept, and on the greatest of all lengths.
use cubecl::prelude::*;

use super::assets::NONE;
use super::choice::{Chosen, GROUP, best, wins};
use super::hull::{BLOCK, VERTICES, put, shortened, vertex};
use super::nearest::FAR;
use super::pairs::four;
use super::products::{
    self, CONTACT_ROWS, CONTACT_WORDS, MEMBER_ROWS, REPORT_ROWS, TOUCHING_WORDS, append, tell_if_broken_off,
};
use super::vector::{V3, cross, dot, length, minus, plus_scaled, scaled, v3};
use super::wrench::{Way, Wrench, difference, pick_wrench, product, set_way, shorter};

/// An axis along which the points reach less than this share of their radius has no extremes, as in `tesdf`.
const FLAT: f32 = 1e-3;
/// Points closer to their center than this share of what they were rounded with are no measure for a torque.
const LEAST_LENGTH: f32 = 1e-4;
/// What the rounding of poses and points may do to a wrench, as a share of 1 + size / length.
const POINT_ROUNDING: f32 = 4e-6;
/// A distance below this is rounding.
const ROUNDING: f32 = 2e-6;
/// Ways that are at least this share of the longest are shortened before the longest is believed.
const NEARLY_LONGEST: f32 = 0.8;
/// Rounds for each contact that is kept.
const ROUNDS: u32 = 4;
/// Rounds at the end, as long as each takes more than this share of the longest square.
const LAST_ROUNDS: u32 = 16;
const SETTLED: f32 = 0.95;

/// What a scan over all members does: the newest vertex shortens all ways; the longest ways are shortened towards any vertex; the error is taken.
const ADD: u32 = 0;
const SHORTEN: u32 = 1;
const MEASURE: u32 = 2;
const END: u32 = 3;

/// What the first scans look for: the box of the points, the greatest rounding, the deepest contact, and the extremes.
const BOX_END: u32 = 6;
const SIZE: u32 = 6;
const DEEPEST: u32 = 7;
const FIRST_AXIS: u32 = 8;
const SECOND_AXIS: u32 = 11;
const THIRD_AXIS: u32 = 14;
const SCANS: u32 = 17;
/// The deepest contact, and two for each axis.
const SEEDS: u32 = 7;

#[cube]
fn three(row: Vector<f32, Const<4>>) -> V3 {
    v3(row.extract(0usize), row.extract(1usize), row.extract(2usize))
}

/// What is left of `p` without its parts along two axes; an axis of zeros takes nothing.
#[cube]
fn off(p: V3, first: V3, second: V3) -> V3 {
    plus_scaled(plus_scaled(p, -dot(p, first), first), -dot(p, second), second)
}

/// The first six coordinates of two rows.
#[cube]
fn wrench(p: Vector<f32, Const<4>>, q: Vector<f32, Const<4>>) -> Wrench {
    Wrench { force: three(p), torque: v3(p.extract(3usize), q.extract(0usize), q.extract(1usize)) }
}

/// A group for each pair that touches. Pairs of `per_pair` contacts at most stay whole.
#[cube(launch, create_dummy_kernel)]
pub fn reduce(
    words: &[u32],
    rows: &[Vector<f32, Const<4>>],
    numbers: &[u32],
    counters: &[Atomic<u32>],
    touching: &mut [u32],
    members: &mut [Vector<f32, Const<4>>],
    reports: &mut [Vector<f32, Const<4>>],
    kept_words: &mut [u32],
    kept_rows: &mut [Vector<f32, Const<4>>],
    per_pair: u32,
    most_pairs: u32,
    most_kept: u32,
) {
    let mut keys = Shared::<[f32]>::new_slice(GROUP as usize);
    let mut chosen = Shared::<[u32]>::new_slice(GROUP as usize);
    let mut seeds = Shared::<[u32]>::new_slice(SEEDS as usize);
    let mut vertices = Shared::<[f32]>::new_slice(comptime!(6 * VERTICES as usize));
    let mut newest = Shared::<[f32]>::new_slice(6usize);
    let pair = CUBE_POS as u32;
    let pairs = counters[products::TOUCHING as usize].load().min(most_pairs);
    if pair < pairs {
        let at = (pair * comptime!(TOUCHING_WORDS as u32)) as usize;
        let count = touching[at + 2usize];
        let first = touching[at + 3usize];
        let end = first + count;
        let reduces = count > per_pair;

        // The box of the points, their radius, and the seeds.
        let mut high_x = 0.0f32;
        let mut high_y = 0.0f32;
        let mut high_z = 0.0f32;
        let mut low_x = 0.0f32;
        let mut low_y = 0.0f32;
        let mut low_z = 0.0f32;
        let mut center_x = 0.0f32;
        let mut center_y = 0.0f32;
        let mut center_z = 0.0f32;
        // Along what points are compared, and the axes that are done.
        let mut along_x = 1.0f32;
        let mut along_y = 0.0f32;
        let mut along_z = 0.0f32;
        let mut first_x = 0.0f32;
        let mut first_y = 0.0f32;
        let mut first_z = 0.0f32;
        let mut second_x = 0.0f32;
        let mut second_y = 0.0f32;
        let mut second_z = 0.0f32;
        let mut size = 0.0f32;
        let mut radius = 0.0f32;
        let mut seed_count = 0u32;
        let mut scan = 0u32;
        while scan < SCANS {
            let is_axis = scan == FIRST_AXIS || scan == SECOND_AXIS || scan == THIRD_AXIS;
            let center = v3(center_x, center_y, center_z);
            let along = v3(along_x, along_y, along_z);
            let axis_1 = v3(first_x, first_y, first_z);
            let axis_2 = v3(second_x, second_y, second_z);
            let mut key = -FAR.runtime();
            let mut member = NONE.runtime();
            let mut i = first + UNIT_POS;
            while i < end {
                let row = (i * comptime!(MEMBER_ROWS as u32)) as usize;
                let here = members[row];
                let p = minus(three(here), center);
                let rest = off(p, axis_1, axis_2);
                let mut value = select(is_axis, dot(rest, rest), dot(p, along));
                value = select(scan == SIZE, members[row + 1usize].extract(3usize), value);
                value = select(scan == DEEPEST, -here.extract(3usize), value);
                let this = Chosen { key: value, member: i };
                if wins(words, rows, numbers, this, Chosen { key, member }) {
                    key = value;
                    member = i;
                }
                i += GROUP;
            }
            let found = best(words, rows, numbers, Chosen { key, member }, &mut keys, &mut chosen);
            // Six directions: along x, against it, and so on.
            high_x = select(scan == 0u32, found.key, high_x);
            low_x = select(scan == 1u32, -found.key, low_x);
            high_y = select(scan == 2u32, found.key, high_y);
            low_y = select(scan == 3u32, -found.key, low_y);
            high_z = select(scan == 4u32, found.key, high_z);
            low_z = select(scan == 5u32, -found.key, low_z);
            size = select(scan == SIZE, found.key, size);
            if scan < BOX_END {
                let turns = scan % 2u32 == 0u32;
                along_x = select(turns, -along_x, 0.0f32);
                along_y = select(turns, -along_y, select(scan == 1u32, 1.0f32, 0.0f32));
                along_z = select(turns, -along_z, select(scan == 3u32, 1.0f32, 0.0f32));
                let is_last = scan + 1u32 == BOX_END;
                center_x = select(is_last, 0.5f32 * (low_x + high_x), 0.0f32);
                center_y = select(is_last, 0.5f32 * (low_y + high_y), 0.0f32);
                center_z = select(is_last, 0.5f32 * (low_z + high_z), 0.0f32);
            }
            if scan >= DEEPEST && !is_axis && found.member != NONE {
                let mut is_new = true;
                let mut k = 0u32;
                while k < seed_count {
                    is_new = is_new && seeds[k as usize] != found.member;
                    k += 1u32;
                }
                if is_new {
                    if UNIT_POS == 0u32 {
                        seeds[seed_count as usize] = found.member;
                    }
                    seed_count += 1u32;
                }
                along_x = -along_x;
                along_y = -along_y;
                along_z = -along_z;
            }
            scan += 1u32;
            if is_axis {
                let mut reach_x = 0.0f32;
                let mut reach_y = 0.0f32;
                let mut reach_z = 0.0f32;
                if found.member != NONE {
                    let row = (found.member * comptime!(MEMBER_ROWS as u32)) as usize;
                    let reach = off(minus(three(members[row]), center), axis_1, axis_2);
                    reach_x = reach.x;
                    reach_y = reach.y;
                    reach_z = reach.z;
                }
                let long = length(v3(reach_x, reach_y, reach_z));
                let is_first = scan == FIRST_AXIS + 1u32;
                radius = select(is_first, long, radius);
                let inverse = 1.0f32 / long.max(1e-30f32);
                along_x = reach_x * inverse;
                along_y = reach_y * inverse;
                along_z = reach_z * inverse;
                first_x = select(is_first, along_x, first_x);
                first_y = select(is_first, along_y, first_y);
                first_z = select(is_first, along_z, first_z);
                let is_second = scan == SECOND_AXIS + 1u32;
                second_x = select(is_second, along_x, second_x);
                second_y = select(is_second, along_y, second_y);
                second_z = select(is_second, along_z, second_z);
                let is_flat = long <= FLAT * radius;
                scan = select(is_flat || !reduces, SCANS, scan);
            }
        }
        let center = v3(center_x, center_y, center_z);
        let unit = radius.max(LEAST_LENGTH * size);

        let mut kept = select(reduces, 0u32, count);
        let mut error = 0.0f32;
        if reduces {
            // A point of no extent needs no scale: its torques are 0.
            let inverse = select(unit > 0.0f32, 1.0f32 / unit.max(1e-30f32), 0.0f32);
            // Nobody writes wrenches while another still reads a point.
            sync_cube();
            let mut i = first + UNIT_POS;
            while i < end {
                let row = (i * comptime!(MEMBER_ROWS as u32)) as usize;
                let p = minus(three(members[row]), center);
                let force = three(members[row + 1usize]);
                let torque = cross(scaled(inverse, p), force);
                members[row] = four(force.x, force.y, force.z, torque.x);
                members[row + 1usize] = four(torque.y, torque.z, 0.0f32, 0.0f32);
                members[row + 2usize] = four(0.0f32, 0.0f32, 0.0f32, 0.0f32);
                members[row + 3usize] = four(0.0f32, 0.0f32, 0.0f32, 0.0f32);
                i += GROUP;
            }
            let mut stage = ADD.runtime();
            let mut next = seeds[0];
            let mut seed = 1u32;
            let mut rounds = 0u32;
            // The square of the longest way before.
            let mut longest = 0.0f32;
            while stage != END {
                if stage == ADD {
                    // Whose member it is has written its rows.
                    if (next - first) % GROUP == UNIT_POS {
                        let row = (next * comptime!(MEMBER_ROWS as u32)) as usize;
                        let w = wrench(members[row], members[row + 1usize]);
                        members[row + 1usize] = four(w.torque.y, w.torque.z, 0.0f32, 1.0f32);
                        put(&mut newest, 0u32, w);
                        let mut k = kept;
                        while kept < VERTICES && (k == kept || k % BLOCK != 0u32) {
                            put(&mut vertices, k, w);
                            k += 1u32;
                        }
                    }
                    kept += 1u32;
                }
                sync_cube();
                let new = vertex(&newest, 0u32);
                let held = kept.min(VERTICES);
                let threshold = NEARLY_LONGEST * NEARLY_LONGEST * longest;
                let mut key = -FAR.runtime();
                let mut member = NONE.runtime();
                i = first + UNIT_POS;
                while i < end {
                    let row = (i * comptime!(MEMBER_ROWS as u32)) as usize;
                    let w = wrench(members[row], members[row + 1usize]);
                    let last = members[row + 3usize];
                    let known = wrench(members[row + 2usize], last);
                    let to_new = difference(w, new);
                    let is_first = kept == 1u32 && stage == ADD;
                    let start = pick_wrench(is_first, to_new, known);
                    let mut way = Way { way: start, rounding: last.extract(2usize) };
                    let adds = stage == ADD;
                    let shortens = stage == SHORTEN && product(start, start) >= threshold;
                    if adds {
                        let new_way = shorter(way, to_new, to_new);
                        set_way(&mut way, new_way);
                    }
                    if shortens {
                        let new_way = shortened(way, w, to_new, &vertices, held);
                        set_way(&mut way, new_way);
                    }
                    let x = way.way;
                    let square = product(x, x);
                    if adds || shortens {
                        members[row + 2usize] = four(x.force.x, x.force.y, x.force.z, x.torque.x);
                        members[row + 3usize] = four(x.torque.y, x.torque.z, way.rounding, 0.0f32);
                    }
                    let value = select(stage == MEASURE, square.sqrt() + way.rounding, square);
                    let this = Chosen { key: value, member: i };
                    if wins(words, rows, numbers, this, Chosen { key, member }) {
                        key = value;
                        member = i;
                    }
                    i += GROUP;
                }
                let found = best(words, rows, numbers, Chosen { key, member }, &mut keys, &mut chosen);
                let has_room = kept < per_pair;
                let is_seed = stage == ADD && seed < seed_count && has_room;
                let is_whole = found.member == NONE || found.key <= ROUNDING * ROUNDING;
                // Ways below the threshold were not looked at, so one of those may be the longest now.
                let least = select(has_room, threshold, SETTLED * longest);
                let is_last = rounds == select(has_room, ROUNDS, LAST_ROUNDS);
                let is_sure = stage == SHORTEN && (found.key >= least || is_last);
                let is_done = is_whole || (is_sure && !has_room);
                let mut following = select(is_sure, ADD, SHORTEN);
                following = select(is_done, MEASURE, following);
                following = select(is_seed, ADD, following);
                following = select(stage == MEASURE, END, following);
                error = found.key;
                longest = found.key;
                rounds = select(following == SHORTEN, rounds + 1u32, 0u32);
                next = found.member;
                if is_seed {
                    next = seeds[seed as usize];
                    seed += 1u32;
                }
                stage = following;
            }
            error = error.max(0.0f32) * 1.000001f32 + POINT_ROUNDING * (1.0f32 + size / unit.max(1e-30f32));
        }

        let mut i = first + UNIT_POS;
        while i < end {
            let row = (i * comptime!(MEMBER_ROWS as u32)) as usize;
            if !reduces || members[row + 1usize].extract(3usize) > 0.5f32 {
                let slot = append(counters, products::KEPT);
                if slot < most_kept {
                    let contact = numbers[i as usize];
                    let mut k = 0u32;
                    while k < comptime!(CONTACT_WORDS as u32) {
                        kept_words[(slot * comptime!(CONTACT_WORDS as u32) + k) as usize] =
                            words[(contact * comptime!(CONTACT_WORDS as u32) + k) as usize];
                        k += 1u32;
                    }
                    k = 0u32;
                    while k < comptime!(CONTACT_ROWS as u32) {
                        kept_rows[(slot * comptime!(CONTACT_ROWS as u32) + k) as usize] =
                            rows[(contact * comptime!(CONTACT_ROWS as u32) + k) as usize];
                        k += 1u32;
                    }
                }
            }
            i += GROUP;
        }
        if UNIT_POS == 0u32 {
            touching[at + 4usize] = kept;
            let report = (pair * comptime!(REPORT_ROWS as u32)) as usize;
            reports[report] = four(center.x, center.y, center.z, unit);
            reports[report + 1usize] = four(error, 0.0f32, 0.0f32, 0.0f32);
        }
        tell_if_broken_off(counters, select(pairs > 0u32, 2u32, 0u32));
    }
}
