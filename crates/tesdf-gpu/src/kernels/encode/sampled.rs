//! Algorithm 1: finds the faces that are closest at the samples of a cell, by brute force.
//!
//! A group takes a block of 8 × 8 × 4 neighbouring samples of one cell, with one sample per thread.
//! Lemma 1 is applied again to the block, whose ball is small. Of hundreds of candidates, about ten
//! are left, and only these are measured from each sample.
//!
//! All coordinates are relative to the centroid of the cell. A face is given by its plane and its
//! three edges, each from the point of its line nearest to the centroid. So the rounding error is
//! relative to the size of the cell and its distance from the face, however large the face is.
//!
//! Mirrors `encode/sampled.rs` of `tesdf`.
use cubecl::prelude::*;

use crate::kernels::geometry::vector::{Row, V3, last, to_bits, xyz};

/// Rows of a candidate: the plane (unit normal, height); the planes through the three edges (inward
/// normal, height); and two rows for each edge, the longest first. An edge's first row has the
/// point of its line nearest to the centroid, and the position of the start along the line. The
/// second row has the direction, and the position of the end.
pub const FACE_ROWS: usize = 10;
/// Rows of a cell: its four shrunk corners. The last column has ε, the radius R, twice the radius
/// of a block, and 0.
pub const CELL_ROWS: usize = 4;
/// Size of a block, in samples.
pub const BLOCK: [u32; 3] = [8, 8, 4];
/// Threads of a group: one for each sample of a block.
pub const GROUP: usize = (BLOCK[0] * BLOCK[1] * BLOCK[2]) as usize;
/// Bits of each of the three indices in the position of a block.
pub const INDEX_BITS: u32 = 10;
pub const INDEX: u32 = (1 << INDEX_BITS) - 1;
/// Candidates that a group measures at a time.
pub const TILE: usize = 1024;
/// Rounding error of the difference of two distances, relative to R + d: section 3 of docs/math.md.
pub const ROUNDING: f32 = 3.814_697_3e-6;
/// Larger than any distance or its square.
const FAR: f32 = 3.0e38;

/// The cells of a launch and their candidates.
#[derive(CubeType, CubeLaunch)]
pub struct Samples {
    /// [`FACE_ROWS`] rows for each candidate.
    pub faces: Box<[Row]>,
    /// [`CELL_ROWS`] rows for each cell.
    pub cells: Box<[Row]>,
    /// First candidate and number of candidates for each cell.
    pub ranges: Box<[u32]>,
    /// Position of each block in a cell, counted in blocks, with [`INDEX_BITS`] bits for each
    /// index.
    pub blocks: Box<[u32]>,
    /// Number of blocks per cell.
    pub block_count: u32,
    /// Number of sample intervals along an edge of a cell.
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
    /// Height of a point above a plane.
    fn above(self, p: V3) -> f32 {
        self.vector.dot(p) - self.number
    }
}

/// An edge, in the layout of two rows of [`FACE_ROWS`].
#[derive(CubeType, Clone, Copy)]
#[expand(derive(Clone, Copy))]
pub struct Edge {
    pub begin: Entry,
    pub end: Entry,
}

#[cube]
impl Edge {
    /// Position of a point's projection along the edge.
    fn foot(self, p: V3) -> f32 {
        self.end.vector.dot(p - self.begin.vector)
    }

    /// Squared distance to a point with the projection `foot`.
    fn squared_distance(self, foot: f32, p: V3) -> f32 {
        let along = self.end.vector * -foot.clamp(self.begin.number, self.end.number);
        let off = (p - self.begin.vector) + along;
        off.dot(off)
    }
}

/// A face in the layout of [`FACE_ROWS`].
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
        // Beyond the tip of a needle the longest edge decides, because two nearly parallel sides
        // give an imprecise answer there.
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

/// Limit on the distance from a sample to a face that is within ε of the nearest face, whose squared
/// distance, with the allowed area, is `nearest`.
#[cube]
fn sample_limit(nearest: f32, threshold: f32, radius: f32) -> f32 {
    let limit = nearest.sqrt() + threshold;
    limit + ROUNDING * (radius + limit)
}

/// Limit on the distance from the center of a block to a face that is within ε of the nearest face
/// at a sample of the block: Lemma 1 with ε. `nearest` is that of the center, with the allowed area.
#[cube]
pub fn block_limit(nearest: f32, threshold: f32, radius: f32, reach: f32) -> f32 {
    let limit = nearest.sqrt() + reach + threshold;
    limit + ROUNDING * (radius + reach + limit)
}

/// The candidates of a cell, and the parameters of its limits.
#[derive(CubeType, Clone, Copy)]
#[expand(derive(Clone, Copy))]
struct Limits {
    first: usize,
    count: usize,
    /// The threshold ε.
    threshold: f32,
    /// The area by which squared distances may differ.
    squared: f32,
    /// The radius R of the cell.
    radius: f32,
    /// Twice the radius of a block.
    reach: f32,
}

/// The position of a sample, in steps along the edges of a cell.
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
            squared: entry(&self.cells, rows + 3).number,
        }
    }

    /// The point of a cell with these barycentric coordinates, in steps.
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
            i: comptime!(BLOCK[0]) * (block & INDEX),
            j: comptime!(BLOCK[1]) * ((block >> INDEX_BITS) & INDEX),
            k: comptime!(BLOCK[2]) * (block >> comptime!(2 * INDEX_BITS)),
        }
    }

    /// The smallest squared distance from a point to the candidates. All threads of the group must
    /// call it.
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
        for half in 0..comptime!(GROUP.trailing_zeros() as usize) {
            let apart = comptime!((GROUP / 2) >> half);
            if unit < apart {
                nearest_of[unit] = nearest_of[unit].min(nearest_of[unit + apart]);
            }
            sync_cube();
        }
        nearest_of[0]
    }

    /// Collects the candidates of a tile that are within a limit of the block's center. All threads
    /// of the group must call it.
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

/// The center of a block, and the squared limit for its candidates.
#[derive(CubeType, Clone, Copy)]
#[expand(derive(Clone, Copy))]
struct Near {
    center: V3,
    squared: f32,
}

/// The middle of a block along an axis, in steps from its first sample.
pub const fn middle(axis: usize) -> f32 {
    0.5 * (BLOCK[axis] - 1) as f32
}

/// Candidates that a group shares.
#[derive(CubeType)]
struct List {
    faces: Shared<[u32]>,
    length: Shared<[Atomic<u32>]>,
}

/// Writes d_f² as bits into `least`, for each candidate that is within ε at a sample. A group takes
/// a block of a cell.
#[cube(launch, create_dummy_kernel)]
pub fn sample(samples: &Samples, least: &[Atomic<u32>], first_group: u32, groups: u32) {
    let mut nearest_of = Shared::<[f32]>::new_slice(GROUP);
    let mut list =
        List { faces: Shared::<[u32]>::new_slice(TILE), length: Shared::<[Atomic<u32>]>::new_slice(1usize) };

    // Surplus groups repeat the work of the last group, which changes nothing. So all threads reach
    // each barrier.
    let group = first_group + (CUBE_POS as u32).min(groups - 1u32);
    let cell = (group / samples.block_count) as usize;
    let block = samples.block(group);
    let center = samples.point(
        cell,
        block.i as f32 + comptime!(middle(0)),
        block.j as f32 + comptime!(middle(1)),
        block.k as f32 + comptime!(middle(2)),
    );
    let i = block.i + UNIT_POS % comptime!(BLOCK[0]);
    let j = block.j + UNIT_POS / comptime!(BLOCK[0]) % comptime!(BLOCK[1]);
    let k = block.k + UNIT_POS / comptime!(BLOCK[0] * BLOCK[1]);
    let is_sample = i + j + k <= samples.resolution;
    let p = samples.point(cell, i as f32, j as f32, k as f32);
    let limits = samples.limits(cell);
    let nearest = samples.least(limits, center, &mut nearest_of);
    let limit = block_limit(nearest + limits.squared, limits.threshold, limits.radius, limits.reach);
    let near = Near { center, squared: limit * limit };

    // The tiles are processed twice: first for the smallest distance of each sample, then for the
    // candidates within ε of it.
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
    let limit = sample_limit(nearest + limits.squared, limits.threshold, limits.radius);
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
