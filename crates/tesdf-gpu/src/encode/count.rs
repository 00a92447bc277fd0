//! What Algorithm 1 costs, counted instead of done.
use std::sync::{Mutex, PoisonError};

use rayon::prelude::*;
use tesdf::Progress;
use tesdf::encode::Surface;
use tesdf::encode::{EncodeError, SampledCell, Sampler, Sampling};

use super::cell::{CellRows, Grid};
use super::face::CandidateFace;
use crate::kernels::encode::sample::{GROUP, TILE};

/// A [`Sampler`] that counts distances and measures next to none: its lists are of no use.
#[derive(Debug)]
pub struct SampleCounter {
    every: usize,
    blocks: usize,
    counts: Mutex<SampleCounts>,
}

/// How many distances there are.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SampleCounts {
    /// Cells with a list.
    pub cells: u64,
    /// Samples of a cell.
    pub samples: u64,
    /// What Lemma 1 leaves, over all cells.
    pub candidates: u64,
    /// And in the cell where that is most.
    pub max_candidates: u64,
    /// Pairs of a sample and a candidate of its cell: the distances of Algorithm 1. Lines 12 and 14 each take them all.
    pub pairs: u64,
    /// Distances that choose the candidates of the blocks.
    pub looks: u64,
    /// Groups: blocks of all cells.
    pub groups: u64,
    /// Groups that were looked into, and the candidates that they were left with.
    pub seen_groups: u64,
    /// See there.
    pub seen_survivors: u64,
}

impl SampleCounts {
    /// Candidates that a block is left with, on average over those that were looked into.
    pub fn survivors(&self) -> f64 {
        self.seen_survivors as f64 / self.seen_groups.max(1) as f64
    }

    /// Distances that the device measures, threads of a block without a sample included.
    pub fn distances(&self) -> f64 {
        self.looks as f64 + 2.0 * GROUP as f64 * self.groups as f64 * self.survivors()
    }
}

impl SampleCounter {
    /// Looks into so many blocks of every so manieth cell.
    pub fn new(every: usize, blocks: usize) -> Self {
        Self { every: every.max(1), blocks: blocks.max(1), counts: Mutex::default() }
    }

    /// What was counted up to now.
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
            counts.looks += times * blocks * candidates;
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
            counts.seen_groups += groups;
            counts.seen_survivors += survivors;
        }
        // Lists of one face: what is laid out afterwards is small.
        let one = |cell: &SampledCell| {
            (0..cell.faces.len()).map(|k| if k == 0 { 0.0 } else { f64::INFINITY }).collect()
        };
        Ok(cells.iter().map(one).collect())
    }
}

impl SampleCounter {
    /// Blocks of a cell that are looked into, and how many candidates they are left with in all.
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
            let nearest = squared.iter().copied().fold(f32::INFINITY, f32::min).sqrt();
            let limit = rows.block_limit(nearest);
            groups += 1;
            survivors += squared.iter().filter(|s| **s <= limit * limit).count() as u64;
        }
        (groups, survivors)
    }
}
