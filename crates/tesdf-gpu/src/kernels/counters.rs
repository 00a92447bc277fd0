//! Counters of the elements that each stage of a detection passes to the next.
//!
//! Threads append elements in any order. A counter also counts elements for which the buffer has no
//! room; the pass is then repeated with larger buffers. Contacts carry the names by which they are
//! sorted, so the order of threads does not affect the result.
use cubecl::prelude::*;

/// Ordered pairs of instances: the surface of the first is tested in the field of the second.
pub const ORDERED_PAIRS: u32 = 0;
/// Blocks: groups of up to 32 meshlets, of all ordered pairs.
pub const BLOCKS: u32 = 1;
/// Meshlets that can touch.
pub const MESHLETS: u32 = 2;
/// Polygons (faces clipped by cells), or in Node-TES nodes with their cells.
pub const POLYGONS: u32 = 3;
/// Contacts.
pub const CONTACTS: u32 = 4;
/// Contacts that the cosine filter dropped.
pub const FILTERED: u32 = 5;
/// Faces or nodes that the broad phase kept.
pub const CANDIDATES: u32 = 6;
/// Threads whose loops the driver stopped early: see [`Counters::tell_if_broken_off`].
pub const BROKEN_OFF: u32 = 7;
/// Evaluations of the field by the modes face and exact. Counted on request.
pub const EVALUATIONS: u32 = 8;
/// Distances of points or polygons and faces. Counted on request.
pub const DISTANCES: u32 = 9;
/// Instances of shapes with a vertex that was moved to an invalid position.
pub const BADLY_MOVED: u32 = 10;
/// Contacts that did not converge. Counted only in a reduction, because the host then reads only
/// the kept contacts.
pub const UNCONVERGED: u32 = 11;
/// Pairs of instances with contacts. Counted only in a reduction.
pub const TOUCHING: u32 = 12;
/// Contacts that belong to these pairs.
pub const MEMBERS: u32 = 13;
/// Contacts that the reduction keeps.
pub const KEPT: u32 = 14;
/// Threads that found an overlap that contacts need not show: see
/// [`hidden`](crate::kernels::detect::hidden).
pub const HIDDEN: u32 = 15;
/// Instances that an array on the device places at what is no pose.
pub const BADLY_PLACED: u32 = 16;
/// Number of counters.
pub const COUNTERS: usize = 17;

/// The counters, one atomic word each.
#[derive(CubeType, CubeLaunch)]
pub struct Counters {
    pub words: Box<[Atomic<u32>]>,
}

#[cube]
impl Counters {
    /// Adds 1 and returns the count before. This count is the index at which to append an element.
    pub fn append(&self, #[comptime] counter: u32) -> u32 {
        self.words[counter as usize].fetch_add(1u32)
    }

    /// Adds `some` and returns the count before.
    pub fn add(&self, #[comptime] counter: u32, some: u32) -> u32 {
        self.words[counter as usize].fetch_add(some)
    }

    /// Number of elements in a buffer with capacity `room`.
    pub fn within(&self, #[comptime] counter: u32, room: u32) -> u32 {
        self.words[counter as usize].load().min(room)
    }

    /// Counts this thread when the driver stops its loops early. Mesa's llvmpipe allows 65,535
    /// iterations of all loops of a thread together. After that it continues as if the loops had
    /// ended, and each later loop runs once. So this loop then counts to one instead of two. Call
    /// it last. `elements` must be at least 1, in a way that the compiler cannot know.
    pub fn tell_if_broken_off(&self, elements: u32) {
        let two = select(elements > 0u32, 2u32, 0u32);
        let mut count = 0u32;
        while count < two {
            count += 1u32;
        }
        if count != two {
            self.append(BROKEN_OFF);
        }
    }
}

/// Largest number of groups of a launch in one dimension. Every device allows it.
pub const MAX_GROUPS: u32 = 32_768;

/// Computes the number of groups of a stage in x, y and z: `per` elements per group, from a buffer
/// with capacity `room`, in x and y, and all of them `slabs` times in z.
#[cube(launch, create_dummy_kernel)]
pub fn groups_for(
    counters: &Counters,
    groups: &mut [u32],
    room: u32,
    per: u32,
    slabs: u32,
    #[comptime] counter: u32,
) {
    if ABSOLUTE_POS == 0usize {
        let needed = (counters.within(counter, room) + per - 1u32) / per;
        let wide = needed.min(MAX_GROUPS).max(1u32);
        groups[0] = wide;
        groups[1] = ((needed + wide - 1u32) / wide).max(1u32);
        groups[2] = slabs;
    }
}
