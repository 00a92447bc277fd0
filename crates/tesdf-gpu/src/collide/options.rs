//! The options and the report of a detector.
use std::time::Duration;

use super::counts::Counts;
use super::scene::ShapeBytes;

/// Capacities of the pipeline buffers, in elements.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Capacities {
    /// Ordered pairs of instances.
    pub ordered_pairs: u32,
    /// Blocks: groups of up to 32 meshlets, of all ordered pairs.
    pub blocks: u32,
    /// Meshlets that can touch.
    pub meshlets: u32,
    /// Polygons (faces clipped by cells), with contacts per face the faces, or in Node-TES nodes
    /// with their cells.
    pub polygons: u32,
    /// Contacts before a reduction.
    pub contacts: u32,
    /// Contacts that a reduction keeps. A detector that never reduces allocates no memory for them.
    pub kept: u32,
}

impl Capacities {
    /// Room for nothing.
    pub(super) const NONE: Self =
        Self { ordered_pairs: 0, blocks: 0, meshlets: 0, polygons: 0, contacts: 0, kept: 0 };
}

impl Default for Capacities {
    /// Capacities that take about 10 MiB.
    fn default() -> Self {
        Self {
            ordered_pairs: 1 << 10,
            blocks: 1 << 12,
            meshlets: 1 << 14,
            polygons: 1 << 16,
            contacts: 1 << 14,
            kept: 1 << 12,
        }
    }
}

/// The behavior when a buffer is too small.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Memory {
    /// The buffers grow, and the pass is repeated.
    #[default]
    Grow,
    /// The detection fails with [`GpuError::Full`](crate::GpuError::Full).
    Fixed,
}

/// The number of threads that work on a polygon.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Lanes {
    /// 32 threads, which share the faces of the cell's list.
    #[default]
    Group,
    /// One thread, for comparison (Fig. 4 of the paper). Used by Face-TES.
    Single,
}

/// The way in which the threads of a group find their least distance. The contacts are the same.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Exchange {
    /// Subgroup operations where subgroups have 32 threads, and otherwise shared memory.
    #[default]
    Device,
    /// Shared memory.
    Shared,
}

/// The meshlets, faces and cells that are skipped before the narrow phase. The contacts are the
/// same.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Pruning {
    /// Skips elements whose least signed distance is above the contact distance.
    #[default]
    LeastDistance,
    /// Skips only elements outside of the field's bounds or domain. For comparison.
    Bounds,
}

/// Counts in addition to the elements of each stage.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Counting {
    /// No further counts.
    #[default]
    Elements,
    /// Evaluations of the field and distances to faces in the narrow phase of the modes face and
    /// exact. The mode face pays two atomic additions per polygon. The mode exact pays two per
    /// thread, and searches once more for each evaluation.
    Operations,
}

/// The options of a detector.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct DetectorOptions {
    /// Capacities of the buffers at the start.
    pub capacities: Capacities,
    /// The behavior when a capacity is exceeded.
    pub memory: Memory,
    /// The number of threads that work on a polygon.
    pub lanes: Lanes,
    /// The way in which these threads exchange values.
    pub exchange: Exchange,
    /// The elements that are skipped before the narrow phase.
    pub pruning: Pruning,
    /// Counts in addition to the elements of each stage.
    pub counting: Counting,
    /// Largest number of pairs of instances for which the device tests the bounds of all pairs of
    /// each world. For more pairs, a tree on the processor finds the pairs whose bounds meet.
    pub max_pair_tests: u64,
}

impl Default for DetectorOptions {
    /// Growing buffers, 32 threads per polygon, pruning by distances, and at most 2^27 tests of
    /// bounds.
    fn default() -> Self {
        Self {
            capacities: Capacities::default(),
            memory: Memory::default(),
            lanes: Lanes::default(),
            exchange: Exchange::default(),
            pruning: Pruning::default(),
            counting: Counting::default(),
            max_pair_tests: 1 << 27,
        }
    }
}

/// The report of a detection.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct DeviceReport {
    /// Launches of the last pass. Their number depends on the options and on the kinds of shapes,
    /// but not on the number of bodies, worlds or contacts.
    pub launches: usize,
    /// Number of passes. There is more than one when a buffer was too small.
    pub passes: usize,
    /// Bytes that were sent to the device, in all passes.
    pub sent: usize,
    /// Bytes that were read from the device, in all passes.
    pub read: usize,
    /// Number of pairs of instances whose contacts the processor has found, because kernels do not
    /// detect a shape, or not with these options.
    pub pairs_on_processor: usize,
    /// Counts of the last pass.
    pub counts: Counts,
    /// Name and device time of each launch of the last pass, in order. Empty except after
    /// [`Detector::detect_timed`](super::Detector::detect_timed).
    pub stages: Vec<(&'static str, Duration)>,
}

/// Memory on the device, in bytes.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct DeviceBytes {
    /// Memory of the shapes. Instances share shapes.
    pub shapes: ShapeBytes,
    /// Name and size of each pipeline buffer.
    pub pipeline: Vec<(&'static str, usize)>,
    /// Memory for each instance during a detection.
    pub per_instance: usize,
}

impl DeviceBytes {
    /// The total, with the memory of `instances` instances.
    pub fn with_instances(&self, instances: usize) -> usize {
        let ShapeBytes { table, words, rows, fans } = self.shapes;
        let pipeline: usize = self.pipeline.iter().map(|(_, bytes)| bytes).sum();
        table + words + rows + fans + pipeline + instances * self.per_instance
    }
}
