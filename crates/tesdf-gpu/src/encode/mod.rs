//! Algorithm 1 on a device.
mod cell;
mod count;
mod face;

use cubecl::prelude::*;
use rayon::prelude::*;
use tesdf::Progress;
use tesdf::encode::{EncodeError, Processor, SampledCell, Sampler, Sampling, Surface};

use cell::{CellRows, Grid};
pub use count::{SampleCounter, SampleCounts};
use face::CandidateFace;

use crate::GpuError;
use crate::device::{Device, spread};
use crate::kernels::counters;
use crate::kernels::encode::sampled::{self as kernel, FACE_ROWS, GROUP, SamplesLaunch, sample};

/// Rounding error that is allowed for the difference of two distances, relative to the sum of the
/// cell's radius and the distance: section 3 of docs/math.md.
pub const ROUNDING: f64 = kernel::ROUNDING as f64;

/// Measures the samples of [`Method::Sampled`](tesdf::encode::Method::Sampled) on a device.
/// [`Encoder::sampler`](tesdf::Encoder::sampler) takes it.
///
/// The device measures distances in `f32`. Its lists have every face of the processor's lists. Each
/// further face is, at some sample, at most ε + 2 · [`ROUNDING`] · (R + d) farther than the nearest
/// face, where R is the radius of the cell and d the distance. The certificate names the kind of
/// device.
///
/// The same device gives the same bytes. When a device fails, [`EncodeError::Sampler`] carries the
/// [`GpuError`].
#[derive(Clone, Debug)]
pub struct DeviceSampler {
    device: Device,
    limits: SamplerLimits,
    /// Candidates that fit into a buffer. The processor samples a cell with more candidates.
    max_candidates: usize,
}

/// Limits on the work that a device gets at a time. They change the time, but not the result.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SamplerLimits {
    /// Candidates per batch of cells. A single cell may have more. Each candidate takes 164 bytes.
    pub candidates: usize,
    /// Distances per launch, approximately. Ctrl-C waits for the end of a launch, and the watchdog
    /// of a driver may stop a long one.
    pub distances: u64,
}

impl Default for SamplerLimits {
    /// 2^18 candidates, which take 43 MB, and 2^28 distances. Such a launch takes one to two
    /// seconds on the software device; on a graphics card it should take some milliseconds (not
    /// measured).
    fn default() -> Self {
        Self { candidates: 1 << 18, distances: 1 << 28 }
    }
}

impl DeviceSampler {
    /// Creates a sampler with limits that suit most devices.
    pub fn new(device: Device) -> Self {
        Self::with_limits(device, SamplerLimits::default())
    }

    /// Creates a sampler with the given limits.
    pub fn with_limits(device: Device, limits: SamplerLimits) -> Self {
        let max_bytes = usize::try_from(device.info().max_buffer_bytes).unwrap_or(usize::MAX);
        Self { device, limits, max_candidates: max_bytes / (FACE_ROWS * 16) }
    }

    fn run(
        &self,
        faces: &[CandidateFace],
        cells: &[SampledCell],
        grid: &Grid,
        progress: &Progress,
    ) -> Result<Vec<Vec<f64>>, EncodeError> {
        let of_cells: Vec<CellRows> = cells.iter().map(|cell| CellRows::new(cell, grid)).collect();
        let mut first = 0;
        let ranges: Vec<[u32; 2]> = cells
            .iter()
            .map(|cell| {
                let range = [first, cell.faces.len() as u32];
                first += range[1];
                range
            })
            .collect();
        let of_cell = |cell: &SampledCell| {
            let center = cell.cell.centroid();
            cell.faces.iter().map(|&f| faces[f as usize].rows(center)).collect::<Vec<_>>()
        };
        let rows: Vec<[[f32; 4]; FACE_ROWS]> = cells.par_iter().flat_map_iter(of_cell).collect();
        let bits = self.launch(&rows, &of_cells, &ranges, grid, cells, progress)?;
        Ok(ranges
            .iter()
            .zip(&of_cells)
            .map(|(&[first, count], cell)| {
                let found = &bits[first as usize..][..count as usize];
                found.iter().map(|&bits| distance(bits, cell.radius())).collect()
            })
            .collect())
    }

    /// Returns the squared distances of all candidates, as bits of `f32`.
    fn launch(
        &self,
        rows: &[[[f32; 4]; FACE_ROWS]],
        of_cells: &[CellRows],
        ranges: &[[u32; 2]],
        grid: &Grid,
        cells: &[SampledCell],
        progress: &Progress,
    ) -> Result<Vec<u32>, EncodeError> {
        let device = &self.device;
        let refused = |e: GpuError| EncodeError::Sampler(Box::new(e));
        let rows = device.upload("candidates", bytemuck::cast_slice::<_, [f32; 4]>(rows)).map_err(refused)?;
        let least = vec![NOT_FOUND; rows.bytes() / (FACE_ROWS * 16)];
        let of_cells = device.upload("cells", of_cells).map_err(refused)?;
        let ranges = device.upload("candidates of cells", ranges).map_err(refused)?;
        let blocks = device.upload("blocks of samples", &grid.blocks).map_err(refused)?;
        let found = device.upload("distances", &least).map_err(refused)?;
        for (first, groups) in self.launches(cells, grid.blocks.len()) {
            if progress.is_cancelled() {
                return Err(EncodeError::Cancelled);
            }
            sample::launch(
                device.client(),
                spread(groups as u32),
                CubeDim::new_1d(GROUP as u32),
                SamplesLaunch::new(
                    rows.rows(),
                    of_cells.rows(),
                    ranges.words(),
                    blocks.words(),
                    grid.blocks.len() as u32,
                    grid.resolution,
                ),
                found.words(),
                first as u32,
                groups as u32,
            );
            // Waits for each launch, so that the work can be cancelled between two launches.
            device.read::<u32>(&found, 1).map_err(refused)?;
        }
        device.read(&found, least.len()).map_err(refused)
    }

    /// First group and number of groups of each launch.
    fn launches(&self, cells: &[SampledCell], blocks: usize) -> Vec<(usize, usize)> {
        let mut launches = Vec::new();
        let (mut first, mut groups, mut work) = (0, 0, 0);
        for cell in cells {
            let candidates = cell.faces.len();
            let of_group = 1 + 3 * candidates as u64 + 2 * (GROUP * candidates.min(SURVIVORS)) as u64;
            let mut left = blocks;
            while left > 0 {
                let room = self.limits.distances.saturating_sub(work) / of_group;
                let most = MAX_GROUPS * MAX_GROUPS - groups;
                let taken = left.min(usize::try_from(room).unwrap_or(usize::MAX)).min(most);
                if taken == 0 && groups > 0 {
                    launches.push((first, groups));
                    (first, groups, work) = (first + groups, 0, 0);
                    continue;
                }
                groups += taken.max(1);
                work += taken as u64 * of_group;
                left -= taken.max(1);
            }
        }
        if groups > 0 {
            launches.push((first, groups));
        }
        launches
    }
}

/// The result for a candidate that no sample needs. As an `f32` these bits are NaN.
const NOT_FOUND: u32 = u32::MAX;
/// Groups of a launch in each dimension.
const MAX_GROUPS: usize = counters::MAX_GROUPS as usize;
/// Number of faces that a block of samples is assumed to need. It serves to estimate the work of a
/// launch.
const SURVIVORS: usize = 32;

impl Sampler for DeviceSampler {
    fn name(&self) -> String {
        format!("sampled, f32, {}", self.device.info().kind)
    }

    fn sample(
        &self,
        surface: &Surface,
        cells: &[SampledCell],
        sampling: &Sampling,
        progress: &Progress,
    ) -> Result<Vec<Vec<f64>>, EncodeError> {
        let faces: Vec<CandidateFace> = surface.triangles.par_iter().map(CandidateFace::new).collect();
        let grid = Grid::new(sampling);
        let most = self.max_candidates;
        let mut found = Vec::with_capacity(cells.len());
        let mut rest = cells;
        while let Some(first) = rest.first() {
            if first.faces.len() > most {
                found.extend(Processor.sample(surface, &rest[..1], sampling, progress)?);
                rest = &rest[1..];
                continue;
            }
            let room = self.limits.candidates.min(most);
            let mut held = 0;
            let fits = |cell: &&SampledCell| {
                held += cell.faces.len();
                held <= room
            };
            let (batch, after) = rest.split_at(rest.iter().take_while(fits).count().max(1));
            found.extend(self.run(&faces, batch, &grid, progress)?);
            rest = after;
        }
        Ok(found)
    }
}

/// The distance d_f, minus the rounding error that it may have. The order of the faces of a cell
/// stays the same.
fn distance(bits: u32, radius: f64) -> f64 {
    if bits == NOT_FOUND {
        return f64::INFINITY;
    }
    let distance = f64::from(f32::from_bits(bits)).sqrt();
    (distance - ROUNDING * (radius + distance)).max(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use tesdf::domain::Cell;
    use tesdf::encode::Threshold;
    use tesdf::encode::internal::Touching;
    use tesdf::geometry::internal::AabbTree;
    use tesdf::glam::DVec3;
    use tesdf::mesh::TriangleMesh;

    #[test]
    fn cells_that_fit_no_buffer_are_sampled_on_the_processor() {
        let vertices = vec![DVec3::ZERO, 0.5 * DVec3::X, 0.5 * DVec3::Y, 0.5 * DVec3::Z];
        let mesh = TriangleMesh::new(vertices.clone(), vec![[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])
            .expect("valid");
        let surface = Surface::new(&mesh, 1.0, Touching::Ignored);
        let cell = Cell { corners: [0, 1, 2, 3].map(|k| vertices[k]), depth: 0 };
        let sampling = Sampling { resolution: 6, threshold: Threshold::Absolute(0.01), ..Sampling::PAPER };
        let boxes: Vec<_> = surface.triangles.iter().map(|t| tesdf::geometry::Aabb::of(&t.corners)).collect();
        let cell = SampledCell::new(&surface, &AabbTree::build(&boxes, 4), cell, &sampling, 1.0);
        assert_eq!(cell.faces.len(), 4);
        let progress = Progress::default();
        let mut sampler = DeviceSampler::new(Device::choose(None).expect("a device"));
        sampler.max_candidates = 3;
        let found =
            sampler.sample(&surface, std::slice::from_ref(&cell), &sampling, &progress).expect("samples");
        assert_eq!(found, Processor.sample(&surface, &[cell], &sampling, &progress).expect("samples"));
    }
}
