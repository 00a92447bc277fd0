//! Keeps a few contacts of each pair of instances that can apply nearly the same wrenches as all
//! contacts. A group takes a touching pair.
//!
//! In: the members of pairs. Out: the kept contacts in any order, and for each pair a bound on the
//! lost wrench. The rules are those of `tesdf::collide`: keep the deepest contact and the extremes
//! along three axes; then repeatedly add the contact whose wrench is farthest from the hull of the
//! kept wrenches. Here each thread shortens the residuals of its own members. Lengths of residuals,
//! which bound the distances from above, replace the distances. The longest residuals are shortened
//! again before they count.
//!
//! The result does not depend on the order of members. Among equal members, the one with the lowest
//! name is taken. The computation for a member depends on this member, on the kept members, and on
//! the greatest length of all.
//!
//! Mirrors `collide/report/reduce/selection.rs` of `tesdf`.
use cubecl::prelude::*;

use crate::kernels::counters::{self, Counters};
use crate::kernels::geometry::vector::{LEAST_DIVISOR, Row, row, row_of};
use crate::kernels::report::contact::Contacts;
use crate::kernels::report::hull::{Hull, VERTICES, empty_hull};
use crate::kernels::report::reduce::choice::{Chosen, GROUP, chooser, nothing_chosen};
use crate::kernels::report::reduce::frame::{Frame, SEEDS};
use crate::kernels::report::reduce::members::{Members, MembersExpand, Run, Touching};
use crate::kernels::report::wrench::{Residual, Wrench, pick_wrench};
use crate::kernels::scene::shape::NONE;

/// When all points are closer to their center than this fraction of the rounded numbers, there is
/// no length for torques.
const LEAST_LENGTH: f32 = 1e-4;
/// Error of a wrench by the rounding of poses and points, relative to 1 + size / length.
const POINT_ROUNDING: f32 = 4e-6;
/// A distance below this may be a rounding error. The processor computes in `f64` and uses 1e-12
/// (`ROUNDING` in `tesdf::collide::hull`).
const ROUNDING: f32 = 2e-6;
/// Residuals of at least this fraction of the longest are shortened before the longest is used.
const NEARLY_LONGEST: f32 = 0.8;
/// Largest number of rounds for each kept contact.
const ROUNDS: u32 = 4;
/// Largest number of rounds at the end. They stop early when the square of the longest residual
/// stays above `SETTLED` times its previous value.
const LAST_ROUNDS: u32 = 16;
const SETTLED: f32 = 0.95;

// The scans over all members. `ADD`: shorten all residuals toward the newest vertex. `SHORTEN`:
// shorten the longest residuals toward all vertices. `MEASURE`: compute the error.
const ADD: u32 = 0;
const SHORTEN: u32 = 1;
const MEASURE: u32 = 2;
const END: u32 = 3;

/// Rows of a report: center and length, in the frame of the members; then the error.
pub const REPORT_ROWS: u32 = 2;

/// The state of the reduction of a pair.
#[derive(CubeType, CubeTypeMut, Clone, Copy)]
#[expand(derive(Clone, Copy))]
struct Progress {
    /// [`ADD`], [`SHORTEN`], [`MEASURE`] or [`END`].
    stage: u32,
    /// The member to add next.
    next: u32,
    /// Number of seeds that were added.
    seeds: u32,
    rounds: u32,
    /// Number of kept members.
    kept: u32,
    /// The square of the longest residual in the previous scan.
    longest: f32,
    error: f32,
}

#[cube]
impl Progress {
    /// Residuals with a smaller square are not shortened.
    fn threshold(self) -> f32 {
        NEARLY_LONGEST * NEARLY_LONGEST * self.longest
    }

    /// Selects the next stage from the longest residual that a scan has found.
    fn follow(&mut self, found: Chosen, frame: Frame, seeds: &Shared<[u32]>, per_pair: u32) {
        let has_room = self.kept < per_pair;
        let is_seed = self.stage == ADD && self.seeds < frame.seeds && has_room;
        let is_whole = found.member == NONE || found.key <= ROUNDING * ROUNDING;
        // Residuals below the threshold were not shortened, so one of them may now be the longest.
        let least = select(has_room, self.threshold(), SETTLED * self.longest);
        let is_last = self.rounds == select(has_room, ROUNDS, LAST_ROUNDS);
        let is_sure = self.stage == SHORTEN && (found.key >= least || is_last);
        let is_done = is_whole || (is_sure && !has_room);
        let mut following = select(is_sure, ADD, SHORTEN);
        following = select(is_done, MEASURE, following);
        following = select(is_seed, ADD, following);
        following = select(self.stage == MEASURE, END, following);
        self.error = found.key;
        self.longest = found.key;
        self.rounds = select(following == SHORTEN, self.rounds + 1u32, 0u32);
        self.next = found.member;
        if is_seed {
            self.next = seeds[self.seeds as usize];
            self.seeds += 1u32;
        }
        self.stage = following;
    }
}

#[cube]
impl Members {
    /// Replaces points and forces by wrenches. Torques are divided by `length`.
    fn write_wrenches(&mut self, run: Run, frame: Frame, length: f32) {
        // When all points coincide, there is no length, and the torques are 0.
        let inverse = select(length > 0.0f32, 1.0f32 / length.max(LEAST_DIVISOR), 0.0f32);
        // Wait until all threads have read the points.
        sync_cube();
        let mut i = run.first + UNIT_POS;
        while i < run.end {
            let placed = self.placed(i);
            let arm = (placed.point - frame.center) * inverse;
            self.put_wrench(i, Wrench { force: placed.force, torque: arm.cross(placed.force) });
            i += GROUP;
        }
    }

    /// Keeps a member, and makes its wrench a vertex of the hull.
    fn add(&mut self, run: Run, member: u32, kept: u32, hull: &mut Hull) {
        // The thread of this member has written its rows.
        if (member - run.first) % GROUP == UNIT_POS {
            self.keep(member);
            hull.add(kept, self.wrench(member));
        }
    }

    /// Shortens the residuals of this thread's members, and returns the longest.
    fn shorten(&mut self, contacts: &Contacts, run: Run, hull: &Hull, progress: Progress) -> Chosen {
        let newest = hull.newest();
        let held = progress.kept.min(VERTICES);
        let adds = progress.stage == ADD;
        let mut found = nothing_chosen();
        let mut i = run.first + UNIT_POS;
        while i < run.end {
            let w = self.wrench(i);
            let to_newest = w - newest;
            let is_first = progress.kept == 1u32 && adds;
            let start = pick_wrench(is_first, to_newest, self.residual(i));
            let mut x = Residual { wrench: start, rounding: self.rounding(i) };
            let shortens = progress.stage == SHORTEN && start.dot(start) >= progress.threshold();
            if adds {
                x = x.shortened(to_newest, to_newest);
            }
            if shortens {
                x = hull.shortened(x, w, to_newest, held);
            }
            let square = x.wrench.dot(x.wrench);
            if adds || shortens {
                self.put_residual(i, x.wrench, x.rounding);
            }
            let key = select(progress.stage == MEASURE, square.sqrt() + x.rounding, square);
            if self.wins(contacts, Chosen { key, member: i }, found) {
                found = Chosen { key, member: i };
            }
            i += GROUP;
        }
        found
    }

    /// Copies the contacts of the kept members, or of all members when `all` is true.
    fn write_kept(&self, contacts: &Contacts, run: Run, all: bool, counters: &Counters, kept: &mut Contacts) {
        let mut i = run.first + UNIT_POS;
        while i < run.end {
            if all || self.is_kept(i) {
                let at = counters.append(counters::KEPT);
                if at < kept.room {
                    kept.copy(at, contacts, self.contacts[i as usize]);
                }
            }
            i += GROUP;
        }
    }
}

/// Reduces the contacts of a touching pair per group. A pair with at most `per_pair` contacts keeps
/// all of them.
#[cube(launch, create_dummy_kernel)]
pub fn reduce(
    contacts: &Contacts,
    counters: &Counters,
    touching: &mut Touching,
    members: &mut Members,
    reports: &mut [Row],
    kept: &mut Contacts,
    per_pair: u32,
) {
    let mut chooser = chooser();
    let mut hull = empty_hull();
    let mut seeds = Shared::<[u32]>::new_slice(SEEDS as usize);
    let pair = CUBE_POS as u32;
    let pairs = counters.within(counters::TOUCHING, touching.room);
    if pair < pairs {
        let run = touching.run(pair);
        let reduces = run.count > per_pair;
        let frame = members.frame(contacts, run, reduces, &mut chooser, &mut seeds);
        let length = frame.radius.max(LEAST_LENGTH * frame.size);
        let mut number = select(reduces, 0u32, run.count);
        let mut error = 0.0f32;
        if reduces {
            members.write_wrenches(run, frame, length);
            let mut progress = Progress {
                stage: ADD.runtime(),
                next: seeds[0],
                seeds: 1u32,
                rounds: 0u32,
                kept: 0u32,
                longest: 0.0f32,
                error: 0.0f32,
            };
            while progress.stage != END {
                if progress.stage == ADD {
                    members.add(run, progress.next, progress.kept, &mut hull);
                    progress.kept += 1u32;
                }
                sync_cube();
                let mine = members.shorten(contacts, run, &hull, progress);
                let found = members.best(contacts, &mut chooser, mine);
                progress.follow(found, frame, &seeds, per_pair);
            }
            number = progress.kept;
            let rounding = POINT_ROUNDING * (1.0f32 + frame.size / length.max(LEAST_DIVISOR));
            error = progress.error.max(0.0f32) * 1.000_001_f32 + rounding;
        }
        members.write_kept(contacts, run, !reduces, counters, kept);
        if UNIT_POS == 0u32 {
            touching.set_kept(pair, number);
            let report = (pair * REPORT_ROWS) as usize;
            reports[report] = row_of(frame.center, length);
            reports[report + 1] = row(error, 0.0f32, 0.0f32, 0.0f32);
        }
        counters.tell_if_broken_off(pairs);
    }
}
