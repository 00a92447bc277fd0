//! Values that the threads of a group exchange: by shuffles where 32 threads are a subgroup, else through shared memory.
//! The result is the same bits.
use cubecl::prelude::*;

use super::super::field::nearest::Nearest;

/// Threads that work on one polygon.
pub const LANES: u32 = 32;

/// How a polygon is worked on.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Variant {
    /// Threads that share a polygon: [`LANES`] or 1.
    pub lanes: u32,
    /// Whether they exchange values by shuffles.
    pub subgroups: bool,
    /// Whether evaluations are counted.
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
    /// The nearest over `width` neighbouring threads of a group, a power of two; of equal ones the lowest face.
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
        // Nobody writes while another still reads the last result.
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

/// Unrolled, which CubeCL's minimum of a subgroup is not: a fifth of an evaluation's instructions were its loops.
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

/// How many threads share a point: as many as its list has faces, at least as many as leave a part of the group for each
/// of eight vertices.
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
