//! Refits boxes, balls and bounds to moved faces and tetrahedra, from the leaves of the trees to
//! their roots. One group does this for a shape, because only the end of a launch orders the writes
//! of different groups.
use cubecl::prelude::*;

use crate::kernels::deform::bounds::{Moving, MovingExpand, no_bounds};
use crate::kernels::geometry::vector::{V3, from_bits, last, row_of, to_bits, v3, xyz, zero};
use crate::kernels::query::nearest::{NodeBoxes, TreeChild};
use crate::kernels::scene::shape::{
    BAD_VERTEX, BOUND_UNIT, Bounds, CHILDREN, EXACT_LISTS, FACE_LEVELS, FACE_VERTICES, HIGH, INNER_BALL, LOW,
    MESHLET_COUNT, MESHLET_FACES, MESHLETS, NONE, SIDE, TREE, TREE_BOXES, TREE_LEVELS, VERTEX_COUNT,
};

/// Threads of the group.
pub const GROUP: u32 = 256;

/// A ball grows by this fraction of its radius and of the cube's side. This is more than the
/// rounding error of `f32`.
pub const GROWN: f32 = 1e-6;

const FARTHEST: f32 = tesdf::deform::FARTHEST as f32;

/// The inner nodes of a tree by level. The words are: the number of levels; the start of each
/// level, and the end of the last; the inner nodes, level by level, with parents of leaves first.
#[derive(CubeType, Clone, Copy)]
#[expand(derive(Clone, Copy))]
struct Levels {
    at: u32,
    count: u32,
}

#[cube]
impl Moving {
    fn levels(&self, #[comptime] entry: u32) -> Levels {
        let at = self.entry(entry);
        Levels { at, count: self.word(at) }
    }

    /// Index of the first node of a level. For the level after the last: the end.
    fn level_start(&self, levels: Levels, level: u32) -> u32 {
        self.word(levels.at + 1u32 + level)
    }

    /// The node at an index.
    fn level_node(&self, levels: Levels, i: u32) -> u32 {
        self.word(levels.at + 2u32 + levels.count + i)
    }

    /// Refits the boxes of a node of the face tree.
    fn refit_faces(&mut self, node: u32) {
        let children = self.entry(CHILDREN) + 2u32 * node;
        let left = TreeChild { word: self.word(children) };
        let right = TreeChild { word: self.word(children + 1u32) };
        let boxes = NodeBoxes { left: self.child_bounds(left), right: self.child_bounds(right) };
        self.put_boxes(node, boxes);
    }

    /// Refits the box of a node of the tree over tetrahedra.
    fn refit_tetrahedra(&mut self, node: u32) {
        let tree = self.entry(TREE);
        let boxes = self.entry(TREE_BOXES);
        let mut bounds = no_bounds();
        let end = self.word(tree + 2u32 * node);
        let mut child = node + 1u32;
        while child < end {
            let at = (boxes + 2u32 * child) as usize;
            bounds = bounds.with(Bounds { low: xyz(self.rows[at]), high: xyz(self.rows[at + 1]) });
            child = self.word(tree + 2u32 * child);
        }
        let to = (boxes + 2u32 * node) as usize;
        self.rows[to] = row_of(bounds.low, 0.0f32);
        self.rows[to + 1] = row_of(bounds.high, 0.0f32);
    }

    /// Refits the ball of a meshlet.
    fn refit_meshlet(&mut self, meshlet: u32) {
        let range = self.entry(MESHLET_FACES) + 2u32 * meshlet;
        let first = self.entry(FACE_VERTICES) + 3u32 * self.word(range);
        let count = 3u32 * self.word(range + 1u32);
        let bounds = self.around(first, count);
        let center = (bounds.low + bounds.high) * 0.5f32;
        let mut radius = 0.0f32;
        let mut k = 0u32;
        while k < count {
            radius = radius.max((self.vertex(self.word(first + k)) - center).length());
            k += 1u32;
        }
        radius += GROWN * (radius + from_bits(self.entry(SIDE)));
        let to = (self.entry(MESHLETS) + meshlet) as usize;
        self.rows[to] = row_of(center, radius);
    }

    /// The lowest of this thread's vertices with an invalid position: one that is not finite, or so
    /// far away that `f32` cannot separate faces there.
    fn bad_vertex(&self) -> u32 {
        let side = FARTHEST * from_bits(self.entry(SIDE));
        let limit = v3(side, side, side);
        let mut lowest = NONE.runtime();
        let mut v = UNIT_POS;
        while v < self.entry(VERTEX_COUNT) {
            let good = self.vertex(v).abs().is_at_most(limit);
            lowest = select(good, lowest, lowest.min(v));
            v += GROUP;
        }
        lowest
    }

    /// Updates the entries of the table that depend on vertices.
    fn refit_table(&mut self) {
        // Exactness of lists and bounds of cells are not proved after a move.
        self.set_entry(EXACT_LISTS, 0u32);
        self.set_entry(BOUND_UNIT, 0u32);
        // The thickness is about the same after a move, but the center of the ball is unknown.
        let inner = self.entry(INNER_BALL) as usize;
        let thickness = last(self.rows[inner]).abs();
        self.rows[inner] = row_of(zero(), -thickness);
        let bounds = self.node_bounds(0u32);
        self.set_vector(LOW, bounds.low);
        self.set_vector(HIGH, bounds.high);
    }

    fn set_vector(&mut self, #[comptime] at: u32, v: V3) {
        self.set_entry(at, to_bits(v.x));
        self.set_entry(at + 1, to_bits(v.y));
        self.set_entry(at + 2, to_bits(v.z));
    }
}

/// Refits a shape with one group of [`GROUP`] threads.
#[cube(launch, create_dummy_kernel)]
pub fn refit(moving: &mut Moving) {
    let levels = moving.levels(FACE_LEVELS);
    let mut level = 0u32;
    while level < levels.count {
        let mut i = moving.level_start(levels, level) + UNIT_POS;
        while i < moving.level_start(levels, level + 1u32) {
            moving.refit_faces(moving.level_node(levels, i));
            i += GROUP;
        }
        sync_storage();
        level += 1u32;
    }
    let levels = moving.levels(TREE_LEVELS);
    level = 0u32;
    while level < levels.count {
        let mut i = moving.level_start(levels, level) + UNIT_POS;
        while i < moving.level_start(levels, level + 1u32) {
            moving.refit_tetrahedra(moving.level_node(levels, i));
            i += GROUP;
        }
        sync_storage();
        level += 1u32;
    }
    let mut i = UNIT_POS;
    while i < moving.entry(MESHLET_COUNT) {
        moving.refit_meshlet(i);
        i += GROUP;
    }
    let mut bad = Shared::<[u32]>::new_slice(GROUP as usize);
    let mut lowest = moving.bad_vertex();
    bad[UNIT_POS as usize] = lowest;
    sync_cube();
    if UNIT_POS == 0u32 {
        let mut k = 1u32;
        while k < GROUP {
            lowest = lowest.min(bad[k as usize]);
            k += 1u32;
        }
        moving.set_entry(BAD_VERTEX, lowest);
        moving.refit_table();
    }
}
