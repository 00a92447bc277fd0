//! A shape whose vertices move, and the bounds of these vertices.
use cubecl::prelude::*;

use crate::kernels::geometry::vector::{Row, V3, last, row, v3, xyz};
use crate::kernels::query::nearest::{FAR, NodeBoxes, TreeChild};
use crate::kernels::scene::shape::{BOXES, Bounds, BoundsExpand, FACE_VERTICES, STRIDE};

/// The buffers of all shapes, and the new positions for one shape.
#[derive(CubeType, CubeLaunch)]
pub struct Moving {
    pub table: Box<[u32]>,
    pub words: Box<[u32]>,
    pub rows: Box<[Row]>,
    /// Three numbers for each vertex, in the shape's frame and unit.
    pub positions: Box<[f32]>,
    /// Center of the cube in the shape's unit as high and low `f32`, and the scale of the local
    /// frame.
    pub frame: Box<[Row]>,
    /// Index of the shape.
    pub shape: u32,
}

/// Empty bounds: the minimum is above the maximum.
#[cube]
pub fn no_bounds() -> Bounds {
    Bounds { low: v3(FAR, FAR, FAR), high: v3(-FAR, -FAR, -FAR) }
}

#[cube]
impl Bounds {
    /// The bounds of both.
    pub fn with(self, other: Bounds) -> Bounds {
        Bounds { low: self.low.min(other.low), high: self.high.max(other.high) }
    }

    pub fn with_point(self, p: V3) -> Bounds {
        Bounds { low: self.low.min(p), high: self.high.max(p) }
    }
}

#[cube]
impl Moving {
    /// Word `at` of the shape in the table.
    pub fn entry(&self, #[comptime] at: u32) -> u32 {
        self.table[(self.shape * STRIDE + at) as usize]
    }

    pub fn set_entry(&mut self, #[comptime] at: u32, value: u32) {
        self.table[(self.shape * STRIDE + at) as usize] = value;
    }

    /// Word `at` of the arrays.
    pub fn word(&self, at: u32) -> u32 {
        self.words[at as usize]
    }

    /// A vertex in the local frame, relative to the center of the cube.
    pub fn vertex(&self, number: u32) -> V3 {
        let at = (3u32 * number) as usize;
        let p = v3(self.positions[at], self.positions[at + 1], self.positions[at + 2]);
        let (high, low) = (self.frame[0], self.frame[1]);
        ((p - xyz(high)) - xyz(low)) * last(high)
    }

    /// The bounds of `count` vertices, whose indices begin at word `first`.
    pub fn around(&self, first: u32, count: u32) -> Bounds {
        let mut bounds = no_bounds();
        let mut k = 0u32;
        while k < count {
            bounds = bounds.with_point(self.vertex(self.word(first + k)));
            k += 1u32;
        }
        bounds
    }

    /// The boxes of both children of a node of the face tree.
    fn boxes(&self, node: u32) -> NodeBoxes {
        let at = (self.entry(BOXES) + 3u32 * node) as usize;
        let (r, s, t) = (self.rows[at], self.rows[at + 1], self.rows[at + 2]);
        NodeBoxes {
            left: Bounds { low: xyz(r), high: v3(last(r), s.extract(0usize), s.extract(1usize)) },
            right: Bounds {
                low: v3(s.extract(2usize), last(s), t.extract(0usize)),
                high: v3(t.extract(1usize), t.extract(2usize), last(t)),
            },
        }
    }

    pub fn put_boxes(&mut self, node: u32, boxes: NodeBoxes) {
        let at = (self.entry(BOXES) + 3u32 * node) as usize;
        let (left, right) = (boxes.left, boxes.right);
        self.rows[at] = row(left.low.x, left.low.y, left.low.z, left.high.x);
        self.rows[at + 1] = row(left.high.y, left.high.z, right.low.x, right.low.y);
        self.rows[at + 2] = row(right.low.z, right.high.x, right.high.y, right.high.z);
    }

    /// The bounds of both boxes of a node of the face tree.
    pub fn node_bounds(&self, node: u32) -> Bounds {
        let boxes = self.boxes(node);
        boxes.left.with(boxes.right)
    }

    /// The bounds of a child of a face-tree node: of the faces of a leaf, or of the boxes of a
    /// node.
    pub fn child_bounds(&self, child: TreeChild) -> Bounds {
        if child.is_leaf() {
            self.around(self.entry(FACE_VERTICES) + 3u32 * child.start(), 3u32 * child.count())
        } else {
            self.node_bounds(child.word)
        }
    }
}
