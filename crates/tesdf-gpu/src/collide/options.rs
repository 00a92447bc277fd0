//! Options of a detector, and its report.
use std::time::Duration;

use super::counts::Counts;
use super::scene::ShapeBytes;

/// Room for the elements that stages hand on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Capacities {
    /// Ordered pairs of instances.
    pub ordered_pairs: u32,
    /// Runs of 32 meshlets of an ordered pair.
    pub blocks: u32,
    /// Meshlets that can touch.
    pub meshlets: u32,
    /// Clipped faces, or nodes, with their cells.
    pub polygons: u32,
    /// Contacts.
    pub contacts: u32,
    /// Contacts that a reduction keeps. Without a reduction no memory is held for them.
    pub kept: u32,
}

impl Default for Capacities {
    /// Some 10 MiB.
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

/// What happens when a buffer is too small.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Memory {
    /// Buffers grow and the pass is redone.
    #[default]
    Grow,
    /// The detection fails with [`GpuError::Full`](crate::GpuError::Full).
    Fixed,
}

/// How a polygon is worked on.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Lanes {
    /// 32 threads, which share the faces of the cell's list.
    #[default]
    Group,
    /// A thread alone, for comparison (Fig. 4).
    Single,
}

/// How a group finds the least of its distances. Contacts are the same.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Exchange {
    /// Between the threads of a subgroup where those are 32, else through shared memory.
    #[default]
    Device,
    /// Through shared memory.
    Shared,
}

/// Which meshlets, faces and cells are left out before the narrow phase. Contacts are the same.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Pruning {
    /// Those that their least signed distance rules out.
    #[default]
    LeastDistance,
    /// Those out of the bounds or the domain of the field, for comparison.
    Bounds,
}

/// What is counted besides the elements that stages hand on.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Counting {
    /// Nothing.
    #[default]
    Elements,
    /// Evaluations of the field and point–triangle distances of Face-TES; costs two atomic additions a polygon.
    Operations,
}

/// Options of a detector.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct DetectorOptions {
    /// Room at the start.
    pub capacities: Capacities,
    /// What happens when that is not enough.
    pub memory: Memory,
    /// How a polygon is worked on.
    pub lanes: Lanes,
    /// How its threads exchange values.
    pub exchange: Exchange,
    /// Which elements are left out before the narrow phase.
    pub pruning: Pruning,
    /// What is counted besides the elements.
    pub counting: Counting,
    /// Up to so many pairs of instances within worlds the device tests all of them; beyond, the processor finds the pairs
    /// that meet, by a tree.
    pub max_pair_tests: u64,
}

impl Default for DetectorOptions {
    /// Growing buffers, groups of 32, pruning, 2^27 tests of bounds.
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
    /// Launches of one pass, whatever the scene.
    pub launches: usize,
    /// Passes: more than one when buffers grew.
    pub passes: usize,
    /// Bytes that were sent to the device.
    pub sent: usize,
    /// Bytes that were read back.
    pub read: usize,
    /// What was counted, by the last pass.
    pub counts: Counts,
    /// Device time by stage, of [`Detector::detect_timed`](super::Detector::detect_timed).
    pub stages: Vec<(&'static str, Duration)>,
}

/// Bytes on the device, by buffer.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct DeviceBytes {
    /// Shapes, each once.
    pub shapes: ShapeBytes,
    /// Pipeline buffers, by name.
    pub pipeline: Vec<(&'static str, usize)>,
    /// State of an instance, during a detection.
    pub per_instance: usize,
}

impl DeviceBytes {
    /// All, with the state of so many instances.
    pub fn with_instances(&self, instances: usize) -> usize {
        let ShapeBytes { table, words, rows } = self.shapes;
        let pipeline: usize = self.pipeline.iter().map(|(_, bytes)| bytes).sum();
        table + words + rows + pipeline + instances * self.per_instance
    }
}
