//! How many elements each stage of a detection hands on.
//!
//! Threads append in any order. A counter counts what was wanted, also beyond the room of the buffer; then the pass is
//! redone with larger buffers. Contacts carry the names that they are sorted by, so no order of threads reaches the user.
use cubecl::prelude::*;

/// Ordered pairs of instances: one body's surface against another's field.
pub const ORDERED_PAIRS: u32 = 0;
/// Runs of 32 meshlets of an ordered pair.
pub const BLOCKS: u32 = 1;
/// Meshlets that can touch.
pub const MESHLETS: u32 = 2;
/// Faces that can touch, clipped by cells; or nodes, with their cells.
pub const POLYGONS: u32 = 3;
/// Contacts.
pub const CONTACTS: u32 = 4;
/// Contacts that the cosine filter dropped.
pub const FILTERED: u32 = 5;
/// Faces or nodes that the broad phase left.
pub const CANDIDATES: u32 = 6;
/// Threads whose loops a driver has broken off: see [`Counters::tell_if_broken_off`].
pub const BROKEN_OFF: u32 = 7;
/// Evaluations of the field by the narrow phase of faces, when they are counted.
pub const EVALUATIONS: u32 = 8;
/// Point–triangle distances of their lists.
pub const DISTANCES: u32 = 9;
/// Instances of shapes with a vertex that was moved to an impossible position.
pub const BADLY_MOVED: u32 = 10;
/// Contacts that did not converge, when contacts are reduced: those that are read back are not all.
pub const UNCONVERGED: u32 = 11;
/// Pairs of instances that touch, when contacts are reduced.
pub const TOUCHING: u32 = 12;
/// Members of pairs, then.
pub const MEMBERS: u32 = 13;
/// Contacts that the reduction keeps.
pub const KEPT: u32 = 14;
/// Threads that found an overlap that contacts need not show: see [`hidden`](super::middle::hidden).
pub const HIDDEN: u32 = 15;
/// Number of counters.
pub const COUNTERS: usize = 16;

/// One atomic word for each of the above.
#[derive(CubeType, CubeLaunch)]
pub struct Counters {
    pub words: Box<[Atomic<u32>]>,
}

#[cube]
impl Counters {
    /// Counts one, and returns the count before: where an appended element goes.
    pub fn append(&self, #[comptime] counter: u32) -> u32 {
        self.words[counter as usize].fetch_add(1u32)
    }

    /// Counts some, and returns the count before.
    pub fn add(&self, #[comptime] counter: u32, some: u32) -> u32 {
        self.words[counter as usize].fetch_add(some)
    }

    /// How many elements there are in a buffer with room for `room`.
    pub fn within(&self, #[comptime] counter: u32, room: u32) -> u32 {
        self.words[counter as usize].load().min(room)
    }

    /// Counts the thread when the driver breaks off its loops: Mesa's llvmpipe allows a thread 65,535 iterations of all
    /// loops together, and goes on as if they had ended. From then on a loop has one iteration, so this one counts to one
    /// instead of two. Called last; `elements` is at least 1, which no compiler may know.
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

/// Groups of a stage with `per` elements to a group, of a buffer with room for `room`: x, y and z.
#[cube(launch, create_dummy_kernel)]
pub fn groups_for(counters: &Counters, groups: &mut [u32], room: u32, per: u32, #[comptime] counter: u32) {
    if ABSOLUTE_POS == 0usize {
        let needed = (counters.within(counter, room) + per - 1u32) / per;
        let wide = needed.min(32768u32).max(1u32);
        groups[0] = wide;
        groups[1] = ((needed + wide - 1u32) / wide).max(1u32);
        groups[2] = 1u32;
    }
}
