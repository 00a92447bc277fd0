//! Which contacts a pair of instances has, in either direction: count, place, fill.
//!
//! In: contacts in any order. Out: a row of members for each pair that touches, its contacts in any order, with points and forces in one frame: that of
//! the field in the pair's first direction. Nothing that follows depends on the order of pairs or of members.
use cubecl::prelude::*;

use super::pairs::four;
use super::products::{
    self, CONTACT_ROWS, CONTACT_WORDS, CONVERGED, DIRECTION_WORDS, MEMBER_ROWS, TOUCHING_WORDS, append,
};
use super::surface::{Direction, direction, to_field};
use super::vector::{V3, dot, length, minus, pick, scaled, v3};

/// Threads of a group.
pub const GROUP: u32 = 64;

/// A thread for each pair that there is room for.
#[cube(launch, create_dummy_kernel)]
pub fn clear(tallies: &mut [u32], most_pairs: u32) {
    let pair = ABSOLUTE_POS as u32;
    if pair < most_pairs {
        tallies[pair as usize] = 0u32;
    }
}

/// The pair of a contact: two directions side by side.
#[cube]
fn pair_of(words: &[u32], contact: u32) -> u32 {
    words[(contact * comptime!(CONTACT_WORDS as u32) + 7u32) as usize] / 2u32
}

/// A thread for each contact.
#[cube(launch, create_dummy_kernel)]
pub fn count(words: &[u32], counters: &[Atomic<u32>], tallies: &[Atomic<u32>], most: u32) {
    let contact = ABSOLUTE_POS as u32;
    if contact < counters[products::CONTACTS as usize].load().min(most) {
        tallies[pair_of(words, contact) as usize].fetch_add(1u32);
        if words[(contact * comptime!(CONTACT_WORDS as u32) + 6u32) as usize] < CONVERGED {
            counters[products::UNCONVERGED as usize].fetch_add(1u32);
        }
    }
}

/// A thread for each pair: one that touches is listed and takes places for its members, of which the first is left in its tally.
#[cube(launch, create_dummy_kernel)]
pub fn place(
    directions: &[u32],
    counters: &[Atomic<u32>],
    tallies: &mut [u32],
    touching: &mut [u32],
    most_pairs: u32,
) {
    let pair = ABSOLUTE_POS as u32;
    if pair < (counters[products::DIRECTIONS as usize].load() / 2u32).min(most_pairs) {
        let count = tallies[pair as usize];
        if count > 0u32 {
            let first = counters[products::MEMBERS as usize].fetch_add(count);
            let at = (append(counters, products::TOUCHING) * comptime!(TOUCHING_WORDS as u32)) as usize;
            let words = (2u32 * pair * comptime!(DIRECTION_WORDS as u32)) as usize;
            touching[at] = directions[words];
            touching[at + 1usize] = directions[words + 1usize];
            touching[at + 2usize] = count;
            touching[at + 3usize] = first;
            touching[at + 4usize] = count;
            tallies[pair as usize] = first;
        }
    }
}

#[cube]
fn row3(rows: &[Vector<f32, Const<4>>], at: usize) -> V3 {
    let row = rows[at];
    v3(row.extract(0usize), row.extract(1usize), row.extract(2usize))
}

/// A thread for each contact.
#[cube(launch, create_dummy_kernel)]
pub fn fill(
    directions: &[u32],
    maps: &[Vector<f32, Const<4>>],
    words: &[u32],
    rows: &[Vector<f32, Const<4>>],
    counters: &[Atomic<u32>],
    tallies: &[Atomic<u32>],
    numbers: &mut [u32],
    members: &mut [Vector<f32, Const<4>>],
    most: u32,
) {
    let contact = ABSOLUTE_POS as u32;
    if contact < counters[products::CONTACTS as usize].load().min(most) {
        let pair = pair_of(words, contact);
        let is_first = words[(contact * comptime!(CONTACT_WORDS as u32) + 7u32) as usize] == 2u32 * pair;
        let first: Direction = direction(directions, maps, 2u32 * pair);
        let row = (contact * comptime!(CONTACT_ROWS as u32)) as usize;
        let point = row3(rows, row);
        let gradient = row3(rows, row + 1usize);
        let distance = rows[row].extract(3usize);
        // The second direction's field is that of the first one's surface.
        let there = to_field(first, point);
        let turned = scaled(
            -1.0f32 / first.scale,
            v3(dot(first.x, gradient), dot(first.y, gradient), dot(first.z, gradient)),
        );
        let p = pick(is_first, point, there);
        let force = pick(is_first, gradient, turned);
        let far = length(minus(there, first.shift)) + length(first.shift);
        let slot = tallies[pair as usize].fetch_add(1u32);
        numbers[slot as usize] = contact;
        let member = (slot * comptime!(MEMBER_ROWS as u32)) as usize;
        members[member] = four(p.x, p.y, p.z, select(is_first, distance, distance * first.scale));
        members[member + 1usize] = four(force.x, force.y, force.z, select(is_first, length(point), far));
    }
}
