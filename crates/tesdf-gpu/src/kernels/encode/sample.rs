//! Algorithm 1: which faces are closest at the samples of a cell, by brute force.
//!
//! A group takes a block of 8 × 8 × 4 neighbouring samples of one cell, a thread a sample. Lemma 1 is applied again to the
//! block, whose ball is small: of hundreds of candidates some ten are left, and only they are measured from each sample.
//!
//! Everything is relative to the cell's centroid, and a face is its plane and its three edges, each from its point nearest
//! to the centroid. So rounding is relative to the size of the cell and its distance from the face, however large the
//! face is.
use cubecl::prelude::*;

use super::super::math::vector::{Row, V3, last, to_bits, xyz};

/// Rows of a candidate: the plane (unit normal, height); the three planes through the edges (inward, height); for each
/// edge, the longest first, its point nearest to the centroid and where the edge begins from there; its direction and
/// where it ends.
pub const FACE_ROWS: usize = 10;
/// Rows of a cell: four corners, shrunk; beside them ε, the radius R, twice the radius of a block, and nothing.
pub const CELL_ROWS: usize = 4;
/// Samples of a block.
pub const BLOCK: [u32; 3] = [8, 8, 4];
/// Threads of a group.
pub const GROUP: usize = 256;
/// Candidates that a group measures in one go.
pub const TILE: usize = 1024;
/// What rounding may make of the difference of two distances, as a share of R + d: docs/math.md.
pub const ROUNDING: f32 = 3.814_697_3e-6;
/// Farther than any candidate.
const FAR: f32 = 3.0e38;

/// The cells of a launch and their candidates.
#[derive(CubeType, CubeLaunch)]
pub struct Samples {
    /// [`FACE_ROWS`] a candidate.
    pub faces: Box<[Row]>,
    /// [`CELL_ROWS`] a cell.
    pub cells: Box<[Row]>,
    /// First candidate and number of candidates of each cell.
    pub ranges: Box<[u32]>,
    /// Where each block of a cell is, in blocks, ten bits for each index.
    pub blocks: Box<[u32]>,
    /// Number of blocks of a cell.
    pub block_count: u32,
    /// Steps along an edge of a cell.
    pub resolution: u32,
}

/// A vector and a number.
#[derive(CubeType, Clone, Copy)]
#[expand(derive(Clone, Copy))]
pub struct Entry {
    pub vector: V3,
    pub number: f32,
}

#[cube]
fn entry(rows: &[Row], at: usize) -> Entry {
    let row = rows[at];
    Entry { vector: xyz(row), number: last(row) }
}

#[cube]
impl Entry {
    /// Height of a point over a plane.
    fn above(self, p: V3) -> f32 {
        self.vector.dot(p) - self.number
    }
}

/// An edge: its point nearest to the centroid and where it begins from there; its direction and where it ends.
#[derive(CubeType, Clone, Copy)]
#[expand(derive(Clone, Copy))]
pub struct Edge {
    pub begin: Entry,
    pub end: Entry,
}

#[cube]
impl Edge {
    /// Where along the edge the foot of a point is.
    fn foot(self, p: V3) -> f32 {
        self.end.vector.dot(p - self.begin.vector)
    }

    /// Squared distance to a point whose foot is known.
    fn squared_distance(self, foot: f32, p: V3) -> f32 {
        let along = self.end.vector * -foot.clamp(self.begin.number, self.end.number);
        let off = (p - self.begin.vector) + along;
        off.dot(off)
    }
}

/// A face as [`FACE_ROWS`] has it.
#[derive(CubeType, Clone, Copy)]
#[expand(derive(Clone, Copy))]
pub struct Candidate {
    pub plane: Entry,
    pub side_0: Entry,
    pub side_1: Entry,
    pub side_2: Entry,
    pub edge_0: Edge,
    pub edge_1: Edge,
    pub edge_2: Edge,
}

#[cube]
fn edge(faces: &[Row], at: usize) -> Edge {
    Edge { begin: entry(faces, at), end: entry(faces, at + 1) }
}

#[cube]
fn candidate(faces: &[Row], face: usize) -> Candidate {
    let at = face * comptime!(FACE_ROWS);
    Candidate {
        plane: entry(faces, at),
        side_0: entry(faces, at + 1),
        side_1: entry(faces, at + 2),
        side_2: entry(faces, at + 3),
        edge_0: edge(faces, at + 4),
        edge_1: edge(faces, at + 6),
        edge_2: edge(faces, at + 8),
    }
}

#[cube]
impl Candidate {
    /// Squared distance to a point.
    pub fn squared_distance(self, p: V3) -> f32 {
        let height = self.plane.above(p);
        let t = self.edge_0.foot(p);
        // The tip of a needle is found by its longest edge: two sides that are nearly parallel find it badly.
        let inside = self.side_0.above(p) >= 0.0f32
            && self.side_1.above(p) >= 0.0f32
            && self.side_2.above(p) >= 0.0f32
            && t >= self.edge_0.begin.number
            && t <= self.edge_0.end.number;
        let longest = self.edge_0.squared_distance(t, p);
        let second = self.edge_1.squared_distance(self.edge_1.foot(p), p);
        let third = self.edge_2.squared_distance(self.edge_2.foot(p), p);
        select(inside, height * height, longest.min(second).min(third))
    }
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

/// The candidates of a cell, and the limits of its samples.
#[derive(CubeType, Clone, Copy)]
#[expand(derive(Clone, Copy))]
struct Limits {
    first: usize,
    count: usize,
    /// ε.
    threshold: f32,
    /// R.
    radius: f32,
    /// Twice the radius of a block.
    reach: f32,
}

/// Where a sample is, in steps along the edges of a cell.
#[derive(CubeType, Clone, Copy)]
#[expand(derive(Clone, Copy))]
struct Steps {
    i: u32,
    j: u32,
    k: u32,
}

#[cube]
impl Samples {
    fn squared_distance(&self, face: usize, p: V3) -> f32 {
        candidate(&self.faces, face).squared_distance(p)
    }

    fn limits(&self, cell: usize) -> Limits {
        let rows = cell * comptime!(CELL_ROWS);
        Limits {
            first: self.ranges[2 * cell] as usize,
            count: self.ranges[2 * cell + 1] as usize,
            threshold: entry(&self.cells, rows).number,
            radius: entry(&self.cells, rows + 1).number,
            reach: entry(&self.cells, rows + 2).number,
        }
    }

    /// The point of a cell with these barycentric coordinates, counted in steps.
    fn point(&self, cell: usize, i: f32, j: f32, k: f32) -> V3 {
        let q = self.resolution as f32;
        let at = cell * comptime!(CELL_ROWS);
        let (a, b) = (entry(&self.cells, at).vector, entry(&self.cells, at + 1).vector);
        let (c, d) = (entry(&self.cells, at + 2).vector, entry(&self.cells, at + 3).vector);
        let first = a * i + b * j;
        let second = c * k + d * (q - i - j - k);
        (first + second) * (1.0f32 / q)
    }

    /// The first sample of a block.
    fn block(&self, number: u32) -> Steps {
        let block = self.blocks[(number % self.block_count) as usize];
        Steps {
            i: 8u32 * (block & 1023u32),
            j: 8u32 * ((block >> 10u32) & 1023u32),
            k: 4u32 * (block >> 20u32),
        }
    }

    /// The least squared distance from a point to the candidates, over the group. All threads call it.
    fn least(&self, limits: Limits, p: V3, nearest_of: &mut Shared<[f32]>) -> f32 {
        let unit = UNIT_POS as usize;
        let mut nearest = FAR.runtime();
        for step in 0..limits.count.div_ceil(GROUP) {
            let at = step * comptime!(GROUP) + unit;
            if at < limits.count {
                nearest = nearest.min(self.squared_distance(limits.first + at, p));
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
        nearest_of[0]
    }

    /// Gathers the candidates of a tile that are within a limit of the middle of the block. All threads call it.
    fn gather(&self, limits: Limits, tile: usize, near: Near, list: &mut List) {
        let first = limits.first + tile * comptime!(TILE);
        let count = (limits.count - tile * comptime!(TILE)).min(TILE);
        if UNIT_POS == 0u32 {
            list.length[0].store(0u32);
        }
        sync_cube();
        for step in 0..comptime!(TILE / GROUP) {
            let at = step * comptime!(GROUP) + UNIT_POS as usize;
            if at < count {
                let face = first + at;
                if self.squared_distance(face, near.center) <= near.squared {
                    list.faces[list.length[0].fetch_add(1u32) as usize] = face as u32;
                }
            }
        }
        sync_cube();
    }
}

/// The middle of a block, and the squared limit of its candidates.
#[derive(CubeType, Clone, Copy)]
#[expand(derive(Clone, Copy))]
struct Near {
    center: V3,
    squared: f32,
}

/// Candidates that a group shares.
#[derive(CubeType)]
struct List {
    faces: Shared<[u32]>,
    length: Shared<[Atomic<u32>]>,
}

/// A group for each block of each cell: d_f², as bits, of the candidates that are within ε at a sample, into `least`.
#[cube(launch, create_dummy_kernel)]
pub fn sample(samples: &Samples, least: &[Atomic<u32>], first_group: u32, groups: u32) {
    let mut nearest_of = Shared::<[f32]>::new_slice(GROUP);
    let mut list =
        List { faces: Shared::<[u32]>::new_slice(TILE), length: Shared::<[Atomic<u32>]>::new_slice(1usize) };

    // Groups beyond the last do the last one's work again, which changes nothing, so that all threads meet at barriers.
    let group = first_group + (CUBE_POS as u32).min(groups - 1u32);
    let cell = (group / samples.block_count) as usize;
    let block = samples.block(group);
    let center =
        samples.point(cell, block.i as f32 + 3.5f32, block.j as f32 + 3.5f32, block.k as f32 + 1.5f32);
    let i = block.i + (UNIT_POS & 7u32);
    let j = block.j + ((UNIT_POS >> 3u32) & 7u32);
    let k = block.k + (UNIT_POS >> 6u32);
    let is_sample = i + j + k <= samples.resolution;
    let p = samples.point(cell, i as f32, j as f32, k as f32);
    let limits = samples.limits(cell);
    let nearest = samples.least(limits, center, &mut nearest_of);
    let limit = block_limit(nearest.sqrt(), limits.threshold, limits.radius, limits.reach);
    let near = Near { center, squared: limit * limit };

    // Candidates within the limit, a tile at a time: first for the least distance of each sample, then for those that are
    // as near.
    let tiles = limits.count.div_ceil(TILE);
    let mut nearest = FAR.runtime();
    for tile in 0..tiles {
        samples.gather(limits, tile, near, &mut list);
        if is_sample {
            for n in 0..list.length[0].load() {
                let face = list.faces[n as usize] as usize;
                nearest = nearest.min(samples.squared_distance(face, p));
            }
        }
        sync_cube();
    }
    let limit = sample_limit(nearest.sqrt(), limits.threshold, limits.radius);
    let limit = limit * limit;
    for tile in 0..tiles {
        if tiles > 1 {
            samples.gather(limits, tile, near, &mut list);
        }
        if is_sample {
            for n in 0..list.length[0].load() {
                let face = list.faces[n as usize] as usize;
                let squared = samples.squared_distance(face, p);
                let bits = to_bits(squared);
                if squared <= limit && bits < least[face].load() {
                    least[face].fetch_min(bits);
                }
            }
        }
        sync_cube();
    }
}
