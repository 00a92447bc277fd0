//! The threads of a group exchange values. They use shuffles where a subgroup has 32 threads, and
//! otherwise shared memory. Both give the same bits.
use cubecl::prelude::*;

use crate::kernels::query::nearest::Nearest;

/// Threads that work on one polygon.
pub const LANES: u32 = 32;

/// A variant of the kernels of Face-TES.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Variant {
    /// Threads that share a polygon: [`LANES`] or 1.
    pub lanes: u32,
    /// Whether the threads exchange values by shuffles.
    pub subgroups: bool,
    /// Whether the kernel counts evaluations.
    pub counting: bool,
}

/// Shared memory for an exchange.
#[derive(CubeType)]
pub struct Exchange {
    numbers: Shared<[f32]>,
    faces: Shared<[u32]>,
    #[cube(comptime)]
    pub variant: Variant,
}

#[cube]
pub fn exchange(#[comptime] variant: Variant) -> Exchange {
    Exchange {
        numbers: Shared::<[f32]>::new_slice(LANES as usize),
        faces: Shared::<[u32]>::new_slice(LANES as usize),
        variant,
    }
}

#[cube]
impl Exchange {
    /// The nearest face of `width` neighbouring threads of a group. `width` is a power of two. At
    /// equal distances, the face with the lowest index.
    pub fn least(&mut self, mine: Nearest, width: u32) -> Nearest {
        let mut found = mine;
        if comptime!(self.variant.lanes > 1) {
            if comptime!(self.variant.subgroups) {
                found = least_of_subgroup(mine, width);
            } else {
                found = self.least_in_memory(mine, width);
            }
        }
        found
    }

    fn least_in_memory(&mut self, mine: Nearest, width: u32) -> Nearest {
        // Wait until all threads have read the last result.
        sync_cube();
        self.numbers[UNIT_POS as usize] = mine.squared;
        self.faces[UNIT_POS as usize] = mine.face;
        sync_cube();
        let mut found = mine;
        let mut i = UNIT_POS / width * width;
        let end = i + width;
        while i < end {
            found = found.or(Nearest { squared: self.numbers[i as usize], face: self.faces[i as usize] });
            i += 1u32;
        }
        found
    }

    /// The value of a thread of the group.
    pub fn of_lane(&mut self, mine: f32, lane: u32) -> f32 {
        let mut value = mine;
        if comptime!(self.variant.lanes > 1) {
            if comptime!(self.variant.subgroups) {
                value = plane_shuffle(mine, lane);
            } else {
                sync_cube();
                self.numbers[UNIT_POS as usize] = mine;
                sync_cube();
                value = self.numbers[lane as usize];
            }
        }
        value
    }
}

/// The same by shuffles. It is unrolled: with the loops of CubeCL's own minimum of a subgroup,
/// these took a fifth of the instructions of an evaluation.
#[cube]
fn least_of_subgroup(mine: Nearest, width: u32) -> Nearest {
    let mut squared = mine.squared;
    #[unroll]
    for k in 0..5u32 {
        let other = plane_shuffle_xor(squared, comptime!(1u32 << k));
        squared = select(comptime!(1u32 << k) < width, squared.min(other), squared);
    }
    let mut face = select(squared == mine.squared, mine.face, u32::MAX.runtime());
    #[unroll]
    for k in 0..5u32 {
        let other = plane_shuffle_xor(face, comptime!(1u32 << k));
        face = select(comptime!(1u32 << k) < width, face.min(other), face);
    }
    Nearest { squared, face }
}

/// Number of threads that share a point: enough for one face of the list each, up to the whole
/// group. At least four threads share a point, so that the group evaluates eight vertices at most.
#[cube]
pub fn width_for(count: u32) -> u32 {
    select(count <= 4u32, 4u32, select(count <= 8u32, 8u32, select(count <= 16u32, 16u32, LANES)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn groups_are_shared_by_eight_points_at_most() {
        for count in 0..100 {
            let width = width_for(count);
            assert!(width.is_power_of_two() && LANES / width <= 8);
            assert!(width >= count.min(LANES), "{width} threads for {count} faces");
            assert!(width == 4 || width / 2 < count, "{width} threads for {count} faces");
        }
    }
}
