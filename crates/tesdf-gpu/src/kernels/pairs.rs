//! Instance pairs: those of one world whose bounds meet, as `tesdf::collide::instance_pairs` finds them.
use cubecl::prelude::*;

use super::assets::{
    Assets, BAD_VERTEX, HIGH, KIND, LOW, MESH, MESHLET_COUNT, NONE, PLANE, ROUND, SIZES, entry, number,
    vector,
};
use super::pose::{Pose, ROWS as POSE_ROWS, difference, pose, turn, turn_back};
use super::products::{BADLY_MOVED, BLOCKS, DIRECTION_ROWS, DIRECTION_WORDS, DIRECTIONS, PAIR_WORDS};
use super::vector::{V3, length, minus, pick, plus, scaled, v3};

/// Rows of an instance: its pose, with the motion ahead behind the second row.
pub const INSTANCE_ROWS: usize = POSE_ROWS;
/// Rows of its bounds: their middle as a sum of two, half their extent.
pub const BOUNDS_ROWS: usize = 3;
/// Words of an instance: shape, end of its world, memberships, filter.
pub const INSTANCE_WORDS: usize = 4;
/// Meshlets that a group of the next stage takes.
const MESHLETS_OF_BLOCK: u32 = 32;

#[cube]
fn row3(rows: &[Vector<f32, Const<4>>], at: u32) -> V3 {
    let r = rows[at as usize];
    v3(r.extract(0usize), r.extract(1usize), r.extract(2usize))
}

/// Whether two sorted numbers are in the list of pairs that never meet.
#[cube]
fn is_excluded(excluded: &[u32], count: u32, a: u32, b: u32) -> bool {
    let mut low = 0u32;
    let mut high = count;
    let mut found = false;
    while low < high {
        let middle = (low + high) / 2u32;
        let x = excluded[(2u32 * middle) as usize];
        let y = excluded[(2u32 * middle + 1u32) as usize];
        let is_less = x < a || (x == a && y < b);
        found = found || (x == a && y == b);
        low = select(is_less, middle + 1u32, low);
        high = select(is_less, high, middle);
    }
    found
}

/// How far the velocity can take a point of an instance.
#[cube]
fn motion(rows: &[Vector<f32, Const<4>>], instance: u32) -> f32 {
    rows[(instance * comptime!(INSTANCE_ROWS as u32) + 1u32) as usize].extract(3usize)
}

/// Half the extent of what has no end.
const ENDLESS: f32 = 1e30;

/// What half an extent is grown by, relative to it and to the way from the field's origin to the middle: more than rounding takes away.
const GROWN: f32 = 2e-6;

/// A thread for each instance: its bounds in the world, grown by its motion ahead and half the contact distance. Counts those of shapes with a vertex where none can be.
#[cube(launch, create_dummy_kernel)]
pub fn instance_bounds(
    assets: &Assets,
    rows: &[Vector<f32, Const<4>>],
    words: &[u32],
    counters: &[Atomic<u32>],
    bounds: &mut [Vector<f32, Const<4>>],
    instances: u32,
    contact_distance: f32,
) {
    let i = ABSOLUTE_POS as u32;
    if i < instances {
        let first = i * comptime!(INSTANCE_ROWS as u32);
        let shape = words[(i * comptime!(INSTANCE_WORDS as u32)) as usize];
        let kind = entry(assets, shape, KIND);
        let sizes = vector(assets, shape, SIZES);
        let low = vector(assets, shape, LOW);
        let high = vector(assets, shape, HIGH);
        let is_mesh = kind == MESH;
        let round = v3(sizes.y, sizes.y, sizes.x + sizes.y);
        let simple = pick(kind == ROUND, round, sizes);
        let middle = pick(is_mesh, scaled(0.5f32, plus(low, high)), v3(0.0f32, 0.0f32, 0.0f32));
        let half = pick(is_mesh, scaled(0.5f32, minus(high, low)), simple);
        let at = pose(rows, first as usize);
        let ahead = motion(rows, i);
        let off = turn(at.axis, at.scalar, scaled(at.unit, middle));
        let x = turn(at.axis, at.scalar, v3(at.unit * half.x, 0.0f32, 0.0f32));
        let y = turn(at.axis, at.scalar, v3(0.0f32, at.unit * half.y, 0.0f32));
        let z = turn(at.axis, at.scalar, v3(0.0f32, 0.0f32, at.unit * half.z));
        let reach = v3(
            x.x.abs() + y.x.abs() + z.x.abs(),
            x.y.abs() + y.y.abs() + z.y.abs(),
            x.z.abs() + y.z.abs() + z.z.abs(),
        );
        let more = GROWN * (length(off) + length(reach)) + 0.5f32 * contact_distance + ahead;
        let endless = kind == PLANE;
        let from_low = plus(at.low, off);
        let to = (i * comptime!(BOUNDS_ROWS as u32)) as usize;
        bounds[to] = four(at.high.x, at.high.y, at.high.z, 0.0f32);
        bounds[to + 1] = four(from_low.x, from_low.y, from_low.z, 0.0f32);
        bounds[to + 2] = four(
            select(endless, ENDLESS, reach.x + more),
            select(endless, ENDLESS, reach.y + more),
            select(endless, ENDLESS, reach.z + more),
            0.0f32,
        );
        if entry(assets, shape, BAD_VERTEX) != NONE {
            counters[BADLY_MOVED as usize].fetch_add(1u32);
        }
    }
}

/// A thread for each instance looks at all later ones of its world.
#[cube(launch, create_dummy_kernel)]
pub fn instance_pairs(
    assets: &Assets,
    rows: &[Vector<f32, Const<4>>],
    bounds: &[Vector<f32, Const<4>>],
    words: &[u32],
    excluded: &[u32],
    counters: &[Atomic<u32>],
    directions: &mut [u32],
    maps: &mut [Vector<f32, Const<4>>],
    blocks: &mut [u32],
    instances: u32,
    exclusions: u32,
    contact_distance: f32,
    most_directions: u32,
    most_blocks: u32,
) {
    let i = ABSOLUTE_POS as u32;
    if i < instances {
        let i_rows = i * comptime!(BOUNDS_ROWS as u32);
        let i_words = i * comptime!(INSTANCE_WORDS as u32);
        let shape = words[i_words as usize];
        let end = words[(i_words + 1u32) as usize];
        let memberships = words[(i_words + 2u32) as usize];
        let filter = words[(i_words + 3u32) as usize];
        let is_plane = entry(assets, shape, KIND) == PLANE;
        let middle = row3(bounds, i_rows);
        let low = row3(bounds, i_rows + 1u32);
        let half = row3(bounds, i_rows + 2u32);
        let mut j = i + 1u32;
        while j < end {
            let j_rows = j * comptime!(BOUNDS_ROWS as u32);
            let j_words = j * comptime!(INSTANCE_WORDS as u32);
            let other = words[j_words as usize];
            let j_memberships = words[(j_words + 2u32) as usize];
            let j_filter = words[(j_words + 3u32) as usize];
            let apart = difference(row3(bounds, j_rows), row3(bounds, j_rows + 1u32), middle, low);
            let j_half = row3(bounds, j_rows + 2u32);
            let overlap = apart.x.abs() <= half.x + j_half.x
                && apart.y.abs() <= half.y + j_half.y
                && apart.z.abs() <= half.z + j_half.z;
            let meet = (memberships & j_filter) != 0u32 && (j_memberships & filter) != 0u32;
            let planes = is_plane && entry(assets, other, KIND) == PLANE;
            if overlap && meet && !planes && !is_excluded(excluded, exclusions, i, j) {
                write_pair(
                    assets,
                    rows,
                    words,
                    counters,
                    directions,
                    maps,
                    blocks,
                    i,
                    j,
                    contact_distance,
                    most_directions,
                    most_blocks,
                );
            }
            j += 1u32;
        }
    }
}

/// A thread for each pair that was found elsewhere, of places of instances.
#[cube(launch, create_dummy_kernel)]
pub fn given_pairs(
    assets: &Assets,
    rows: &[Vector<f32, Const<4>>],
    words: &[u32],
    pairs: &[u32],
    counters: &[Atomic<u32>],
    directions: &mut [u32],
    maps: &mut [Vector<f32, Const<4>>],
    blocks: &mut [u32],
    count: u32,
    contact_distance: f32,
    most_directions: u32,
    most_blocks: u32,
) {
    let pair = ABSOLUTE_POS as u32;
    if pair < count {
        write_pair(
            assets,
            rows,
            words,
            counters,
            directions,
            maps,
            blocks,
            pairs[(2u32 * pair) as usize],
            pairs[(2u32 * pair + 1u32) as usize],
            contact_distance,
            most_directions,
            most_blocks,
        );
    }
}

/// Both directions of a pair, and their blocks.
#[cube]
fn write_pair(
    assets: &Assets,
    rows: &[Vector<f32, Const<4>>],
    words: &[u32],
    counters: &[Atomic<u32>],
    directions: &mut [u32],
    maps: &mut [Vector<f32, Const<4>>],
    blocks: &mut [u32],
    i: u32,
    j: u32,
    contact_distance: f32,
    most_directions: u32,
    most_blocks: u32,
) {
    let i_rows = i * comptime!(INSTANCE_ROWS as u32);
    let j_rows = j * comptime!(INSTANCE_ROWS as u32);
    let shape = words[(i * comptime!(INSTANCE_WORDS as u32)) as usize];
    let other = words[(j * comptime!(INSTANCE_WORDS as u32)) as usize];
    let distance = contact_distance + motion(rows, i) + motion(rows, j);
    let pose_i = pose(rows, i_rows as usize);
    let pose_j = pose(rows, j_rows as usize);
    let at = counters[DIRECTIONS as usize].fetch_add(2u32);
    if at + 2u32 <= most_directions {
        write_direction(assets, directions, maps, at, i, j, shape, other, pose_i, pose_j, distance);
        write_direction(assets, directions, maps, at + 1u32, j, i, other, shape, pose_j, pose_i, distance);
        write_blocks(assets, counters, blocks, at, shape, most_blocks);
        write_blocks(assets, counters, blocks, at + 1u32, other, most_blocks);
    }
}

#[cube]
fn write_blocks(
    assets: &Assets,
    counters: &[Atomic<u32>],
    blocks: &mut [u32],
    direction: u32,
    shape: u32,
    most: u32,
) {
    let count = (entry(assets, shape, MESHLET_COUNT) + MESHLETS_OF_BLOCK - 1u32) / MESHLETS_OF_BLOCK;
    let first = counters[BLOCKS as usize].fetch_add(count);
    let mut k = 0u32;
    while k < count {
        let at = first + k;
        if at < most {
            blocks[(at * comptime!(PAIR_WORDS as u32)) as usize] = direction;
            blocks[(at * comptime!(PAIR_WORDS as u32) + 1u32) as usize] = k * MESHLETS_OF_BLOCK;
        }
        k += 1u32;
    }
}

/// Surface of `a` against the field of `b`: field = linear · p + shift.
#[cube]
fn write_direction(
    assets: &Assets,
    directions: &mut [u32],
    maps: &mut [Vector<f32, Const<4>>],
    at: u32,
    a: u32,
    b: u32,
    shape_a: u32,
    shape_b: u32,
    of_a: Pose,
    of_b: Pose,
    contact_distance: f32,
) {
    let words = (at * comptime!(DIRECTION_WORDS as u32)) as usize;
    directions[words] = a;
    directions[words + 1usize] = b;
    directions[words + 2usize] = shape_a;
    directions[words + 3usize] = shape_b;
    let scale = of_a.unit / of_b.unit;
    let x = column(of_a, of_b, scale, v3(1.0f32, 0.0f32, 0.0f32));
    let y = column(of_a, of_b, scale, v3(0.0f32, 1.0f32, 0.0f32));
    let z = column(of_a, of_b, scale, v3(0.0f32, 0.0f32, 1.0f32));
    let apart = difference(of_a.high, of_a.low, of_b.high, of_b.low);
    let shift = scaled(1.0f32 / of_b.unit, turn_back(of_b.axis, of_b.scalar, apart));
    let is_round = entry(assets, shape_a, KIND) == ROUND;
    let radius = select(is_round, scale * number(assets, shape_a, comptime!(SIZES + 1)), 0.0f32);
    let row = (at * comptime!(DIRECTION_ROWS as u32)) as usize;
    maps[row] = four(x.x, y.x, z.x, shift.x);
    maps[row + 1usize] = four(x.y, y.y, z.y, shift.y);
    maps[row + 2usize] = four(x.z, y.z, z.z, shift.z);
    maps[row + 3usize] = four(scale, contact_distance / of_b.unit, radius, 0.0f32);
}

#[cube]
fn column(of_a: Pose, of_b: Pose, scale: f32, axis: V3) -> V3 {
    scaled(scale, turn_back(of_b.axis, of_b.scalar, turn(of_a.axis, of_a.scalar, axis)))
}

/// A row.
#[cube]
pub fn four(x: f32, y: f32, z: f32, w: f32) -> Vector<f32, Const<4>> {
    let mut row = Vector::<f32, Const<4>>::empty();
    row.insert(0usize, x);
    row.insert(1usize, y);
    row.insert(2usize, z);
    row.insert(3usize, w);
    row
}
