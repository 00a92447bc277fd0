//! What a detector is asked for, and what it reports.
use std::time::Duration;

use crate::images::ImageBytes;
use crate::kernels::products;

/// Most elements of the products that stages hand on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Capacities {
    /// Ordered pairs of instances.
    pub directions: u32,
    /// Runs of 32 meshlets of a direction.
    pub blocks: u32,
    /// Meshlets that can touch.
    pub meshlets: u32,
    /// Clipped faces, or nodes, with their cells.
    pub polygons: u32,
    /// Contacts.
    pub contacts: u32,
    /// Contacts that a reduction keeps. Without one nothing is held for them.
    pub kept: u32,
}

impl Default for Capacities {
    /// Some 10 MiB.
    fn default() -> Self {
        Self {
            directions: 1 << 10,
            blocks: 1 << 12,
            meshlets: 1 << 14,
            polygons: 1 << 16,
            contacts: 1 << 14,
            kept: 1 << 12,
        }
    }
}

/// What happens when a product does not fit.
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

/// How a group finds the least of its distances. The result is the same.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Exchange {
    /// Between the threads of a plane where those are 32, else through shared memory.
    #[default]
    Device,
    /// Through shared memory.
    Shared,
}

/// What is left out before the narrow phase. Contacts are the same.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Pruning {
    /// What the least signed distances of meshlets, faces and cells rule out.
    #[default]
    LeastDistance,
    /// What lies out of the bounds or the domain of the field, for comparison.
    Bounds,
}

/// What is counted besides the products of the stages.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Counting {
    /// Nothing.
    #[default]
    Products,
    /// Evaluations of the field and point–triangle distances of Face-TES; costs two atomic additions a polygon.
    Operations,
}

/// Options of a detector.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct DetectorOptions {
    /// Room at the start.
    pub capacities: Capacities,
    /// What happens when it is not enough.
    pub memory: Memory,
    /// How a polygon is worked on.
    pub lanes: Lanes,
    /// How its threads exchange values.
    pub exchange: Exchange,
    /// What is left out before the narrow phase.
    pub pruning: Pruning,
    /// What is counted besides the products.
    pub counting: Counting,
    /// Up to so many pairs of instances within worlds the device looks at all of them; beyond, the processor finds those that meet, by a tree.
    pub most_pair_tests: u64,
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
            most_pair_tests: 1 << 27,
        }
    }
}

/// What a detection did on the device.
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
    /// What was counted: directions, blocks, meshlets, polygons, contacts, filtered, candidates, broken off, evaluations,
    /// point–triangle distances, which were asked for; instances with a vertex where none can be; then of a reduction: contacts that did not converge, pairs that touch, their members, contacts kept; at
    /// last threads that found an overlap that no contact need show.
    pub counts: [u32; products::COUNTERS],
    /// Device time by stage, when it was asked for.
    pub stages: Vec<(&'static str, Duration)>,
}

/// Bytes on the device, by buffer.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct DeviceBytes {
    /// Shapes, each once.
    pub shapes: ImageBytes,
    /// Products of the stages, by name.
    pub products: Vec<(&'static str, usize)>,
    /// State of an instance, during a detection.
    pub per_instance: usize,
}

impl DeviceBytes {
    /// All, with the state of so many instances.
    pub fn with_instances(&self, instances: usize) -> usize {
        let ImageBytes { table, words, rows } = self.shapes;
        let products: usize = self.products.iter().map(|(_, bytes)| bytes).sum();
        table + words + rows + products + instances * self.per_instance
    }
}
