//! The number of elements that each stage of a pass has found.
use crate::GpuError;
use crate::device::{Buffer, Device};
use crate::kernels::counters::{self, COUNTERS};

/// The number of elements that each stage of a detection has found.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counts {
    /// Ordered pairs of instances whose bounds meet: the broad phase tests the surface of the first
    /// instance against the field of the second.
    pub ordered_pairs: u32,
    /// Blocks: groups of up to 32 meshlets of the first instance, summed over all ordered pairs.
    pub blocks: u32,
    /// Meshlets that can touch.
    pub meshlets: u32,
    /// Polygons (faces clipped by cells), with contacts per face the faces, or in Node-TES nodes
    /// with their cells. The narrow phase makes one query for each.
    pub polygons: u32,
    /// Contacts before a reduction.
    pub contacts: u32,
    /// Contacts that the cosine filter dropped.
    pub filtered: u32,
    /// Faces or nodes that the broad phase kept.
    pub candidates: u32,
    /// Evaluations of the field by the modes face and exact; 0 without
    /// [`Counting::Operations`](crate::Counting::Operations). In the mode face a group of 32
    /// threads makes an evaluation, of up to eight points at once. In the mode exact a thread makes
    /// an evaluation, of one point.
    pub evaluations: u32,
    /// Distances of points and faces in these evaluations and, in the mode exact, of polygons and
    /// faces; 0 without [`Counting::Operations`](crate::Counting::Operations).
    pub distances: u32,
    /// Contacts whose narrow phase did not converge. Counted only in a reduction. Without a
    /// reduction, each contact says whether it converged.
    pub unconverged: u32,
    /// Pairs of instances with contacts. Counted only in a reduction.
    pub touching: u32,
    /// Contacts that belong to the touching pairs. Counted only in a reduction.
    pub members: u32,
    /// Contacts that the reduction keeps.
    pub kept: u32,
    /// Threads that found a hidden overlap: one that contacts need not show.
    pub hidden: u32,
    /// Instances of shapes with a vertex that was moved to an invalid position. More than 0 is an
    /// error.
    pub(super) badly_moved: u32,
    /// Instances whose pose or velocity in an array on the device is none. More than 0 is an error.
    pub(super) badly_placed: u32,
    /// Threads whose loops the driver stopped early. More than 0 is an error.
    pub(super) broken_off: u32,
}

impl Counts {
    /// Reads the counters from the device.
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
            badly_placed: at(counters::BADLY_PLACED),
            broken_off: at(counters::BROKEN_OFF),
        })
    }
}
