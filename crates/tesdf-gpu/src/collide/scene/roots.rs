//! The roots of a forest, and the tree of boxes that finds the root of a point in a conforming
//! domain.
use glam::DVec3;
use tesdf::geometry::Aabb;
use tesdf::geometry::internal::{AabbTree, Child};
use tesdf::query::Arrays;

use crate::kernels::geometry::vector::{V3, v3};
use crate::kernels::query::tetrahedra::{ROWS, Tetrahedron, tetrahedron_of};
use crate::kernels::scene::shape::NONE;

/// The roots in the layout that kernels read.
pub struct Roots {
    /// [`ROWS`] rows for each root.
    pub rows: Vec<[f32; 4]>,
    /// Minimum and maximum corner of each node's box.
    pub boxes: Vec<[f32; 4]>,
    /// The nodes, each before its descendants. The first word is the index after the last
    /// descendant. The second is the tetrahedron of a leaf, or [`NONE`].
    pub tree: Vec<[u32; 2]>,
}

impl Roots {
    pub fn new(mesh: &Arrays) -> Self {
        let middle = mesh.cube.middle();
        if mesh.tetrahedra.is_empty() {
            let roots = (0..6).map(|root| mesh.cube.root(root).corners.map(|p| p - middle));
            let rows = roots.flat_map(|corners| rows(&tetrahedron_of_corners(corners))).collect();
            return Self { rows, boxes: Vec::new(), tree: Vec::new() };
        }
        // Rounded to `f32` as on the device.
        let vertices = positions(mesh);
        let corners = |t: &[u32; 4]| t.map(|v| DVec3::from_array(vertices[v as usize].map(f64::from)));
        let bounds: Vec<Aabb> = mesh.tetrahedra.iter().map(|t| Aabb::of(&corners(t))).collect();
        let tree = AabbTree::build(&bounds, 1);
        let mut all = Self {
            rows: mesh.tetrahedra.iter().flat_map(|t| rows(&tetrahedron_of_corners(corners(t)))).collect(),
            boxes: Vec::with_capacity(4 * bounds.len()),
            tree: Vec::with_capacity(2 * bounds.len()),
        };
        let (bounds_of_all, root) = tree.root();
        all.add(&tree, &bounds, bounds_of_all, root);
        all
    }

    /// Appends a node and its descendants. The recursion is at most [`AabbTree::MAX_DEPTH`] calls
    /// deep.
    fn add(&mut self, tree: &AabbTree, items: &[Aabb], bounds: Aabb, child: Child) {
        let at = self.tree.len();
        self.push(bounds, NONE);
        match child {
            Child::Node(node) => {
                for (bounds, child) in tree.nodes()[node as usize] {
                    self.add(tree, items, bounds, child);
                }
            }
            Child::Leaf { start, end } => match tree.order()[start as usize..end as usize] {
                [item] => self.tree[at][1] = item,
                ref some => some.iter().for_each(|&item| self.push(items[item as usize], item)),
            },
        }
        self.tree[at][0] = self.tree.len() as u32;
    }

    fn push(&mut self, bounds: Aabb, item: u32) {
        self.boxes.extend([bounds.min, bounds.max].map(|p| p.as_vec3().extend(0.0).to_array()));
        self.tree.push([self.tree.len() as u32 + 1, item]);
    }
}

/// The vertices of the mesh and of its domain in the local frame, relative to the center of the
/// cube.
fn positions(mesh: &Arrays) -> Vec<[f32; 3]> {
    let local = |p: &[f64; 3]| mesh.frame.to_local(DVec3::from_array(*p)) - mesh.cube.middle();
    mesh.vertices.iter().chain(mesh.domain_vertices).map(|p| local(p).as_vec3().to_array()).collect()
}

fn tetrahedron_of_corners(corners: [DVec3; 4]) -> Tetrahedron {
    let [a, b, c, d] = corners.map(|p| v3(p.x as f32, p.y as f32, p.z as f32));
    tetrahedron_of(a, b, c, d)
}

fn rows(t: &Tetrahedron) -> [[f32; 4]; ROWS as usize] {
    let row = |v: V3, h: f32| [v.x, v.y, v.z, h];
    [row(t.corner, t.h0), row(t.g1, t.h1), row(t.g2, t.h2), row(t.g3, t.h3), row(t.g0, 0.0)]
}
