//! Algorithm 1: which faces are closest at the samples of a cell, by brute force.
//!
//! A group takes a block of 8 × 8 × 4 neighbouring samples of one cell, a thread a sample. Lemma 1 is asked again for the block, whose ball
//! is small: of hundreds of candidates some ten are left, and only they are measured from each sample.
//!
//! Everything is relative to the cell's centroid, and a face is its plane and its three edges, each from its point nearest to the
//! centroid. So rounding is relative to the size of the cell and its distance from the face, however large the face is.
use cubecl::prelude::*;

use super::vector::{V3, dot, minus, plus, plus_scaled, scaled, v3};

/// Rows of a candidate: the plane (unit normal, height); the three planes through the edges (inward, height); for each edge, the longest
/// first, its point nearest to the centroid and where the edge begins from there; its direction and where it ends.
pub const FACE_ROWS: usize = 10;
/// Rows of a cell: four corners, shrunk; beside them ε, the radius R, twice the radius of a block, and nothing.
pub const CELL_ROWS: usize = 4;
/// Samples of a block.
pub const BLOCK: [u32; 3] = [8, 8, 4];
/// Threads of a group.
pub const GROUP: usize = 256;
/// Candidates that a group looks at in one go.
pub const TILE: usize = 1024;
/// What rounding may make of the difference of two distances, as a share of R + d: docs/math.md.
pub const ROUNDING: f32 = 3.814_697_3e-6;

/// A row: a vector and a number.
#[derive(CubeType, Clone, Copy)]
#[expand(derive(Clone, Copy))]
pub struct Row {
    pub vector: V3,
    pub number: f32,
}

#[cube]
fn row(rows: &[Vector<f32, Const<4>>], at: usize) -> Row {
    let r = rows[at];
    Row { vector: v3(r.extract(0usize), r.extract(1usize), r.extract(2usize)), number: r.extract(3usize) }
}

/// A face as [`FACE_ROWS`] has it.
#[derive(CubeType, Clone, Copy)]
#[expand(derive(Clone, Copy))]
pub struct Candidate {
    pub plane: Row,
    pub side_0: Row,
    pub side_1: Row,
    pub side_2: Row,
    pub begin_0: Row,
    pub end_0: Row,
    pub begin_1: Row,
    pub end_1: Row,
    pub begin_2: Row,
    pub end_2: Row,
}

#[cube]
fn candidate(faces: &[Vector<f32, Const<4>>], face: usize) -> Candidate {
    let at = face * comptime!(FACE_ROWS);
    Candidate {
        plane: row(faces, at),
        side_0: row(faces, at + 1),
        side_1: row(faces, at + 2),
        side_2: row(faces, at + 3),
        begin_0: row(faces, at + 4),
        end_0: row(faces, at + 5),
        begin_1: row(faces, at + 6),
        end_1: row(faces, at + 7),
        begin_2: row(faces, at + 8),
        end_2: row(faces, at + 9),
    }
}

#[cube]
fn above(side: Row, p: V3) -> f32 {
    dot(side.vector, p) - side.number
}

/// Where along an edge the foot of a point is.
#[cube]
fn along(begin: Row, end: Row, p: V3) -> f32 {
    dot(end.vector, minus(p, begin.vector))
}

#[cube]
fn to_edge(begin: Row, end: Row, t: f32, p: V3) -> f32 {
    let off = plus_scaled(minus(p, begin.vector), -t.clamp(begin.number, end.number), end.vector);
    dot(off, off)
}

/// Squared distance.
#[cube]
pub fn squared_distance(face: Candidate, p: V3) -> f32 {
    let height = above(face.plane, p);
    let t = along(face.begin_0, face.end_0, p);
    // The tip of a needle is told by its longest edge: two sides that are nearly parallel tell it badly.
    let inside = above(face.side_0, p) >= 0.0f32
        && above(face.side_1, p) >= 0.0f32
        && above(face.side_2, p) >= 0.0f32
        && t >= face.begin_0.number
        && t <= face.end_0.number;
    let longest = to_edge(face.begin_0, face.end_0, t, p);
    let second = to_edge(face.begin_1, face.end_1, along(face.begin_1, face.end_1, p), p);
    let third = to_edge(face.begin_2, face.end_2, along(face.begin_2, face.end_2, p), p);
    select(inside, height * height, longest.min(second).min(third))
}

#[cube]
fn distance_to(faces: &[Vector<f32, Const<4>>], face: usize, p: V3) -> f32 {
    squared_distance(candidate(faces, face), p)
}

/// The point with these barycentric coordinates, counted in steps.
#[cube]
fn place(cells: &[Vector<f32, Const<4>>], cell: usize, i: f32, j: f32, k: f32, q: f32) -> V3 {
    let at = cell * comptime!(CELL_ROWS);
    let (a, b) = (row(cells, at).vector, row(cells, at + 1).vector);
    let (c, d) = (row(cells, at + 2).vector, row(cells, at + 3).vector);
    let first = plus(scaled(i, a), scaled(j, b));
    let second = plus(scaled(k, c), scaled(q - i - j - k, d));
    scaled(1.0f32 / q, plus(first, second))
}

/// How far from a sample a face may be that is within ε of the `nearest` there.
#[cube]
fn sample_limit(nearest: f32, threshold: f32, radius: f32) -> f32 {
    let limit = nearest + threshold;
    limit + ROUNDING * (radius + limit)
}

/// How far from the middle of a block a face may be that is so at one of its samples: Lemma 1, with ε.
#[cube]
pub fn block_limit(nearest: f32, threshold: f32, radius: f32, reach: f32) -> f32 {
    let limit = nearest + reach + threshold;
    limit + ROUNDING * (radius + reach + limit)
}

/// Of `count` candidates from `first` on, those within the limit of the middle of the block, into `list`; for the whole group.
#[cube]
fn gather(
    faces: &[Vector<f32, Const<4>>],
    first: usize,
    count: usize,
    center: V3,
    squared_limit: f32,
    list: &mut Shared<[u32]>,
    length: &Shared<[Atomic<u32>]>,
) {
    if UNIT_POS == 0u32 {
        length[0].store(0u32);
    }
    sync_cube();
    for step in 0..comptime!(TILE / GROUP) {
        let at = step * comptime!(GROUP) + UNIT_POS as usize;
        if at < count {
            let face = first + at;
            if distance_to(faces, face, center) <= squared_limit {
                list[length[0].fetch_add(1u32) as usize] = face as u32;
            }
        }
    }
    sync_cube();
}

/// A group for each block of each cell: d_f², as bits, of the candidates that are within ε at a sample, into `least`.
///
/// `ranges` has first candidate and number of candidates of each cell, `blocks` where each block is, in blocks, ten bits for each index.
#[cube(launch, create_dummy_kernel)]
pub fn sample(
    faces: &[Vector<f32, Const<4>>],
    cells: &[Vector<f32, Const<4>>],
    ranges: &[u32],
    blocks: &[u32],
    least: &[Atomic<u32>],
    block_count: u32,
    resolution: u32,
    first_group: u32,
    groups: u32,
) {
    let mut nearest_of = Shared::<[f32]>::new_slice(GROUP);
    let mut list = Shared::<[u32]>::new_slice(TILE);
    let length = Shared::<[Atomic<u32>]>::new_slice(1usize);

    let unit = UNIT_POS as usize;
    // Groups beyond the last do the last one's work again, which changes nothing, so that all threads meet at the barriers.
    let group = first_group + (CUBE_POS as u32).min(groups - 1u32);
    let cell = (group / block_count) as usize;
    let block = blocks[(group % block_count) as usize];
    let q = resolution as f32;
    let (i, j, k) = (8u32 * (block & 1023u32), 8u32 * ((block >> 10u32) & 1023u32), 4u32 * (block >> 20u32));
    let center = place(cells, cell, i as f32 + 3.5f32, j as f32 + 3.5f32, k as f32 + 1.5f32, q);
    let (i, j, k) = (i + (UNIT_POS & 7u32), j + ((UNIT_POS >> 3u32) & 7u32), k + (UNIT_POS >> 6u32));
    let is_sample = i + j + k <= resolution;
    let p = place(cells, cell, i as f32, j as f32, k as f32, q);
    let rows = cell * comptime!(CELL_ROWS);
    let threshold = row(cells, rows).number;
    let radius = row(cells, rows + 1).number;
    let reach = row(cells, rows + 2).number;
    let first = ranges[2 * cell] as usize;
    let count = ranges[2 * cell + 1] as usize;

    // The least distance from the middle of the block.
    let mut nearest = 3.0e38f32;
    for step in 0..count.div_ceil(GROUP) {
        let at = step * comptime!(GROUP) + unit;
        if at < count {
            nearest = nearest.min(distance_to(faces, first + at, center));
        }
    }
    nearest_of[unit] = nearest;
    sync_cube();
    #[unroll]
    for half in 0..8usize {
        let apart = comptime!(128usize >> half);
        if unit < apart {
            nearest_of[unit] = nearest_of[unit].min(nearest_of[unit + apart]);
        }
        sync_cube();
    }
    let limit = block_limit(nearest_of[0].sqrt(), threshold, radius, reach);
    let block_limit = limit * limit;

    // Candidates within the limit, a tile at a time: first for the least distance of each sample, then for those that are as near.
    let tiles = count.div_ceil(TILE);
    let mut nearest = 3.0e38f32;
    for tile in 0..tiles {
        gather(
            faces,
            first + tile * comptime!(TILE),
            (count - tile * comptime!(TILE)).min(TILE),
            center,
            block_limit,
            &mut list,
            &length,
        );
        if is_sample {
            for n in 0..length[0].load() {
                let face = list[n as usize] as usize;
                nearest = nearest.min(distance_to(faces, face, p));
            }
        }
        sync_cube();
    }
    let limit = sample_limit(nearest.sqrt(), threshold, radius);
    let limit = limit * limit;
    for tile in 0..tiles {
        if tiles > 1 {
            gather(
                faces,
                first + tile * comptime!(TILE),
                (count - tile * comptime!(TILE)).min(TILE),
                center,
                block_limit,
                &mut list,
                &length,
            );
        }
        if is_sample {
            for n in 0..length[0].load() {
                let face = list[n as usize] as usize;
                let squared = distance_to(faces, face, p);
                let bits = u32::reinterpret(squared);
                if squared <= limit && bits < least[face].load() {
                    least[face].fetch_min(bits);
                }
            }
        }
        sync_cube();
    }
}
