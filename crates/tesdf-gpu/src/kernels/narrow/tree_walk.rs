//! The faces of a body that are near a part of a surface. The threads of a group walk through the
//! face tree together.
use cubecl::prelude::*;
use tesdf::asset::layout;
use tesdf::query::internal;

use crate::kernels::detect::ordered_pair::Part;
use crate::kernels::geometry::triangle::Face;
use crate::kernels::geometry::vector::{LEAST_DIVISOR, V3, zero};
use crate::kernels::narrow::exchange::LANES;
use crate::kernels::query::nearest::{TREE_DEPTH, TreeChild};
use crate::kernels::query::tetrahedra::bounds_of;
use crate::kernels::scene::shape::{Bounds, CHILDREN, Field, NONE};
use crate::kernels::search::piece::Pool;

/// Error of a bound, relative to the largest coordinate of the part and of the field's mesh, which
/// is 1.
const ROUNDING: f32 = internal::POLYGON_ROUNDING;

/// The axes along which faces and boxes can be apart from a part: those of the frame, the normal to
/// both sides, and the directions out of the sides of a triangle.
#[derive(CubeType, Clone, Copy)]
#[expand(derive(Clone, Copy))]
pub struct Axes {
    bounds: Bounds,
    over: Axis,
    under: Axis,
    ab: Axis,
    bc: Axis,
    ca: Axis,
    /// Error of a bound.
    pub rounding: f32,
}

/// A unit vector, or zero, and the greatest height of the part along it.
#[derive(CubeType, Clone, Copy)]
#[expand(derive(Clone, Copy))]
struct Axis {
    along: V3,
    height: f32,
}

#[cube]
impl Axis {
    /// Lower bound of the heights of a box above the part.
    fn to_box(self, center: V3, half: V3) -> f32 {
        self.along.dot(center) - self.height - self.along.abs().dot(half)
    }

    /// The least height of a face's corner above the part.
    fn to_face(self, f: Face) -> f32 {
        let (a, b, c) = (f.corner(0u32), f.corner(1u32), f.corner(2u32));
        self.along.dot(a).min(self.along.dot(b)).min(self.along.dot(c)) - self.height
    }
}

/// Any direction rules out boxes correctly, so its rounding does not matter.
#[cube]
fn axis(part: Part, along: V3) -> Axis {
    let unit = along * (1.0f32 / along.length().max(LEAST_DIVISOR));
    Axis { along: unit, height: unit.dot(part.a).max(unit.dot(part.b)).max(unit.dot(part.c)) }
}

/// `normal` is the unit normal of the part, or zero.
#[cube]
pub fn axes_of(part: Part, normal: V3) -> Axes {
    let bounds = bounds_of(part.a, part.b, part.c);
    let reach = bounds.low.abs().max(bounds.high.abs()).greatest();
    Axes {
        bounds,
        over: axis(part, normal),
        under: axis(part, normal.negated()),
        ab: axis(part, (part.b - part.a).cross(normal)),
        bc: axis(part, (part.c - part.b).cross(normal)),
        ca: axis(part, (part.a - part.c).cross(normal)),
        rounding: ROUNDING * (1.0f32 + reach),
    }
}

#[cube]
impl Axes {
    /// Distance to another box along the axes of the frame.
    fn to_bounds(self, other: Bounds) -> f32 {
        (other.low - self.bounds.high).max(self.bounds.low - other.high).max(zero()).length()
    }

    /// Lower bound of the distance to a box, up to `rounding`.
    fn to_box(self, other: Bounds) -> f32 {
        let center = (other.low + other.high) * 0.5f32;
        let half = (other.high - other.low) * 0.5f32;
        let sides = self.ab.to_box(center, half).max(self.bc.to_box(center, half));
        let plane = self.over.to_box(center, half).max(self.under.to_box(center, half));
        self.to_bounds(other).max(plane).max(sides).max(self.ca.to_box(center, half))
    }

    /// Lower bound of the distance to a face, up to `rounding`.
    pub fn to_face(self, f: Face) -> f32 {
        let bounds = bounds_of(f.corner(0u32), f.corner(1u32), f.corner(2u32));
        let sides = self.ab.to_face(f).max(self.bc.to_face(f)).max(self.ca.to_face(f));
        self.to_bounds(bounds).max(self.over.to_face(f)).max(self.under.to_face(f)).max(sides)
    }
}

/// Room for nodes that wait. Where only the nodes of one path to a leaf would still fit, the group
/// takes one node at a time.
const NODES: usize = 256;
const AT_ONCE: u32 = (NODES - TREE_DEPTH) as u32;
/// Largest number of faces of a leaf.
pub const FACES: u32 = layout::TREE_LEAF as u32;
/// Leaves that the group takes at a time, with a thread for each face.
const LEAVES: u32 = LANES / FACES;
/// Room for leaves that wait: a round of nodes adds up to two for each thread.
const WAITING: usize = (2 * LANES + LEAVES) as usize;
/// Bits for the number of nodes in a word that counts nodes and leaves.
const BOTH: u32 = 16;
const NODE_BITS: u32 = (1 << BOTH) - 1;

/// A walk through a face tree: the nodes and leaves that wait, the newest last.
#[derive(CubeType)]
pub struct Walk {
    nodes: Shared<[u32]>,
    leaves: Shared<[u32]>,
    node_count: u32,
    leaf_count: u32,
}

#[cube]
pub fn no_walk() -> Walk {
    Walk {
        nodes: Shared::<[u32]>::new_slice(NODES),
        leaves: Shared::<[u32]>::new_slice(WAITING),
        node_count: 0u32,
        leaf_count: 0u32,
    }
}

/// Both children of a node, the nearer one last. A child that is too far away is [`NONE`].
#[derive(CubeType, CubeTypeMut, Clone, Copy)]
#[expand(derive(Clone, Copy))]
struct Children {
    first: u32,
    second: u32,
}

#[cube]
fn is_node(word: u32) -> bool {
    word != NONE && !TreeChild { word }.is_leaf()
}

#[cube]
fn is_leaf(word: u32) -> bool {
    word != NONE && TreeChild { word }.is_leaf()
}

/// Counts a child as a node or as a leaf.
#[cube]
fn counted(word: u32) -> u32 {
    select(is_node(word), 1u32, 0u32) + select(is_leaf(word), comptime!(1u32 << BOTH), 0u32)
}

#[cube]
impl Axes {
    /// The children of a node of the face tree that can be within `limit`.
    fn near_children(self, field: Field<'_>, node: u32, limit: f32) -> Children {
        let boxes = field.node_boxes(node);
        let left = self.to_box(boxes.left);
        let right = self.to_box(boxes.right);
        let at = field.entry(CHILDREN) + 2u32 * node;
        let left_word = select(left <= limit, field.word(at), NONE);
        let right_word = select(right <= limit, field.word(at + 1u32), NONE);
        let left_first = left > right;
        Children {
            first: select(left_first, left_word, right_word),
            second: select(left_first, right_word, left_word),
        }
    }
}

#[cube]
impl Walk {
    pub fn start(&mut self) {
        sync_cube();
        if UNIT_POS == 0u32 {
            self.nodes[0] = 0u32;
        }
        self.node_count = 1u32;
        self.leaf_count = 0u32;
    }

    /// Goes on until there are leaves for all threads, or no more nodes. Returns the number of
    /// leaves to take next; 0 at the end. Boxes beyond `limit` are skipped. All threads of the
    /// group must call it.
    pub fn next(&mut self, field: Field<'_>, axes: Axes, limit: f32, pool: &mut Pool) -> u32 {
        while self.node_count > 0u32 && self.leaf_count < LEAVES {
            sync_cube();
            let room = select(self.node_count < AT_ONCE, AT_ONCE - self.node_count.min(AT_ONCE), 0u32);
            let taken = self.node_count.min(LANES).min(room.max(1u32));
            let base = self.node_count - taken;
            let mut near = Children { first: NONE.runtime(), second: NONE.runtime() };
            if UNIT_POS < taken {
                near = axes.near_children(field, self.nodes[(base + UNIT_POS) as usize], limit);
            }
            // All nodes are read before the first is overwritten.
            let kept = pool.count(counted(near.first) + counted(near.second));
            let mut node = base + (kept.before & NODE_BITS);
            let mut leaf = self.leaf_count + (kept.before >> BOTH);
            let mut k = 0u32;
            while k < 2u32 {
                let word = select(k == 0u32, near.first, near.second);
                if is_node(word) {
                    self.nodes[node as usize] = word;
                    node += 1u32;
                }
                if is_leaf(word) {
                    self.leaves[leaf as usize] = word;
                    leaf += 1u32;
                }
                k += 1u32;
            }
            self.node_count = base + (kept.all & NODE_BITS);
            self.leaf_count += kept.all >> BOTH;
        }
        sync_cube();
        let taken = self.leaf_count.min(LEAVES);
        self.leaf_count -= taken;
        taken
    }

    /// Face `number` of the leaves that [`next`](Self::next) has taken, of up to [`FACES`] each;
    /// [`NONE`] where there is no such face.
    pub fn face(&self, taken: u32, number: u32) -> u32 {
        let mut face = NONE.runtime();
        if number / FACES < taken {
            let leaf = TreeChild { word: self.leaves[(self.leaf_count + number / FACES) as usize] };
            if number % FACES < leaf.count() {
                face = leaf.start() + number % FACES;
            }
        }
        face
    }
}
