//! The points of a pair's members: their box, their radius, and the contacts that a reduction keeps
//! first. These are the deepest contact, and the extremes along three axes.
use cubecl::prelude::*;
use tesdf::collide::internal;

use crate::kernels::geometry::vector::{LEAST_DIVISOR, V3, v3, zero};
use crate::kernels::report::contact::Contacts;
use crate::kernels::report::reduce::choice::{Chooser, Chosen, GROUP, nothing_chosen};
use crate::kernels::report::reduce::members::{Members, MembersExpand, Run};
use crate::kernels::scene::shape::NONE;

/// An axis has no extremes when the points extend along it by less than this fraction of their
/// radius.
const FLAT: f32 = internal::FLAT as f32;

// The scans over all members, in order: six for the box of the points, then one each for the
// largest rounded number and the deepest contact, then three for each axis.
const BOX_END: u32 = 6;
const SIZE: u32 = 6;
const DEEPEST: u32 = 7;
const FIRST_AXIS: u32 = 8;
const SECOND_AXIS: u32 = 11;
const THIRD_AXIS: u32 = 14;
const SCANS: u32 = 17;
/// The deepest contact, and two extremes for each axis.
pub const SEEDS: u32 = 7;

/// The points of a pair's members.
#[derive(CubeType, CubeTypeMut, Clone, Copy)]
#[expand(derive(Clone, Copy))]
pub struct Frame {
    low: V3,
    high: V3,
    /// Center of the box.
    pub center: V3,
    /// The axis along which the current scan compares points.
    along: V3,
    /// The earlier axes.
    first: V3,
    second: V3,
    /// The largest magnitude of the numbers that were rounded.
    pub size: f32,
    /// The greatest distance of a point from the center.
    pub radius: f32,
    /// Number of seeds: the contacts that are kept first.
    pub seeds: u32,
}

#[cube]
fn begin() -> Frame {
    Frame {
        low: zero(),
        high: zero(),
        center: zero(),
        along: v3(1.0f32, 0.0f32, 0.0f32),
        first: zero(),
        second: zero(),
        size: 0.0f32,
        radius: 0.0f32,
        seeds: 0u32,
    }
}

#[cube]
impl Frame {
    /// The component of `p` perpendicular to the earlier axes. An axis of zeros removes nothing.
    fn rest(self, p: V3) -> V3 {
        let once = p + self.first * -p.dot(self.first);
        once + self.second * -p.dot(self.second)
    }

    /// Takes the result of a scan for the box. The six scans go along x, against x, and so on.
    fn take_box(&mut self, scan: u32, key: f32) {
        self.high = v3(
            select(scan == 0u32, key, self.high.x),
            select(scan == 2u32, key, self.high.y),
            select(scan == 4u32, key, self.high.z),
        );
        self.low = v3(
            select(scan == 1u32, -key, self.low.x),
            select(scan == 3u32, -key, self.low.y),
            select(scan == 5u32, -key, self.low.z),
        );
        self.size = select(scan == SIZE, key, self.size);
        if scan < BOX_END {
            let turns = scan % 2u32 == 0u32;
            self.along = v3(
                select(turns, -self.along.x, 0.0f32),
                select(turns, -self.along.y, select(scan == 1u32, 1.0f32, 0.0f32)),
                select(turns, -self.along.z, select(scan == 3u32, 1.0f32, 0.0f32)),
            );
            let share = select(scan + 1u32 == BOX_END, 0.5f32, 0.0f32);
            self.center = (self.low + self.high) * share;
        }
    }

    /// Adds a seed if it is new, and turns to the other end of the axis.
    fn take_seed(&mut self, member: u32, seeds: &mut Shared<[u32]>) {
        let mut is_new = true;
        let mut k = 0u32;
        while k < self.seeds {
            is_new = is_new && seeds[k as usize] != member;
            k += 1u32;
        }
        if is_new {
            if UNIT_POS == 0u32 {
                seeds[self.seeds as usize] = member;
            }
            self.seeds += 1u32;
        }
        self.along = self.along.negated();
    }

    /// Takes the axis through the point that is farthest from the earlier axes. `reach` is the
    /// vector to it from the center. Returns whether the points extend far enough along the axis.
    fn take_axis(&mut self, scan: u32, reach: V3) -> bool {
        let long = reach.length();
        let is_first = scan == FIRST_AXIS;
        self.radius = select(is_first, long, self.radius);
        self.along = reach * (1.0f32 / long.max(LEAST_DIVISOR));
        if is_first {
            self.first = self.along;
        }
        if scan == SECOND_AXIS {
            self.second = self.along;
        }
        long > FLAT * self.radius
    }
}

#[cube]
impl Members {
    /// The member of this thread with the greatest key in a scan.
    fn greatest(&self, contacts: &Contacts, run: Run, frame: Frame, scan: u32, is_axis: bool) -> Chosen {
        let mut found = nothing_chosen();
        let mut i = run.first + UNIT_POS;
        while i < run.end {
            let placed = self.placed(i);
            let p = placed.point - frame.center;
            let rest = frame.rest(p);
            let mut key = select(is_axis, rest.dot(rest), p.dot(frame.along));
            key = select(scan == SIZE, placed.size, key);
            key = select(scan == DEEPEST, -placed.distance, key);
            let this = Chosen { key, member: i };
            if self.wins(contacts, this, found) {
                found = Chosen { key, member: i };
            }
            i += GROUP;
        }
        found
    }

    /// The frame of a run of members, and its seeds. All threads of the group must call it.
    pub fn frame(
        &self,
        contacts: &Contacts,
        run: Run,
        reduces: bool,
        chooser: &mut Chooser,
        seeds: &mut Shared<[u32]>,
    ) -> Frame {
        let mut frame = begin();
        let mut scan = 0u32;
        while scan < SCANS {
            let is_axis = scan == FIRST_AXIS || scan == SECOND_AXIS || scan == THIRD_AXIS;
            let mine = self.greatest(contacts, run, frame, scan, is_axis);
            let found = self.best(contacts, chooser, mine);
            frame.take_box(scan, found.key);
            if scan >= DEEPEST && !is_axis && found.member != NONE {
                frame.take_seed(found.member, seeds);
            }
            let mut ends = false;
            if is_axis {
                let mut reach = zero();
                if found.member != NONE {
                    reach = frame.rest(self.point(found.member) - frame.center);
                }
                ends = !frame.take_axis(scan, reach) || !reduces;
            }
            scan = select(ends, SCANS, scan + 1u32);
        }
        frame
    }
}
