//! Solves the contact problems of islands on a device.
use cubecl::prelude::*;
use tesdf::collide::CollideError;
use tesdf_sim::newton::internal::{Packed, SolveIslands};

use crate::GpuError;
use crate::device::Device;
use crate::kernels::interior::descend::descend;
use crate::kernels::interior::problem::{GROUP, MemoryLaunch, ProblemsLaunch, STATE, SUMS};

/// Fewer rows are left to the processor: a launch and the copies take as long as some hundred rows
/// there.
const LEAST_ROWS: usize = 512;

/// Solves the contact problems of islands on a CUDA device, in `f64`.
pub struct IslandSolver(Device);

impl IslandSolver {
    /// A solver on a device; `None` for a device that is reached through wgpu, which has no `f64`.
    pub fn new(device: &Device) -> Option<Self> {
        device.cuda_number()?;
        Some(Self(device.clone()))
    }

    fn results(&self, problems: &Packed) -> Result<Vec<f64>, GpuError> {
        let Self(device) = self;
        let headers = device.upload("headers of islands", problems.headers.as_flattened())?;
        let words = device.upload("words of islands", &problems.words)?;
        let numbers = device.upload("numbers of islands", &problems.numbers)?;
        let empty = |name: &'static str, count: usize| device.empty(name, size_of::<f64>() * count);
        let rows = empty("rows of islands", STATE as usize * problems.rows)?;
        let sums = empty("sums of islands", SUMS as usize * problems.runs)?;
        let matrices = empty("matrices of islands", problems.entries)?;
        let results = empty("results of islands", problems.results)?;
        descend::launch(
            device.client(),
            CubeCount::Static(problems.headers.len() as u32, 1, 1),
            CubeDim::new_1d(GROUP),
            ProblemsLaunch::new(headers.words(), words.words(), numbers.argument(8)),
            MemoryLaunch::new(rows.argument(8), sums.argument(8), matrices.argument(8), results.argument(8)),
        );
        device.read(&results, problems.results)
    }
}

impl SolveIslands for IslandSolver {
    fn least_rows(&self) -> usize {
        LEAST_ROWS
    }

    fn solve(&self, problems: &Packed) -> Result<Vec<f64>, CollideError> {
        self.results(problems).map_err(|e| CollideError::Device(e.to_string()))
    }
}
