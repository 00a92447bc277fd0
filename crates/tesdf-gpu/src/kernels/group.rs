//! What threads of a group tell each other: with planes of 32 threads by shuffles, else through shared memory; the result is the same bits.
use cubecl::prelude::*;

use super::narrow::LANES;
use super::nearest::Nearest;

/// The least over `width` neighbouring threads of a group, a power of two; of equal ones the lowest face.
#[cube]
pub fn least(
    mine: Nearest,
    width: u32,
    squares: &mut Shared<[f32]>,
    faces: &mut Shared<[u32]>,
    #[comptime] lanes: u32,
    #[comptime] planes: bool,
) -> Nearest {
    let mut squared = mine.squared;
    let mut position = mine.face;
    if lanes > 1u32 {
        if planes {
            // Unrolled, which the planes' own minimum is not: a fifth of an evaluation's instructions were its loops.
            #[unroll]
            for k in 0..5u32 {
                let other = plane_shuffle_xor(squared, comptime!(1u32 << k));
                squared = select(comptime!(1u32 << k) < width, squared.min(other), squared);
            }
            position = select(squared == mine.squared, position, u32::MAX.runtime());
            #[unroll]
            for k in 0..5u32 {
                let other = plane_shuffle_xor(position, comptime!(1u32 << k));
                position = select(comptime!(1u32 << k) < width, position.min(other), position);
            }
        } else {
            // Nobody writes while another still reads the last result.
            sync_cube();
            squares[UNIT_POS as usize] = squared;
            faces[UNIT_POS as usize] = position;
            sync_cube();
            let mut i = UNIT_POS / width * width;
            let end = i + width;
            while i < end {
                let (d, f) = (squares[i as usize], faces[i as usize]);
                let nearer = d < squared || (d == squared && f < position);
                squared = select(nearer, d, squared);
                position = select(nearer, f, position);
                i += 1u32;
            }
        }
    }
    Nearest { squared, face: position }
}

/// What a thread of the group has.
#[cube]
pub fn of_lane(
    mine: f32,
    lane: u32,
    values: &mut Shared<[f32]>,
    #[comptime] lanes: u32,
    #[comptime] planes: bool,
) -> f32 {
    let mut value = mine;
    if lanes > 1u32 {
        if planes {
            value = plane_shuffle(mine, lane);
        } else {
            sync_cube();
            values[UNIT_POS as usize] = mine;
            sync_cube();
            value = values[lane as usize];
        }
    }
    value
}

/// How many threads share a point: as many as its list has faces, at least as many as leave a part of the group for each of eight vertices.
#[cube]
pub fn width_for(count: u32) -> u32 {
    select(count <= 4u32, 4u32, select(count <= 8u32, 8u32, select(count <= 16u32, 16u32, LANES)))
}
