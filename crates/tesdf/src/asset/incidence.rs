use std::collections::BTreeSet;

use super::layout::TreeChild;
use crate::geometry::{AabbTree, Child};

/// What each vertex moves. Made when the first vertex moves.
#[derive(Debug)]
pub struct Incidence {
    /// Faces of each vertex of the mesh, by position.
    pub faces: Rows,
    /// Tetrahedra of each vertex of the domain.
    pub tetrahedra: Rows,
    /// Parents in the face tree. Its leaves are runs of faces.
    pub face_tree: Parents,
    /// Parents in the tree over tetrahedra. Its leaves are runs of the tree's order.
    pub tetrahedron_tree: Parents,
    /// The place of each tetrahedron in that order.
    pub place: Vec<u32>,
}

impl Incidence {
    /// Makes the tables for faces, for the tetrahedra of a conforming domain, and for the trees
    /// over both. Each pair has the elements and the number of vertices that they use.
    pub fn new(
        (faces, mesh_vertices): (&[[u32; 3]], usize),
        face_tree: &[[u32; 2]],
        (tetrahedra, vertices): (&[[u32; 4]], usize),
        tree: &AabbTree,
    ) -> Self {
        let face_children = |node: &[u32; 2]| {
            node.map(|word| match TreeChild::decode(word) {
                TreeChild::Node(n) => Child::Node(n),
                TreeChild::Leaf(start, count) => Child::Leaf { start, end: start + count },
            })
        };
        let mut place = vec![0; tetrahedra.len()];
        tree.order().iter().enumerate().for_each(|(at, &t)| place[t as usize] = at as u32);
        Self {
            faces: Rows::new(faces, mesh_vertices),
            tetrahedra: Rows::new(tetrahedra, vertices),
            face_tree: Parents::new(face_tree.iter().map(face_children), faces.len()),
            tetrahedron_tree: Parents::new(
                tree.nodes().iter().map(|node| [node[0].1, node[1].1]),
                tetrahedra.len(),
            ),
            place,
        }
    }
}

/// A list of items for each key, one list after the other.
#[derive(Debug)]
pub struct Rows {
    starts: Vec<u32>,
    items: Vec<u32>,
}

impl Rows {
    fn new<const N: usize>(keys: &[[u32; N]], count: usize) -> Self {
        let mut starts = vec![0u32; count + 1];
        keys.as_flattened().iter().for_each(|&k| starts[k as usize + 1] += 1);
        for k in 0..count {
            starts[k + 1] += starts[k];
        }
        let mut next = starts.clone();
        let mut items = vec![0; keys.len() * N];
        for (item, keys) in (0u32..).zip(keys) {
            for &k in keys {
                items[next[k as usize] as usize] = item;
                next[k as usize] += 1;
            }
        }
        Self { starts, items }
    }

    /// The items of a key.
    pub fn of(&self, key: u32) -> &[u32] {
        &self.items[self.starts[key as usize] as usize..self.starts[key as usize + 1] as usize]
    }
}

/// The parents in a tree whose nodes have two children each. A *slot* is a child of a node: 2 ·
/// node + side.
#[derive(Debug)]
pub struct Parents {
    /// The slot that has each position of the runs of the leaves. [`NONE`] when the tree is a
    /// single leaf.
    leaf: Vec<u32>,
    /// The slot that has each node.
    node: Vec<u32>,
}

const NONE: u32 = u32::MAX;

impl Parents {
    fn new(nodes: impl ExactSizeIterator<Item = [Child; 2]>, positions: usize) -> Self {
        let mut parents = Self { leaf: vec![NONE; positions], node: vec![NONE; nodes.len()] };
        for (n, children) in nodes.enumerate() {
            for (side, child) in children.into_iter().enumerate() {
                let slot = (2 * n + side) as u32;
                match child {
                    Child::Node(below) => parents.node[below as usize] = slot,
                    Child::Leaf { start, end } => parents.leaf[start as usize..end as usize].fill(slot),
                }
            }
        }
        parents
    }

    /// Calls `refit` with each slot whose box may change, children before their parents. `refit`
    /// says whether the box did change.
    pub fn climb(&self, positions: impl Iterator<Item = u32>, mut refit: impl FnMut(u32) -> bool) {
        let leaves = positions.map(|p| self.leaf[p as usize]).filter(|&slot| slot != NONE);
        let mut open: BTreeSet<u32> = leaves.collect();
        // Children have greater numbers than their parents.
        while let Some(slot) = open.pop_last() {
            let above = self.node[slot as usize / 2];
            if refit(slot) && above != NONE {
                open.insert(above);
            }
        }
    }
}
