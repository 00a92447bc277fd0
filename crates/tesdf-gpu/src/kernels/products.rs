//! What the stages of a detection hand on, and how much of it there is.
//!
//! Threads append in any order: a counter says how much was wanted, also when it was more than the buffer holds, and then the pass is redone
//! with greater ones. Contacts carry the ids that they are sorted by, so that no order of threads reaches the user.
use cubecl::prelude::*;

/// Ordered pairs of instances: one body's surface against another's field.
pub const DIRECTIONS: u32 = 0;
/// Runs of 32 meshlets of a direction.
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
/// Threads whose loops a driver has broken off: see [`tell_if_broken_off`].
pub const BROKEN_OFF: u32 = 7;
/// Evaluations of the field by the narrow phase of faces, when they are counted.
pub const EVALUATIONS: u32 = 8;
/// Point–triangle distances of their lists.
pub const DISTANCES: u32 = 9;
/// Instances of shapes that have a vertex where none can be.
pub const BADLY_MOVED: u32 = 10;
/// Contacts that did not converge, when contacts are reduced: those that are read back do not tell.
pub const UNCONVERGED: u32 = 11;
/// Pairs of instances that touch, when contacts are reduced.
pub const TOUCHING: u32 = 12;
/// Places of [`MEMBER_ROWS`] that pairs have taken, then.
pub const MEMBERS: u32 = 13;
/// Contacts that the reduction keeps.
pub const KEPT: u32 = 14;
/// Threads that found an overlap that no contact need show: see [`hidden`](super::hidden).
pub const HIDDEN: u32 = 15;
/// How many counters there are.
pub const COUNTERS: usize = 16;

/// Words of a direction: instance a, instance b, shape of a, shape of b.
pub const DIRECTION_WORDS: usize = 4;
/// Rows of a direction: the linear part by rows, each with its shift; then scale, reach and radius of the surface.
pub const DIRECTION_ROWS: usize = 4;
/// Words of a block: direction, first meshlet. Of a meshlet: direction, meshlet.
pub const PAIR_WORDS: usize = 2;
/// Words of a polygon: direction, face of a, number of the cell's word ([`NONE`](super::assets::NONE) outside of the cube), number of
/// vertices. Of a node: the corner instead.
pub const POLYGON_WORDS: usize = 4;
/// Rows of a polygon: up to eight vertices, as weights of the second and third corner of the face.
pub const POLYGON_ROWS: usize = 4;
/// Most vertices of a polygon: a triangle clipped by a tetrahedron has seven.
pub const POLYGON_VERTICES: usize = 8;
/// Words of a contact: instances a and b, face of a, cell, face of b, its feature, corner of a with [`CONVERGED`] when the minimum was found,
/// direction.
pub const CONTACT_WORDS: usize = 8;
/// Added to the corner of a contact whose minimum was found.
pub const CONVERGED: u32 = 4;
/// Rows of a contact: point of a and distance, gradient, point of b; in the field's frame.
pub const CONTACT_ROWS: usize = 3;
/// Words of a pair that touches: instances of its first direction, contacts, its first member, contacts that are kept.
pub const TOUCHING_WORDS: usize = 5;
/// Rows of a contact as a member of its pair, in the field's frame of the pair's first direction: point and distance, force on the first instance and size
/// of what was rounded. Later its wrench and the way there from the hull of those kept: see [`reduce`](super::reduce).
pub const MEMBER_ROWS: usize = 4;
/// Rows of what a reduction has lost: center and length, in the frame of the members; then the error.
pub const REPORT_ROWS: usize = 2;

/// Where the next element of a product goes.
#[cube]
pub fn append(counters: &[Atomic<u32>], #[comptime] product: u32) -> u32 {
    counters[product as usize].fetch_add(1u32)
}

/// Counts the thread when the driver breaks off its loops: Mesa's llvmpipe allows a thread 65,535 iterations of all loops together, and goes on as if they had
/// ended. From then on a loop has one iteration, so this one counts to one instead of two. Called last; `two` is 2, which no compiler may know.
#[cube]
pub fn tell_if_broken_off(counters: &[Atomic<u32>], two: u32) {
    let mut count = 0u32;
    while count < two {
        count += 1u32;
    }
    if count != two {
        counters[BROKEN_OFF as usize].fetch_add(1u32);
    }
}

/// Groups that a stage needs for `wanted` elements of at most `most`, `per` to a group: x and y.
#[cube(launch, create_dummy_kernel)]
pub fn groups_for(
    counters: &[Atomic<u32>],
    groups: &mut [u32],
    most: u32,
    per: u32,
    #[comptime] product: u32,
) {
    if ABSOLUTE_POS == 0usize {
        let count = counters[product as usize].load().min(most);
        let needed = (count + per - 1u32) / per;
        let wide = needed.min(32768u32).max(1u32);
        groups[0] = wide;
        groups[1] = ((needed + wide - 1u32) / wide).max(1u32);
        groups[2] = 1u32;
    }
}
