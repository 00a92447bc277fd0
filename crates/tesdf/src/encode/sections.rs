//! The sections of an asset, and what it says about itself.
use super::assemble::Forest;
use super::placed::{Placed, Request};
use super::roots::Domain;
use crate::asset::about::About;
use crate::asset::layout::{self, SignHints, TreeChild};
use crate::asset::{AssetError, Section, write_container};
use crate::domain::DomainCube;
use crate::geometry::{AabbTree, Child};
use crate::mesh::Presented;

/// What the bytes of an asset are made of.
pub struct Parts<'a> {
    /// The faces of the surface, and those that count for the sign.
    pub presented: &'a Presented<'a>,
    /// The frame and the roots.
    pub placed: &'a Placed,
    /// The face tree.
    pub tree: &'a AabbTree,
    /// For each face, how its features tell the sign.
    pub hints: &'a [SignHints],
    /// The forest and its lists.
    pub forest: &'a Forest,
}

impl Parts<'_> {
    /// The bytes of the file.
    pub fn write(&self, request: &Request, about: &About) -> Result<Vec<u8>, AssetError> {
        let Self { presented, placed: Placed { frame, roots, .. }, tree, hints, forest } = *self;
        let mesh = &*presented.mesh;
        let in_order = |face: &u32| *face as usize;
        let faces: Vec<[u32; 3]> = tree.order().iter().map(|f| mesh.faces()[in_order(f)]).collect();
        let hints: Vec<u16> = tree.order().iter().map(|f| hints[in_order(f)].0).collect();
        let vertices: Vec<[f64; 3]> = mesh.vertices().iter().map(|v| v.to_array()).collect();
        let (offset, origin) = (frame.offset, roots.cube.origin());
        let frame =
            [offset.x, offset.y, offset.z, frame.scale, origin.x, origin.y, origin.z, roots.cube.side()];
        let (low, high): (Vec<u16>, Vec<u8>) =
            forest.palettes.iter().map(|&face| layout::palette_bits(face)).unzip();
        let of_source = |face: &u32| presented.ids.as_ref().map_or(*face, |ids| ids[*face as usize]);
        let face_ids: Vec<u32> = tree.order().iter().map(of_source).collect();
        let (tree_boxes, tree_children) = face_tree(tree, &roots.cube);
        let mut sections = vec![
            Section::new(layout::VERTICES, &vertices),
            Section::new(layout::FACES, &faces),
            Section::new(layout::FACE_IDS, &face_ids),
            Section::new(layout::SIGN_HINTS, &hints),
            Section::new(layout::FRAME, &frame),
            Section::new(layout::NODES, &forest.nodes),
            Section::new(layout::LISTS, &forest.lists),
            Section::new(layout::PALETTE_STARTS, &forest.palette_starts),
            Section::new(layout::PALETTES, &low),
            Section::new(layout::TREE_BOXES, &tree_boxes),
            Section::new(layout::TREE_CHILDREN, &tree_children),
        ];
        let own: Vec<[f64; 3]> = match request.domain {
            Domain::Bisection => Vec::new(),
            Domain::Conforming(domain) => {
                domain.vertices()[vertices.len()..].iter().map(|v| v.to_array()).collect()
            }
        };
        if !roots.tetrahedra.is_empty() {
            sections.push(Section::new(layout::DOMAIN_VERTICES, &own));
            sections.push(Section::new(layout::TETRAHEDRA, &roots.tetrahedra));
        }
        if !presented.sign_faces.is_empty() {
            sections.push(Section::new(layout::SIGN_FACES, &presented.sign_faces));
        }
        if faces.len() > layout::SHORT_FACES {
            sections.push(Section::new(layout::PALETTES_HIGH, &high));
        }
        write_container(&sections, &about.to_metadata())
    }
}

/// The face tree in `f32`, relative to the middle of the cube. Boxes are rounded outward.
fn face_tree(tree: &AabbTree, cube: &DomainCube) -> (Vec<[f32; 12]>, Vec<[u32; 2]>) {
    let middle = cube.middle();
    let child = |c: Child| match c {
        Child::Node(n) => TreeChild::Node(n),
        Child::Leaf { start, end } => TreeChild::Leaf(start, end - start),
    };
    let mut nodes = tree.nodes().to_vec();
    if let (bounds, Child::Leaf { start, end }) = tree.root() {
        // A tree that is a single leaf, of two faces or more, is written as a node with two leaves.
        let half = start + (end - start) / 2;
        nodes.push([(bounds, Child::Leaf { start, end: half }), (bounds, Child::Leaf { start: half, end })]);
    }
    let boxes = nodes.iter().map(|node| {
        let [a, b] = [0, 1].map(|side| node[side].0.rounded_from(middle));
        std::array::from_fn(|k| if k < 6 { a[k] } else { b[k - 6] })
    });
    let children = nodes.iter().map(|n| [child(n[0].1).encode(), child(n[1].1).encode()]);
    (boxes.collect(), children.collect())
}
