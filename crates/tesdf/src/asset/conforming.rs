use glam::DVec3;

use super::layout::{DOMAIN_VERTICES, TETRAHEDRA};
use super::{AssetError, SharedSection, TeSdf};
use crate::domain::Cell;
use crate::geometry::{Aabb, AabbTree, barycentric};

/// The tetrahedra of a conforming domain, each the root of a bisection tree, and a tree of boxes that finds them.
#[derive(Debug)]
pub(crate) struct Conforming {
    tetrahedra: SharedSection<[u32; 4]>,
    /// Of the domain and not of the mesh.
    vertices: Option<SharedSection<[f64; 3]>>,
    tree: AabbTree,
}

/// Tetrahedra in a leaf of the tree of boxes.
const LEAF: usize = 4;
/// A point of the border may be out of all tetrahedra by rounding: by less than this, in barycentric coordinates.
const OUTSIDE: f64 = -1e-12;
/// What boxes are grown by, in the local frame, to hold such points.
const PAD: f64 = 1e-14;

impl Conforming {
    /// Checks the sections of a conforming domain, if the file has them; mesh and frame of `asset` are there.
    pub fn open(asset: &TeSdf) -> Result<Option<Self>, AssetError> {
        let container = asset.container();
        if container.section::<[u32; 4]>(TETRAHEDRA.name)?.is_none() {
            return Ok(None);
        }
        let tetrahedra: SharedSection<[u32; 4]> = container.shared_section(TETRAHEDRA.name)?;
        let vertices: Option<SharedSection<[f64; 3]>> = container
            .section::<[f64; 3]>(DOMAIN_VERTICES.name)?
            .is_some()
            .then(|| container.shared_section(DOMAIN_VERTICES.name))
            .transpose()?;
        let wrong = |name: &'static str, reason| Err(AssetError::section(name, reason));
        let own = vertices.as_deref().unwrap_or(&[]);
        if let Some(i) = own.iter().position(|v| !v.iter().all(|x| x.is_finite())) {
            return wrong(DOMAIN_VERTICES.name, format!("vertex {i} is not finite"));
        }
        let count = asset.vertices.len() + own.len();
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
        domain.fit(asset);
        Ok(Some(domain))
    }

    /// Makes the tree of boxes for where the vertices are.
    fn fit(&mut self, asset: &TeSdf) {
        let boxes: Vec<Aabb> =
            (0..self.tetrahedra.len()).map(|t| Aabb::of(&self.corners(asset, t)).grown(PAD)).collect();
        self.tree = AabbTree::build(&boxes, LEAF);
    }

    fn corners(&self, asset: &TeSdf, tetrahedron: usize) -> [DVec3; 4] {
        let own = self.vertices.as_deref().unwrap_or(&[]);
        self.tetrahedra[tetrahedron].map(|v| {
            let v = v as usize;
            let mesh = &asset.vertices;
            asset.frame.to_local(DVec3::from_array(if v < mesh.len() {
                mesh[v]
            } else {
                own[v - mesh.len()]
            }))
        })
    }

    /// Size in bytes of what opening made.
    pub fn derived_bytes(&self) -> usize {
        std::mem::size_of_val(self.tree.nodes()) + std::mem::size_of_val(self.tree.order())
    }
}

impl TeSdf {
    /// Number of tetrahedra that the bisection forest grows from.
    pub(crate) fn root_count(&self) -> usize {
        self.conforming.as_ref().map_or(6, |domain| domain.tetrahedra.len())
    }

    /// One of them, in the local frame.
    pub(crate) fn root(&self, root: usize) -> Cell {
        match &self.conforming {
            None => self.cube.root(root),
            Some(domain) => Cell { corners: domain.corners(self, root), depth: 0 },
        }
    }

    /// The tetrahedron of a conforming domain that holds a point of the local frame, with the point's coordinates in it;
    /// on a border the one that it is deepest in.
    pub(crate) fn locate_root(&self, domain: &Conforming, p: DVec3) -> Option<(usize, [f64; 4])> {
        let mut best: Option<(f64, usize, [f64; 4])> = None;
        domain.tree.visit(
            |bounds| bounds.contains(p),
            |leaf| {
                for &t in leaf {
                    let lambda = barycentric(&domain.corners(self, t as usize), p);
                    let least = lambda.into_iter().fold(f64::INFINITY, f64::min);
                    if least >= OUTSIDE && best.is_none_or(|(b, ..)| least > b) {
                        best = Some((least, t as usize, lambda));
                    }
                }
            },
        );
        best.map(|(_, root, lambda)| (root, lambda))
    }

    /// The tetrahedra of a conforming domain whose boxes overlap `bounds` (local frame), in no order that matters.
    pub(crate) fn visit_roots(&self, domain: &Conforming, bounds: Aabb, mut visit: impl FnMut(usize)) {
        domain.tree.visit(|b| b.overlaps(bounds), |leaf| leaf.iter().for_each(|&t| visit(t as usize)));
    }
}
