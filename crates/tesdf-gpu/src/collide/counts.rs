//! How many elements a pass has found, by stage.
use crate::GpuError;
use crate::device::{Buffer, Device};
use crate::kernels::counters::{self, COUNTERS};

/// What a pass has counted on the device.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counts {
    /// Ordered pairs of instances.
    pub ordered_pairs: u32,
    /// Runs of 32 meshlets of an ordered pair.
    pub blocks: u32,
    /// Meshlets that can touch.
    pub meshlets: u32,
    /// Clipped faces, or nodes, with their cells: the queries of the narrow phase.
    pub polygons: u32,
    /// Contacts, before a reduction.
    pub contacts: u32,
    /// Contacts that the cosine filter dropped.
    pub filtered: u32,
    /// Faces or nodes that the broad phase left.
    pub candidates: u32,
    /// Evaluations of the field by Face-TES, when they are counted.
    pub evaluations: u32,
    /// Point–triangle distances of their lists.
    pub distances: u32,
    /// Contacts that did not converge, when contacts are reduced.
    pub unconverged: u32,
    /// Pairs of instances that touch, when contacts are reduced.
    pub touching: u32,
    /// Contacts as members of those pairs.
    pub members: u32,
    /// Contacts that the reduction keeps.
    pub kept: u32,
    /// Threads that found an overlap that contacts need not show.
    pub hidden: u32,
    /// Instances of shapes with a vertex that was moved to an impossible position: an error.
    pub(super) badly_moved: u32,
    /// Threads whose loops the driver has broken off: an error.
    pub(super) broken_off: u32,
}

impl Counts {
    /// Reads the counters.
    pub(super) fn read(device: &Device, counters: &Buffer) -> Result<Self, GpuError> {
        let words: Vec<u32> = device.read(counters, COUNTERS)?;
        let at = |counter: u32| words[counter as usize];
        Ok(Self {
            ordered_pairs: at(counters::ORDERED_PAIRS),
            blocks: at(counters::BLOCKS),
            meshlets: at(counters::MESHLETS),
            polygons: at(counters::POLYGONS),
            contacts: at(counters::CONTACTS),
            filtered: at(counters::FILTERED),
            candidates: at(counters::CANDIDATES),
            evaluations: at(counters::EVALUATIONS),
            distances: at(counters::DISTANCES),
            unconverged: at(counters::UNCONVERGED),
            touching: at(counters::TOUCHING),
            members: at(counters::MEMBERS),
            kept: at(counters::KEPT),
            hidden: at(counters::HIDDEN),
            badly_moved: at(counters::BADLY_MOVED),
            broken_off: at(counters::BROKEN_OFF),
        })
    }
}
