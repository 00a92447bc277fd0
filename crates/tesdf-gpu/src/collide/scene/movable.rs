//! What the device needs to move the vertices of a shape with a conforming domain.
use tesdf::asset::layout::TreeChild;
use tesdf::collide::Shape;

use super::placed::split;
use crate::kernels::scene::shape::{NONE, TREE_NODES};

/// The host's data for moving the vertices of a shape.
#[derive(Clone, Debug)]
pub struct Moving {
    pub faces: u32,
    pub tree_nodes: u32,
    pub vertices: usize,
    /// Center of the cube in the shape's unit, as high and low `f32`, and the scale of the local
    /// frame.
    pub frame: [[f32; 4]; 2],
}

impl Moving {
    /// The data of a shape with a conforming domain, from the shape and its entry of the table.
    /// `None` for other shapes.
    pub fn new((entry, shape): (&[u32], &Shape)) -> Option<Self> {
        let tree_nodes = entry[TREE_NODES as usize];
        let Shape::Mesh(asset) = shape else { return None };
        let mesh = asset.arrays();
        let (high, low) = split(mesh.frame.to_world(mesh.cube.middle()));
        (tree_nodes > 0).then(|| Self {
            faces: mesh.faces.len() as u32,
            tree_nodes,
            vertices: mesh.vertices.len() + mesh.domain_vertices.len(),
            frame: [high.extend(mesh.frame.scale as f32).to_array(), low.extend(0.0).to_array()],
        })
    }
}

/// The inner nodes of the face tree by their height above the leaves, in the layout that
/// [`refit`](crate::kernels::deform::refit) reads.
pub fn face_levels(children: &[[u32; 2]]) -> Vec<u32> {
    let mut heights = vec![0u32; children.len()];
    for node in (0..heights.len()).rev() {
        let height = |word| match TreeChild::decode(word) {
            TreeChild::Node(c) => heights[c as usize] + 1,
            TreeChild::Leaf(..) => 0,
        };
        heights[node] = children[node].map(height).into_iter().max().unwrap_or(0);
    }
    levels((0..).zip(heights))
}

/// The inner nodes of the tree over tetrahedra, in the same layout.
pub fn tree_levels(tree: &[[u32; 2]]) -> Vec<u32> {
    let mut heights = vec![0u32; tree.len()];
    for node in (0..heights.len()).rev() {
        let mut child = node + 1;
        while child < tree[node][0] as usize {
            heights[node] = heights[node].max(heights[child] + 1);
            child = tree[child][0] as usize;
        }
    }
    let inner = (0..).zip(heights).zip(tree).filter(|(_, [_, tetrahedron])| *tetrahedron == NONE);
    levels(inner.map(|((node, height), _)| (node, height - 1)))
}

/// The number of levels, then the start of each level and the end of the last, then the nodes of
/// each level.
fn levels(nodes: impl Iterator<Item = (u32, u32)>) -> Vec<u32> {
    let mut by_level: Vec<Vec<u32>> = Vec::new();
    for (node, height) in nodes {
        by_level.resize(by_level.len().max(height as usize + 1), Vec::new());
        by_level[height as usize].push(node);
    }
    let ends = by_level.iter().scan(0, |end, level| {
        *end += level.len() as u32;
        Some(*end)
    });
    let head = [by_level.len() as u32, 0].into_iter().chain(ends);
    head.chain(by_level.iter().flatten().copied()).collect()
}
