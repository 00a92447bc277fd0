//! Fills a grid with the exact distances of an encoded mesh.
use std::sync::atomic::{AtomicUsize, Ordering};

use rayon::prelude::*;
use tesdf::TeSdf;
use tesdf::glam::USizeVec3;

use super::grid::{BLOCK, NO_SLOT, SAMPLES, SIDE, VoxelGrid};

/// Resolution and width of the finely sampled region.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VoxelOptions {
    /// Number of voxels along the longest side of the mesh's bounds: the *resolution* of Isaac Sim.
    pub resolution: u32,
    /// The surface has fine samples up to this distance, in the mesh's unit.
    pub narrow_band: f64,
}

/// Why a grid is not made.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum VoxelError {
    /// The resolution is out of range.
    #[error("{found} voxels along the longest side; expected 1 to {}", VoxelOptions::MAX_RESOLUTION)]
    Resolution {
        /// The resolution found.
        found: u32,
    },
    /// The narrow band is not a length.
    #[error("a narrow band of {found}; expected a finite number, 0 or greater")]
    NarrowBand {
        /// The width found.
        found: f64,
    },
    /// There is not enough memory for the samples.
    #[error("{bytes} bytes of samples do not fit into memory; take a lower resolution")]
    Memory {
        /// Bytes of the samples.
        bytes: u64,
    },
}

/// Voxels between the mesh's bounds and the border of the grid.
const MARGIN: usize = 4;

/// Number of points of a task.
const BATCH: usize = 1 << 16;

impl VoxelOptions {
    /// The greatest resolution.
    pub const MAX_RESOLUTION: u32 = 4096;
}

impl VoxelGrid {
    /// Samples the exact distances of `asset`.
    ///
    /// A block gets fine samples when its centre is nearer to the surface than the narrow band plus
    /// half of the block's diagonal, so all points of the other blocks are farther than the narrow
    /// band. The grid has a margin of four voxels around the mesh. `progress` receives the
    /// completed fraction, 0 to 1, from any thread. Runs in the current rayon pool; the grid is the
    /// same for any number of threads.
    ///
    /// # Errors
    /// [`VoxelError`].
    pub fn new(
        asset: &TeSdf,
        options: VoxelOptions,
        progress: impl Fn(f64) + Sync,
    ) -> Result<Self, VoxelError> {
        let VoxelOptions { resolution, narrow_band } = options;
        if !(1..=VoxelOptions::MAX_RESOLUTION).contains(&resolution) {
            return Err(VoxelError::Resolution { found: resolution });
        }
        if !(narrow_band >= 0.0 && narrow_band.is_finite()) {
            return Err(VoxelError::NarrowBand { found: narrow_band });
        }
        let bounds = asset.bounds();
        let voxel = bounds.extent().max_element() / f64::from(resolution);
        let voxels = (bounds.extent() / voxel).ceil().as_usizevec3() + 2 * MARGIN;
        let blocks = (voxels + (BLOCK - 1)) / BLOCK;
        let mut grid = Self {
            origin: bounds.center() - 0.5 * voxel * voxels.as_dvec3(),
            voxel,
            voxels,
            blocks,
            narrow_band,
            coarse: Vec::new(),
            slots: vec![NO_SLOT; blocks.element_product()],
            fine: Vec::new(),
        };
        grid.coarse = grid.sampled_coarsely(asset);
        let near = grid.near_blocks(asset);
        for (slot, &number) in near.iter().enumerate() {
            grid.slots[number] = slot as u32;
        }
        grid.fine = grid.sampled_finely(asset, &near, progress)?;
        Ok(grid)
    }

    /// Distances at the corners of the blocks.
    fn sampled_coarsely(&self, asset: &TeSdf) -> Vec<f32> {
        let row = self.blocks + 1;
        let edge = BLOCK as f64 * self.voxel;
        let corner = |k: usize| {
            let index = USizeVec3::new(k % row.x, k / row.x % row.y, k / (row.x * row.y));
            asset.signed_distance(self.origin + edge * index.as_dvec3()) as f32
        };
        (0..row.element_product()).into_par_iter().map(corner).collect()
    }

    /// The blocks that get fine samples, in order.
    fn near_blocks(&self, asset: &TeSdf) -> Vec<usize> {
        let half = 0.5 * BLOCK as f64 * self.voxel;
        let limit = self.narrow_band + 3.0_f64.sqrt() * half;
        let is_near =
            |&number: &usize| asset.signed_distance(self.block_origin(number) + half).abs() <= limit;
        (0..self.slots.len()).into_par_iter().filter(is_near).collect()
    }

    /// Distances at the corners of the voxels of blocks.
    fn sampled_finely(
        &self,
        asset: &TeSdf,
        blocks: &[usize],
        progress: impl Fn(f64) + Sync,
    ) -> Result<Vec<f32>, VoxelError> {
        let mut samples = Vec::new();
        let count = blocks.len() * SAMPLES;
        let bytes = (count * size_of::<f32>()) as u64;
        samples.try_reserve_exact(count).map_err(|_| VoxelError::Memory { bytes })?;
        samples.resize(count, 0.0);
        let per_task = BATCH / SAMPLES;
        let all = blocks.len();
        let done = AtomicUsize::new(0);
        let tasks = samples.par_chunks_mut(per_task * SAMPLES).zip(blocks.par_chunks(per_task));
        tasks.for_each(|(samples, chunk)| {
            for (samples, &number) in samples.chunks_mut(SAMPLES).zip(chunk) {
                let origin = self.block_origin(number);
                for (k, sample) in samples.iter_mut().enumerate() {
                    let index = USizeVec3::new(k % SIDE, k / SIDE % SIDE, k / (SIDE * SIDE));
                    *sample = asset.signed_distance(origin + self.voxel * index.as_dvec3()) as f32;
                }
            }
            let done = done.fetch_add(chunk.len(), Ordering::Relaxed) + chunk.len();
            progress(done as f64 / all as f64);
        });
        Ok(samples)
    }
}
