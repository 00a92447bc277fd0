//! The work of the exact mode, counted on request.
use cubecl::prelude::*;

use crate::kernels::counters::{self, Counters};

/// Evaluations of the field by this thread, and the distances that it has computed. Several threads
/// that look at the same point count it once.
#[derive(CubeType)]
pub struct Work {
    evaluations: u32,
    distances: u32,
    #[cube(comptime)]
    pub counting: bool,
}

#[cube]
pub fn no_work(#[comptime] counting: bool) -> Work {
    Work { evaluations: 0u32, distances: 0u32, counting }
}

#[cube]
impl Work {
    /// An evaluation of the field that takes `distances` of a point and a face. It counts if it
    /// `is_own`: if no other thread looks at the same point.
    pub fn evaluate(&mut self, distances: u32, is_own: bool) {
        self.evaluations += select(is_own, 1u32, 0u32);
        self.distances += select(is_own, distances, 0u32);
    }

    /// Distances of points or polygons and faces.
    pub fn measure(&mut self, distances: u32) {
        self.distances += distances;
    }

    /// Adds the work of this thread to the counters.
    pub fn add_to(&self, counters: &Counters) {
        if comptime!(self.counting) {
            counters.add(counters::EVALUATIONS, self.evaluations);
            counters.add(counters::DISTANCES, self.distances);
        }
    }
}
