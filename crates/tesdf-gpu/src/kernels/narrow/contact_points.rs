//! The points of a face that were taken as contacts, and the memory of the group that takes them.
use cubecl::prelude::*;
use tesdf::collide::internal;

use crate::kernels::geometry::vector::{V3, zero};
use crate::kernels::narrow::tree_walk::Walk;
use crate::kernels::query::nearest::FAR;
use crate::kernels::query::value::Value;
use crate::kernels::scene::shape::NONE;
use crate::kernels::search::piece::Pool;

/// Number of directions in the plane of a face. Each has a slot for what was taken.
pub const DIRECTIONS: u32 = internal::DIRECTIONS as u32;
/// The slot of the minimum, ...
pub const MINIMUM: u32 = DIRECTIONS;
/// ... and that of what stands out between the first extreme and the second one.
pub const BETWEEN: u32 = MINIMUM + 1;
/// Number of slots.
const SLOTS: u32 = BETWEEN + DIRECTIONS;
/// Points that are nearer to each other (local frame) are the same. The processor compares bits.
pub const SAME: f32 = 2e-6;

/// A point of a face that is a contact, if `is_taken`.
#[derive(CubeType, CubeTypeMut, Clone, Copy)]
#[expand(derive(Clone, Copy))]
pub struct Taken {
    pub point: V3,
    pub value: Value,
    pub cell: u32,
    /// The corner of the face that the point is, or
    /// [`NO_CORNER`](crate::kernels::report::contact::NO_CORNER).
    pub corner: u32,
    pub is_taken: bool,
}

/// A point before its field is known.
#[cube]
pub fn nothing_at(point: V3, corner: u32) -> Taken {
    let value = Value {
        distance: FAR.runtime(),
        gradient: zero(),
        point: zero(),
        face: 0u32.runtime(),
        feature: 0u32.runtime(),
    };
    Taken { point, value, cell: NONE.runtime(), corner, is_taken: false }
}

/// The points that were taken.
#[derive(CubeType)]
pub struct Points {
    numbers: Shared<[f32]>,
    /// The round in which each was taken, from 1; 0 for none.
    rounds: Shared<[u32]>,
}

/// The memory of a group for the contacts of a face.
#[derive(CubeType)]
pub struct Memory {
    pub pool: Pool,
    pub walk: Walk,
    pub points: Points,
}

#[cube]
pub fn memory_of(pool: Pool, walk: Walk) -> Memory {
    Memory {
        pool,
        walk,
        points: Points {
            numbers: Shared::<[f32]>::new_slice(comptime!(3 * SLOTS as usize)),
            rounds: Shared::<[u32]>::new_slice(comptime!(SLOTS as usize)),
        },
    }
}

#[cube]
impl Points {
    pub fn clear(&mut self) {
        sync_cube();
        if UNIT_POS < SLOTS {
            self.rounds[UNIT_POS as usize] = 0u32;
        }
        sync_cube();
    }

    pub fn get(&self, slot: u32) -> V3 {
        let at = (3u32 * slot) as usize;
        V3 { x: self.numbers[at], y: self.numbers[at + 1usize], z: self.numbers[at + 2usize] }
    }

    /// Shows the point that this thread has taken, if any. All threads of the group must call it.
    pub fn put(&mut self, slot: u32, round: u32, taken: Taken) {
        sync_cube();
        if taken.is_taken && UNIT_POS < DIRECTIONS {
            let at = (3u32 * slot) as usize;
            self.numbers[at] = taken.point.x;
            self.numbers[at + 1usize] = taken.point.y;
            self.numbers[at + 2usize] = taken.point.z;
            self.rounds[slot as usize] = round;
        }
        sync_cube();
    }

    /// The next direction with a point after this one; this one, where it has none or there is no
    /// other.
    pub fn next(&self, direction: u32) -> u32 {
        let mut next = direction;
        let mut k = 1u32;
        while k < DIRECTIONS {
            let other = (direction + k) % DIRECTIONS;
            let is_taken = self.rounds[other as usize] > 0u32;
            next = select(next == direction && is_taken, other, next);
            k += 1u32;
        }
        select(self.rounds[direction as usize] > 0u32, next, direction)
    }

    /// Whether no other point that was taken is the same: neither in an earlier round, nor for a
    /// lower slot of this round.
    pub fn is_new(&self, own: u32, round: u32, taken: Taken) -> bool {
        let mut new = true;
        let mut slot = 0u32;
        while slot < SLOTS {
            let when = self.rounds[slot as usize];
            let is_before = when > 0u32 && (when < round || slot < own);
            let away = (self.get(slot) - taken.point).length();
            new = new && !(is_before && away <= SAME);
            slot += 1u32;
        }
        new
    }
}
