use glam::DVec3;

use super::layout::{DOMAIN_VERTICES, Label, Node, Side, TETRAHEDRA};
use super::{AssetError, SharedSection, TeSdf};
use crate::deform::Incidence;
use crate::domain::{Cell, Classes};
use crate::geometry::{Aabb, AabbTree, Child, barycentric};

/// The tetrahedra of a conforming domain, each the root of a bisection tree, and a tree of boxes that finds them.
#[derive(Clone, Debug)]
pub(crate) struct Conforming {
    tetrahedra: SharedSection<[u32; 4]>,
    /// Of the domain and not of the mesh.
    vertices: SharedSection<[f64; 3]>,
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
        let vertices: SharedSection<[f64; 3]> = match container.section::<[f64; 3]>(DOMAIN_VERTICES.name)? {
            Some(_) => container.shared_section(DOMAIN_VERTICES.name)?,
            None => SharedSection::of_rows(&[]),
        };
        let wrong = |name: &'static str, reason| Err(AssetError::section(name, reason));
        if let Some(i) = vertices.iter().position(|v| !v.iter().all(|x| x.is_finite())) {
            return wrong(DOMAIN_VERTICES.name, format!("vertex {i} is not finite"));
        }
        let count = asset.vertices.len() + vertices.len();
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
        let boxes: Vec<Aabb> = (0..domain.tetrahedra.len()).map(|t| domain.bounds(asset, t)).collect();
        domain.tree = AabbTree::build(&boxes, LEAF);
        Ok(Some(domain))
    }

    /// Fits the tree of boxes to where some tetrahedra are now.
    pub fn refit(&mut self, asset: &TeSdf, tetrahedra: &[u32], incidence: &Incidence) {
        let mut tree = std::mem::replace(&mut self.tree, AabbTree::build(&[], LEAF));
        let places = tetrahedra.iter().map(|&t| incidence.place[t as usize]);
        incidence.tetrahedron_tree.climb(places, |slot| tree.refit(slot, |t| self.bounds(asset, t as usize)));
        tree.refit_root(|t| self.bounds(asset, t as usize));
        self.tree = tree;
    }

    fn bounds(&self, asset: &TeSdf, tetrahedron: usize) -> Aabb {
        Aabb::of(&self.corners(asset, tetrahedron)).grown(PAD)
    }

    fn corners(&self, asset: &TeSdf, tetrahedron: usize) -> [DVec3; 4] {
        self.corners_in_unit(asset, tetrahedron).map(|p| asset.frame.to_local(p))
    }

    /// Corners of a tetrahedron, in the mesh's unit.
    pub fn corners_in_unit(&self, asset: &TeSdf, tetrahedron: usize) -> [DVec3; 4] {
        let mesh = &asset.vertices;
        self.tetrahedra[tetrahedron].map(|v| {
            let v = v as usize;
            DVec3::from_array(if v < mesh.len() { mesh[v] } else { self.vertices[v - mesh.len()] })
        })
    }

    /// Corner ids of the tetrahedra.
    pub fn tetrahedra(&self) -> &[[u32; 4]] {
        &self.tetrahedra
    }

    /// The vertices that are not of the mesh, in its unit.
    pub fn vertices(&self) -> &[[f64; 3]] {
        &self.vertices
    }

    /// Replaces them; [`refit`](Self::refit) is next.
    pub fn set_vertices(&mut self, vertices: &[[f64; 3]]) {
        self.vertices = SharedSection::of_rows(vertices);
    }

    /// What each vertex moves.
    pub fn incidence(&self, asset: &TeSdf) -> Incidence {
        Incidence::new(asset, &self.tetrahedra, asset.vertices.len() + self.vertices.len(), &self.tree)
    }

    /// Size in bytes of what opening made.
    pub fn derived_bytes(&self) -> usize {
        std::mem::size_of_val(self.tree.nodes()) + std::mem::size_of_val(self.tree.order())
    }
}

impl TeSdf {
    /// How many vertices and tetrahedra of a conforming domain there are of each class (Sec. III-A); `None` for the bisection domain.
    pub fn classes(&self) -> Option<Classes> {
        let domain = self.conforming.as_ref()?;
        let sides = (0..domain.tetrahedra.len()).map(|root| self.side_of_root(root));
        let tetrahedra = domain.tetrahedra.iter().copied().zip(sides);
        let vertices = self.vertices.len() + domain.vertices.len();
        Some(Classes::count(vertices, tetrahedra, |v| (v as usize) < self.vertices.len()))
    }

    /// All cells of a root are on its side.
    fn side_of_root(&self, root: usize) -> Side {
        let mut word = self.nodes[root];
        loop {
            match Node::decode(word, &self.lists) {
                Node::Split(children) => word = self.nodes[children as usize],
                Node::Listed(Label::Inside, _) | Node::Far(Side::Inside) => return Side::Inside,
                Node::Listed(..) | Node::Far(Side::Outside) | Node::NotOfDomain => return Side::Outside,
            }
        }
    }

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

    /// The tetrahedron of a conforming domain that holds a point of the local frame, with the point's coordinates in it. On a border the
    /// first one found; by rounding a point may be a little out of all, and then the one that it is the least out of.
    pub(crate) fn locate_root(&self, domain: &Conforming, p: DVec3) -> Option<(usize, [f64; 4])> {
        let mut best: Option<(f64, usize, [f64; 4])> = None;
        let (bounds, root) = domain.tree.root();
        let mut stack = [root; AabbTree::MAX_DEPTH + 2];
        let mut top = usize::from(bounds.contains(p));
        while top > 0 {
            top -= 1;
            let (start, end) = match stack[top] {
                Child::Leaf { start, end } => (start as usize, end as usize),
                Child::Node(node) => {
                    for (bounds, child) in domain.tree.nodes()[node as usize] {
                        stack[top] = child;
                        top += usize::from(bounds.contains(p));
                    }
                    continue;
                }
            };
            for &t in &domain.tree.order()[start..end] {
                let corners = domain.corners(self, t as usize);
                if is_clearly_outside(&corners, p) {
                    continue;
                }
                let lambda = barycentric(&corners, p);
                let least = lambda.into_iter().fold(f64::INFINITY, f64::min);
                if least >= 0.0 {
                    return Some((t as usize, lambda));
                }
                if least >= OUTSIDE && best.is_none_or(|(b, ..)| least > b) {
                    best = Some((least, t as usize, lambda));
                }
            }
        }
        best.map(|(_, root, lambda)| (root, lambda))
    }

    /// The tetrahedra of a conforming domain whose boxes overlap `bounds` (local frame), in no order that matters.
    pub(crate) fn visit_roots(&self, domain: &Conforming, bounds: Aabb, mut visit: impl FnMut(usize)) {
        domain.tree.visit(|b| b.overlaps(bounds), |leaf| leaf.iter().for_each(|&t| visit(t as usize)));
    }
}

/// Whether a point is in front of a side by more than rounding: most tetrahedra whose boxes hold it.
fn is_clearly_outside([a, b, c, d]: &[DVec3; 4], p: DVec3) -> bool {
    let (ab, ac, ad, ap) = (*b - *a, *c - *a, *d - *a, p - *a);
    // Six times the volumes that the point has with three of the sides.
    let across = [ac.cross(ad), ad.cross(ab), ab.cross(ac)];
    let whole = ab.dot(across[0]);
    let parts = across.map(|side| ap.dot(side) * whole.signum());
    // The second part is what slivers need: the rounding of volumes of edges up to 4.
    let slack = 1e-9 * whole.abs() + 1e-13;
    parts.iter().any(|&part| part < -slack) || parts.iter().sum::<f64>() > whole.abs() + slack
}
