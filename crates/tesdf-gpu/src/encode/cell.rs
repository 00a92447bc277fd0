use bytemuck::{Pod, Zeroable};
use tesdf::encode::{SampledCell, Sampling};
use tesdf::glam::DVec3;

use crate::kernels::encode::sampled::{BLOCK, CELL_ROWS, INDEX, INDEX_BITS, block_limit, middle};
use crate::kernels::geometry::vector::V3;

/// The sample grid of a cell, divided into blocks.
pub struct Grid {
    pub resolution: u32,
    shrink: f64,
    /// Position of each block in the grid, counted in blocks, with [`INDEX_BITS`] bits for each
    /// index.
    pub blocks: Vec<u32>,
}

impl Grid {
    pub fn new(sampling: &Sampling) -> Self {
        let q = sampling.resolution;
        let [wide, high, deep] = BLOCK;
        let mut blocks = Vec::new();
        for k in 0..=q / deep {
            for j in 0..=(q - k * deep) / high {
                let row = 0..=(q - k * deep - j * high) / wide;
                blocks.extend(row.map(|i| i | j << INDEX_BITS | k << (2 * INDEX_BITS)));
            }
        }
        Self { resolution: q, shrink: sampling.shrink, blocks }
    }
}

/// A cell as rows for the kernel: the corners relative to the centroid, each with one number.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(transparent)]
pub struct CellRows([[f32; 4]; CELL_ROWS]);

impl CellRows {
    pub fn new(SampledCell { cell, threshold, squared, .. }: &SampledCell, grid: &Grid) -> Self {
        let center = cell.centroid();
        let corners = cell.corners.map(|c| grid.shrink * (c - center));
        let numbers = [*threshold, cell.radius(), 2.0 * block_radius(&corners, grid.resolution), *squared];
        let row = |k: usize| {
            let [x, y, z] = corners[k].as_vec3().to_array();
            [x, y, z, at_least(numbers[k])]
        };
        Self(std::array::from_fn(row))
    }

    /// Center of a block relative to the centroid, computed as the kernel computes it.
    pub fn middle(&self, block: u32, resolution: u32) -> V3 {
        let first = [block & INDEX, (block >> INDEX_BITS) & INDEX, block >> (2 * INDEX_BITS)];
        let [i, j, k] = std::array::from_fn(|k| BLOCK[k] as f32 * first[k] as f32 + middle(k));
        let weights = [i, j, k, resolution as f32 - i - j - k];
        let along = |axis: usize| -> f32 {
            self.0.iter().zip(weights).map(|(row, weight)| weight * row[axis]).sum::<f32>()
                / resolution as f32
        };
        V3 { x: along(0), y: along(1), z: along(2) }
    }

    /// Limit on the distance from the center of a block to a face that a sample of the block may
    /// need. `nearest` is the squared distance from the center to the nearest face.
    pub fn block_limit(&self, nearest: f32) -> f32 {
        block_limit(nearest + self.0[3][3], self.0[0][3], self.0[1][3], self.0[2][3])
    }

    pub fn radius(&self) -> f64 {
        f64::from(self.0[1][3])
    }
}

fn at_least(x: f64) -> f32 {
    let near = x as f32;
    if f64::from(near) < x { near.next_up() } else { near }
}

/// Radius of a block: no sample of the block is farther than this from its center.
fn block_radius([a, b, c, d]: &[DVec3; 4], resolution: u32) -> f64 {
    let half =
        |k: usize, corner: &DVec3| 0.5 * f64::from(BLOCK[k] - 1) / f64::from(resolution) * (*corner - *d);
    let (x, y, z) = (half(0, a), half(1, b), half(2, c));
    [x + y + z, x + y - z, x - y + z, x - y - z].map(DVec3::length).into_iter().fold(0.0, f64::max)
}
