//! The nearest face to a point, among the faces of a list or all faces.
//!
//! Mirrors `query/nearest.rs` of `tesdf`.
use cubecl::prelude::*;
use tesdf::asset::layout;

use crate::kernels::geometry::vector::{V3, outside_box, v3};
use crate::kernels::query::list::List;
use crate::kernels::query::locate::Cell;
use crate::kernels::scene::shape::{BOXES, Bounds, CHILDREN, Field, FieldExpand, NONE};

/// A face and its squared distance from a point.
#[derive(CubeType, CubeTypeMut, Clone, Copy)]
#[expand(derive(Clone, Copy))]
pub struct Nearest {
    /// Squared distance. Its low bits name the nearest part of the face.
    pub squared: f32,
    /// Index of the face; [`NONE`] when there is none.
    pub face: u32,
}

/// Larger than any squared distance.
pub const FAR: f32 = 1e30;

/// Size of the stack for the face tree, in levels. An asset with a deeper tree cannot be uploaded.
/// The processor has room for
/// [`AabbTree::MAX_DEPTH`](tesdf::geometry::internal::AabbTree::MAX_DEPTH); here each thread would
/// pay for levels that no mesh has needed.
pub const TREE_DEPTH: usize = 48;

const LEAF: u32 = layout::LEAF;
/// Bits for the number of faces of a leaf.
const LEAF_COUNT: u32 = layout::TREE_LEAF as u32 - 1;
const LEAF_COUNT_BITS: u32 = layout::TREE_LEAF_BITS;

/// The result before any face within the squared distance `squared` is found.
#[cube]
pub fn none_within(squared: f32) -> Nearest {
    Nearest { squared, face: NONE.runtime() }
}

/// The start of a search of all faces. It names a face, which is the result where all are as far as
/// [`FAR`]: a body may be that much larger than another one.
#[cube]
pub fn any_face() -> Nearest {
    Nearest { squared: FAR.runtime(), face: 0u32.runtime() }
}

#[cube]
impl Nearest {
    /// The nearer of two faces. At equal distances, the face with the lower index.
    pub fn or(self, other: Nearest) -> Nearest {
        let nearer =
            other.squared < self.squared || (other.squared == self.squared && other.face < self.face);
        Nearest {
            squared: select(nearer, other.squared, self.squared),
            face: select(nearer, other.face, self.face),
        }
    }

    /// The nearer of two faces. At equal distances, the first.
    fn or_nearer(self, other: Nearest) -> Nearest {
        let nearer = other.squared < self.squared;
        Nearest {
            squared: select(nearer, other.squared, self.squared),
            face: select(nearer, other.face, self.face),
        }
    }
}

/// A child of a node of the face tree ([`tesdf::asset::layout::TreeChild`]): a node, or the faces
/// of a leaf.
#[derive(CubeType, Clone, Copy)]
#[expand(derive(Clone, Copy))]
pub struct TreeChild {
    pub word: u32,
}

#[cube]
impl TreeChild {
    pub fn is_leaf(self) -> bool {
        self.word >= LEAF
    }

    /// First face of a leaf.
    pub fn start(self) -> u32 {
        (self.word & comptime!(!LEAF)) >> LEAF_COUNT_BITS
    }

    /// Number of faces of a leaf.
    pub fn count(self) -> u32 {
        (self.word & LEAF_COUNT) + 1u32
    }
}

/// The nearest face, and how many distances the search has computed.
#[derive(CubeType, Clone, Copy)]
#[expand(derive(Clone, Copy))]
struct SearchedTree {
    nearest: Nearest,
    distances: u32,
}

/// The boxes of both children of a node of the face tree.
#[derive(CubeType, Clone, Copy)]
#[expand(derive(Clone, Copy))]
pub struct NodeBoxes {
    pub left: Bounds,
    pub right: Bounds,
}

/// Squared distance from a point to a box.
#[cube]
pub fn to_box(p: V3, bounds: Bounds) -> f32 {
    let outside = outside_box(p, bounds.low, bounds.high);
    outside.dot(outside)
}

#[cube]
impl Field<'_> {
    /// Squared distance from a point to a face.
    fn to_face(self, position: u32, p: V3) -> Nearest {
        Nearest { squared: self.face(position).distance_squared(p), face: position }
    }

    /// The nearest face among every `step`-th face of a list, starting at `first`. At equal
    /// distances, the face with the lowest index.
    pub fn nearest_in_list(self, list: List, first: u32, step: u32, p: V3) -> Nearest {
        let mut found = any_face();
        let mut i = first;
        while i < list.count {
            found = found.or(self.to_face(self.listed(list, i), p));
            i += step;
        }
        found
    }

    /// The boxes of both children of a node of the face tree.
    pub fn node_boxes(self, node: u32) -> NodeBoxes {
        let at = self.entry(BOXES) + 3u32 * node;
        let (r, s, t) = (self.row(at), self.row(at + 1u32), self.row(at + 2u32));
        NodeBoxes {
            left: Bounds {
                low: v3(r.extract(0usize), r.extract(1usize), r.extract(2usize)),
                high: v3(r.extract(3usize), s.extract(0usize), s.extract(1usize)),
            },
            right: Bounds {
                low: v3(s.extract(2usize), s.extract(3usize), t.extract(0usize)),
                high: v3(t.extract(1usize), t.extract(2usize), t.extract(3usize)),
            },
        }
    }

    /// The nearest of all faces, by the face tree. The search may miss faces whose squared distance
    /// is above `limit`.
    pub fn nearest_in_tree(self, p: V3, limit: f32) -> Nearest {
        self.searched_tree(p, none_within(limit)).nearest
    }

    /// The nearest of all faces, by the face tree.
    pub fn nearest_of_all(self, p: V3) -> Nearest {
        self.searched_tree(p, any_face()).nearest
    }

    /// Searches for a nearer face than `start`.
    fn searched_tree(self, p: V3, start: Nearest) -> SearchedTree {
        let children = self.entry(CHILDREN);
        let mut words = Array::<u32>::new(TREE_DEPTH);
        let mut bounds = Array::<f32>::new(TREE_DEPTH);
        let mut found = start;
        let mut distances = 0u32;
        let mut top = 1usize;
        words[0] = 0u32;
        bounds[0] = 0.0f32;
        while top > 0usize {
            top -= 1usize;
            let child = TreeChild { word: words[top] };
            if bounds[top] < found.squared {
                if child.is_leaf() {
                    distances += child.count();
                    let end = child.start() + child.count();
                    let mut face = child.start();
                    while face < end {
                        found = found.or_nearer(self.to_face(face, p));
                        face += 1u32;
                    }
                } else {
                    let boxes = self.node_boxes(child.word);
                    let left = to_box(p, boxes.left);
                    let right = to_box(p, boxes.right);
                    let left_word = self.word(children + 2u32 * child.word);
                    let right_word = self.word(children + 2u32 * child.word + 1u32);
                    let left_first = left <= right;
                    words[top] = select(left_first, right_word, left_word);
                    bounds[top] = left.max(right);
                    words[top + 1usize] = select(left_first, left_word, right_word);
                    bounds[top + 1usize] = left.min(right);
                    top += 2usize;
                }
            }
        }
        SearchedTree { nearest: found, distances }
    }

    /// How many distances of a point and a face [`nearest`](Self::nearest) computes.
    pub fn distances(self, cell: Cell, p: V3) -> u32 {
        let mut distances = 0u32;
        if self.is_mesh() {
            if cell.is_listed() {
                distances = self.list(cell.offset()).count;
            } else {
                distances = self.searched_tree(p, any_face()).distances;
            }
        }
        distances
    }

    /// The same for the exact value at a point, for which truncated lists do not count.
    pub fn exact_distances(self, cell: Cell, p: V3) -> u32 {
        let mut distances = 0u32;
        if self.is_mesh() {
            if cell.is_listed() && self.has_exact_lists() {
                distances = self.list(cell.offset()).count;
            } else {
                distances = self.searched_tree(p, any_face()).distances;
            }
        }
        distances
    }

    /// The nearest face to a point of a cell. A simple shape has no faces.
    pub fn nearest(self, cell: Cell, p: V3) -> Nearest {
        let mut found = any_face();
        if self.is_mesh() {
            if cell.is_listed() {
                found = self.nearest_in_list(self.list(cell.offset()), 0u32, 1u32, p);
            } else {
                found = self.nearest_of_all(p);
            }
        }
        found
    }
}
