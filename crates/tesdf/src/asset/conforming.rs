use glam::DVec3;

use super::incidence::Incidence;
use super::layout::{DOMAIN_VERTICES, TETRAHEDRA};
use super::{AssetError, Container, SharedSection};
use crate::geometry::{Aabb, AabbTree, LocalFrame};

/// The tetrahedra of a conforming domain, each the root of a bisection tree, and a tree of boxes to
/// locate them.
#[derive(Clone, Debug)]
pub(crate) struct Conforming {
    tetrahedra: SharedSection<[u32; 4]>,
    /// The vertices of the domain that are not of the mesh.
    vertices: SharedSection<[f64; 3]>,
    tree: AabbTree,
}

/// The positions of the vertices of the mesh. The vertices of a conforming domain begin with them.
#[derive(Clone, Copy)]
pub(crate) struct Placed<'a> {
    /// In the unit of the mesh.
    pub vertices: &'a [[f64; 3]],
    /// From the unit of the mesh to the local frame.
    pub frame: LocalFrame,
}

/// Tetrahedra in a leaf of the tree of boxes.
const LEAF: usize = 4;
/// Boxes are grown by this length (local frame), because by rounding a point of the border may be a
/// little out of all tetrahedra.
const PAD: f64 = 1e-14;

impl Conforming {
    /// Checks the sections of a conforming domain, if the file has them.
    pub fn open(container: &Container, placed: Placed) -> Result<Option<Self>, AssetError> {
        if container.section::<[u32; 4]>(TETRAHEDRA.name)?.is_none() {
            return Ok(None);
        }
        let tetrahedra: SharedSection<[u32; 4]> = container.shared_section(TETRAHEDRA.name)?;
        let vertices: SharedSection<[f64; 3]> = match container.section::<[f64; 3]>(DOMAIN_VERTICES.name)? {
            Some(_) => container.shared_section(DOMAIN_VERTICES.name)?,
            None => SharedSection::of_rows(&[]),
        };
        let wrong = |name: &'static str, reason| Err(AssetError::section(name, reason));
        if let Some(i) = vertices.iter().position(|v| !v.iter().all(|x| x.is_finite())) {
            return wrong(DOMAIN_VERTICES.name, format!("vertex {i} is not finite"));
        }
        let count = placed.vertices.len() + vertices.len();
        let bad = |t: &[u32; 4]| t.iter().any(|&v| v as usize >= count);
        if let Some(i) = tetrahedra.iter().position(bad) {
            return wrong(
                TETRAHEDRA.name,
                format!("tetrahedron {i} uses {:?} of {count} vertices", tetrahedra[i]),
            );
        }
        if tetrahedra.is_empty() {
            return wrong(TETRAHEDRA.name, "there is no tetrahedron".into());
        }
        let mut domain = Self { tetrahedra, vertices, tree: AabbTree::build(&[], LEAF) };
        let boxes: Vec<Aabb> = (0..domain.tetrahedra.len()).map(|t| domain.bounds(placed, t)).collect();
        domain.tree = AabbTree::build(&boxes, LEAF);
        Ok(Some(domain))
    }

    /// Fits the tree of boxes to the current positions of some tetrahedra.
    pub fn refit(&mut self, placed: Placed, tetrahedra: &[u32], incidence: &Incidence) {
        let mut tree = std::mem::replace(&mut self.tree, AabbTree::build(&[], LEAF));
        let places = tetrahedra.iter().map(|&t| incidence.place[t as usize]);
        incidence
            .tetrahedron_tree
            .climb(places, |slot| tree.refit(slot, |t| self.bounds(placed, t as usize)));
        tree.refit_root(|t| self.bounds(placed, t as usize));
        self.tree = tree;
    }

    fn bounds(&self, placed: Placed, tetrahedron: usize) -> Aabb {
        Aabb::of(&self.corners(placed, tetrahedron)).grown(PAD)
    }

    /// Corners of a tetrahedron, in the local frame.
    pub fn corners(&self, placed: Placed, tetrahedron: usize) -> [DVec3; 4] {
        self.corners_in_unit(placed, tetrahedron).map(|p| placed.frame.to_local(p))
    }

    /// Corners of a tetrahedron, in the unit of the mesh.
    pub fn corners_in_unit(&self, placed: Placed, tetrahedron: usize) -> [DVec3; 4] {
        let mesh = placed.vertices;
        self.tetrahedra[tetrahedron].map(|v| {
            let v = v as usize;
            DVec3::from_array(if v < mesh.len() { mesh[v] } else { self.vertices[v - mesh.len()] })
        })
    }

    /// Corner ids of the tetrahedra.
    pub fn tetrahedra(&self) -> &[[u32; 4]] {
        &self.tetrahedra
    }

    /// The vertices that are not of the mesh, in the unit of the mesh.
    pub fn vertices(&self) -> &[[f64; 3]] {
        &self.vertices
    }

    /// Replaces these vertices. The caller then calls [`refit`](Self::refit).
    pub fn set_vertices(&mut self, vertices: &[[f64; 3]]) {
        self.vertices = SharedSection::of_rows(vertices);
    }

    /// What each vertex moves. `faces` and `face_tree` are those of the mesh.
    pub fn incidence(&self, placed: Placed, faces: &[[u32; 3]], face_tree: &[[u32; 2]]) -> Incidence {
        let mesh_vertices = placed.vertices.len();
        let vertices = mesh_vertices + self.vertices.len();
        Incidence::new((faces, mesh_vertices), face_tree, (&self.tetrahedra, vertices), &self.tree)
    }

    /// The tree of boxes.
    pub fn tree(&self) -> &AabbTree {
        &self.tree
    }

    /// Size in bytes of the data that opening made.
    pub fn derived_bytes(&self) -> usize {
        std::mem::size_of_val(self.tree.nodes()) + std::mem::size_of_val(self.tree.order())
    }
}
