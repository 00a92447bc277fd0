//! The cost of Algorithm 1, counted without running it.
use std::sync::{Mutex, PoisonError};

use rayon::prelude::*;
use tesdf::Progress;
use tesdf::encode::Surface;
use tesdf::encode::{EncodeError, SampledCell, Sampler, Sampling};

use super::cell::{CellRows, Grid};
use super::face::CandidateFace;
use crate::kernels::encode::sampled::{GROUP, TILE};

/// A [`Sampler`] that counts the distances which [`DeviceSampler`](super::DeviceSampler) would
/// measure. It measures only a few of them, so its lists are not usable.
#[derive(Debug)]
pub struct SampleCounter {
    every: usize,
    blocks: usize,
    counts: Mutex<SampleCounts>,
}

/// Number of distances, and the sizes that it depends on.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SampleCounts {
    /// Cells that get a list.
    pub cells: u64,
    /// Samples per cell.
    pub samples: u64,
    /// Candidate faces after Lemma 1, summed over all cells.
    pub candidates: u64,
    /// Candidate faces of the cell with the most.
    pub max_candidates: u64,
    /// Pairs of a sample and a candidate of its cell. Line 12 of Algorithm 1 measures the distance
    /// of each pair, and so does line 14.
    pub pairs: u64,
    /// Distances from block centers to candidates. The device measures them to select the
    /// candidates of each block.
    pub center_distances: u64,
    /// Thread groups: one for each block of each cell.
    pub groups: u64,
    /// Thread groups that were inspected.
    pub inspected_groups: u64,
    /// Candidates that the inspected groups keep, in total.
    pub kept_candidates: u64,
}

impl SampleCounts {
    /// Candidates that a group keeps, as the mean over the inspected groups.
    pub fn survivors(&self) -> f64 {
        self.kept_candidates as f64 / self.inspected_groups.max(1) as f64
    }

    /// Distances that the device measures, as an estimate. It includes the threads of a block that
    /// have no sample.
    pub fn distances(&self) -> f64 {
        self.center_distances as f64 + 2.0 * GROUP as f64 * self.groups as f64 * self.survivors()
    }
}

impl SampleCounter {
    /// Creates a counter that inspects about `blocks` blocks in each `every`-th cell. Zeros count
    /// as 1.
    pub fn new(every: usize, blocks: usize) -> Self {
        Self { every: every.max(1), blocks: blocks.max(1), counts: Mutex::default() }
    }

    /// The counts of all calls of [`sample`](Sampler::sample) so far.
    pub fn counts(&self) -> SampleCounts {
        *self.counts.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Sampler for SampleCounter {
    fn name(&self) -> String {
        "counted".into()
    }

    fn sample(
        &self,
        surface: &Surface,
        cells: &[SampledCell],
        sampling: &Sampling,
        progress: &Progress,
    ) -> Result<Vec<Vec<f64>>, EncodeError> {
        if progress.is_cancelled() {
            return Err(EncodeError::Cancelled);
        }
        let grid = Grid::new(sampling);
        let blocks = grid.blocks.len() as u64;
        let q = u64::from(sampling.resolution);
        let samples = (q + 1) * (q + 2) * (q + 3) / 6;
        let mut counts = self.counts.lock().unwrap_or_else(PoisonError::into_inner);
        let first = counts.cells as usize;
        for cell in cells {
            let candidates = cell.faces.len() as u64;
            let times = if cell.faces.len() > TILE { 3 } else { 2 };
            counts.candidates += candidates;
            counts.max_candidates = counts.max_candidates.max(candidates);
            counts.pairs += samples * candidates;
            counts.center_distances += times * blocks * candidates;
        }
        counts.samples = samples;
        counts.cells += cells.len() as u64;
        counts.groups += blocks * cells.len() as u64;
        let chosen: Vec<&SampledCell> = cells
            .iter()
            .enumerate()
            .filter(|(at, _)| (first + at).is_multiple_of(self.every))
            .map(|(_, c)| c)
            .collect();
        let seen: Vec<(u64, u64)> =
            chosen.par_iter().map(|cell| self.look_into(surface, cell, &grid)).collect();
        for (groups, survivors) in seen {
            counts.inspected_groups += groups;
            counts.kept_candidates += survivors;
        }
        // Lists of one face keep the layout of the asset small.
        let one = |cell: &SampledCell| {
            (0..cell.faces.len()).map(|k| if k == 0 { 0.0 } else { f64::INFINITY }).collect()
        };
        Ok(cells.iter().map(one).collect())
    }
}

impl SampleCounter {
    /// Inspects some blocks of a cell. Returns their number, and the number of candidates that they
    /// keep in total.
    fn look_into(&self, surface: &Surface, cell: &SampledCell, grid: &Grid) -> (u64, u64) {
        let center = cell.cell.centroid();
        let faces: Vec<_> = cell
            .faces
            .iter()
            .map(|&f| CandidateFace::new(&surface.triangles[f as usize]).candidate(center))
            .collect();
        let rows = CellRows::new(cell, grid);
        let (mut groups, mut survivors) = (0, 0);
        let step = grid.blocks.len().div_ceil(self.blocks);
        for &block in grid.blocks.iter().skip(step / 2).step_by(step) {
            let middle = rows.middle(block, grid.resolution);
            let squared: Vec<f32> = faces.iter().map(|&f| f.squared_distance(middle)).collect();
            let nearest = squared.iter().copied().fold(f32::INFINITY, f32::min);
            let limit = rows.block_limit(nearest);
            groups += 1;
            survivors += squared.iter().filter(|s| **s <= limit * limit).count() as u64;
        }
        (groups, survivors)
    }
}
