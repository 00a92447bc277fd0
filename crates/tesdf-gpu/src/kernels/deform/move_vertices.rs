//! Updates faces and tetrahedra after their vertices have moved.
//!
//! Mirrors `deform/move_vertices.rs` of `tesdf`.
use cubecl::prelude::*;

use crate::kernels::deform::bounds::{Moving, MovingExpand};
use crate::kernels::geometry::triangle::{ROWS as FACE_ROWS, face_of, rewrite_face};
use crate::kernels::geometry::vector::row_of;
use crate::kernels::query::tetrahedra::{ROWS as TETRAHEDRON_ROWS, tetrahedron_of, write_tetrahedron};
use crate::kernels::scene::shape::{
    FACE_COUNT, FACE_VERTICES, NONE, RECORDS, TET_VERTICES, TETRAHEDRA, TREE, TREE_BOXES, TREE_NODES,
};

#[cube]
impl Moving {
    fn follow_face(&mut self, face: u32) {
        let at = self.entry(FACE_VERTICES) + 3u32 * face;
        let a = self.vertex(self.word(at));
        let b = self.vertex(self.word(at + 1u32));
        let c = self.vertex(self.word(at + 2u32));
        let to = self.entry(RECORDS) + face * FACE_ROWS;
        rewrite_face(&mut self.rows, to, face_of(a, b, c));
    }

    fn follow_tetrahedron(&mut self, node: u32, root: u32) {
        let at = self.entry(TET_VERTICES) + 4u32 * root;
        let a = self.vertex(self.word(at));
        let b = self.vertex(self.word(at + 1u32));
        let c = self.vertex(self.word(at + 2u32));
        let d = self.vertex(self.word(at + 3u32));
        let to = self.entry(TETRAHEDRA) + root * TETRAHEDRON_ROWS;
        write_tetrahedron(&mut self.rows, to, tetrahedron_of(a, b, c, d));
        let to = (self.entry(TREE_BOXES) + 2u32 * node) as usize;
        self.rows[to] = row_of(a.min(b).min(c.min(d)), 0.0f32);
        self.rows[to + 1] = row_of(a.max(b).max(c.max(d)), 0.0f32);
    }
}

/// Updates a face per thread, then a node of the tree over tetrahedra per thread. Only leaves have
/// a tetrahedron to update.
#[cube(launch, create_dummy_kernel)]
pub fn follow(moving: &mut Moving) {
    let item = ABSOLUTE_POS as u32;
    let faces = moving.entry(FACE_COUNT);
    let nodes = moving.entry(TREE_NODES);
    if item < faces {
        moving.follow_face(item);
    } else if item < faces + nodes {
        let node = item - faces;
        let root = moving.word(moving.entry(TREE) + 2u32 * node + 1u32);
        if root != NONE {
            moving.follow_tetrahedron(node, root);
        }
    }
}
