//! Collects the contacts of each pair of instances, from both ordered pairs: count, allot, fill.
//!
//! In: contacts in any order. Out: for each touching pair a run of members, which are its contacts
//! in any order. Points and forces of a run are in one frame, the frame of the field in the first
//! ordered pair. The later stages do not depend on the order of pairs or members.
use cubecl::prelude::*;

use crate::kernels::counters::{self, Counters};
use crate::kernels::detect::ordered_pair::{OrderedPairs, WORDS as PAIR_WORDS};
use crate::kernels::geometry::vector::{Row, V3, last, pick, row_of, v3, xyz, zero};
use crate::kernels::report::contact::Contacts;
use crate::kernels::report::wrench::Wrench;

/// Threads of a group.
pub const GROUP: u32 = 64;

/// Contacts as members of their pairs.
#[derive(CubeType, CubeLaunch)]
pub struct Members {
    /// Index of the contact for each member.
    pub contacts: Box<[u32]>,
    /// [`ROWS`] rows for each. At first: point and distance; force on the first instance, and size
    /// of the rounded numbers. Later: the wrench, whether it is kept, and the residual from the
    /// hull of the kept wrenches.
    pub rows: Box<[Row]>,
}

/// Rows of a member.
pub const ROWS: u32 = 4;

/// Pairs of instances that touch.
#[derive(CubeType, CubeLaunch)]
pub struct Touching {
    /// [`TOUCHING_WORDS`] words for each: instances of the first ordered pair, number of contacts,
    /// first member, number of kept contacts.
    pub words: Box<[u32]>,
    /// Capacity of the list.
    pub room: u32,
}

/// Words of a touching pair.
pub const TOUCHING_WORDS: u32 = 5;

/// The range of a touching pair's members.
#[derive(CubeType, Clone, Copy)]
#[expand(derive(Clone, Copy))]
pub struct Run {
    pub count: u32,
    pub first: u32,
    pub end: u32,
}

/// A point with its force, and the size of the numbers that were rounded to get them.
#[derive(CubeType, Clone, Copy)]
#[expand(derive(Clone, Copy))]
pub struct Placed {
    pub point: V3,
    pub distance: f32,
    pub force: V3,
    /// Magnitude of the numbers that were rounded.
    pub size: f32,
}

#[cube]
impl Touching {
    pub fn run(&self, pair: u32) -> Run {
        let at = (pair * TOUCHING_WORDS) as usize;
        let (count, first) = (self.words[at + 2], self.words[at + 3]);
        Run { count, first, end: first + count }
    }

    pub fn set_kept(&mut self, pair: u32, kept: u32) {
        self.words[(pair * TOUCHING_WORDS + 4u32) as usize] = kept;
    }
}

#[cube]
impl Members {
    pub fn point(&self, member: u32) -> V3 {
        xyz(self.rows[(member * ROWS) as usize])
    }

    pub fn placed(&self, member: u32) -> Placed {
        let at = (member * ROWS) as usize;
        let (p, q) = (self.rows[at], self.rows[at + 1]);
        Placed { point: xyz(p), distance: last(p), force: xyz(q), size: last(q) }
    }

    pub fn put(&mut self, member: u32, placed: Placed) {
        let at = (member * ROWS) as usize;
        self.rows[at] = row_of(placed.point, placed.distance);
        self.rows[at + 1] = row_of(placed.force, placed.size);
    }

    /// Replaces point and force by the wrench, and marks the member as not kept.
    pub fn put_wrench(&mut self, member: u32, w: Wrench) {
        let at = (member * ROWS) as usize;
        self.rows[at] = row_of(w.force, w.torque.x);
        self.rows[at + 1] = row_of(v3(w.torque.y, w.torque.z, 0.0f32), 0.0f32);
        self.rows[at + 2] = row_of(zero(), 0.0f32);
        self.rows[at + 3] = row_of(zero(), 0.0f32);
    }

    pub fn wrench(&self, member: u32) -> Wrench {
        self.wrench_at(member, 0u32)
    }

    /// The wrench of the residual.
    pub fn residual(&self, member: u32) -> Wrench {
        self.wrench_at(member, 2u32)
    }

    /// The rounding of the residual.
    pub fn rounding(&self, member: u32) -> f32 {
        self.rows[(member * ROWS + 3u32) as usize].extract(2usize)
    }

    pub fn put_residual(&mut self, member: u32, x: Wrench, rounding: f32) {
        let at = (member * ROWS) as usize;
        self.rows[at + 2] = row_of(x.force, x.torque.x);
        self.rows[at + 3] = row_of(v3(x.torque.y, x.torque.z, rounding), 0.0f32);
    }

    /// The wrench in the first six numbers of two rows.
    fn wrench_at(&self, member: u32, row: u32) -> Wrench {
        let at = (member * ROWS + row) as usize;
        let (p, q) = (self.rows[at], self.rows[at + 1]);
        Wrench { force: xyz(p), torque: v3(last(p), q.extract(0usize), q.extract(1usize)) }
    }

    /// Marks a member as kept.
    pub fn keep(&mut self, member: u32) {
        let at = (member * ROWS + 1u32) as usize;
        let row = self.rows[at];
        self.rows[at] = row_of(xyz(row), 1.0f32);
    }

    pub fn is_kept(&self, member: u32) -> bool {
        last(self.rows[(member * ROWS + 1u32) as usize]) > 0.5f32
    }
}

/// Sets one word per thread to zero.
#[cube(launch, create_dummy_kernel)]
pub fn clear(words: &mut [u32], count: u32) {
    let word = ABSOLUTE_POS as u32;
    if word < count {
        words[word as usize] = 0u32;
    }
}

/// Counts the contacts of each pair in `tallies`. A thread takes a contact.
#[cube(launch, create_dummy_kernel)]
pub fn count(contacts: &Contacts, counters: &Counters, tallies: &[Atomic<u32>]) {
    let contact = ABSOLUTE_POS as u32;
    if contact < counters.within(counters::CONTACTS, contacts.room) {
        tallies[(contacts.pair(contact) / 2u32) as usize].fetch_add(1u32);
        if !contacts.has_converged(contact) {
            counters.append(counters::UNCONVERGED);
        }
    }
}

/// Lists the touching pairs and allots a range of members to each. A thread takes a pair. The tally
/// of the pair becomes the index of its first member.
#[cube(launch, create_dummy_kernel)]
pub fn allot(pairs: &OrderedPairs, counters: &Counters, tallies: &mut [u32], touching: &mut Touching) {
    let pair = ABSOLUTE_POS as u32;
    if pair < (counters.within(counters::ORDERED_PAIRS, u32::MAX) / 2u32).min(touching.room) {
        let count = tallies[pair as usize];
        if count > 0u32 {
            let first = counters.add(counters::MEMBERS, count);
            let at = (counters.append(counters::TOUCHING) * TOUCHING_WORDS) as usize;
            let word = (2u32 * pair * PAIR_WORDS) as usize;
            touching.words[at] = pairs.words[word];
            touching.words[at + 1] = pairs.words[word + 1];
            touching.words[at + 2] = count;
            touching.words[at + 3] = first;
            touching.words[at + 4] = count;
            tallies[pair as usize] = first;
        }
    }
}

/// Writes the member of a contact. A thread takes a contact.
#[cube(launch, create_dummy_kernel)]
pub fn fill(
    pairs: &OrderedPairs,
    contacts: &Contacts,
    counters: &Counters,
    tallies: &[Atomic<u32>],
    members: &mut Members,
) {
    let contact = ABSOLUTE_POS as u32;
    if contact < counters.within(counters::CONTACTS, contacts.room) {
        let pair = contacts.pair(contact) / 2u32;
        let is_first = contacts.pair(contact) == 2u32 * pair;
        let first = pairs.get(2u32 * pair);
        let row = contacts.point_and_distance(contact);
        let (point, distance) = (xyz(row), last(row));
        let gradient = contacts.gradient(contact);
        // The field of the second ordered pair belongs to the instance that has the surface in the
        // first.
        let there = first.to_field(point);
        let far = (there - first.shift).length() + first.shift.length();
        let member = tallies[pair as usize].fetch_add(1u32);
        members.contacts[member as usize] = contact;
        let placed = Placed {
            point: pick(is_first, point, there),
            distance: select(is_first, distance, distance * first.scale),
            force: pick(is_first, gradient, first.rotate(gradient).negated()),
            size: select(is_first, point.length(), far),
        };
        members.put(member, placed);
    }
}
