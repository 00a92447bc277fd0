//! The tetrahedra that the bisection forest grows from: those of the cube, or of a conforming
//! domain.
use glam::DVec3;

use super::TeSdf;
use super::conforming::{Conforming, Placed};
use super::layout::{Label, Node};
use crate::base::Side;
use crate::domain::{Cell, Classes};
use crate::geometry::{Aabb, AabbTree, Child, barycentric};

/// By rounding, a point of the border may be out of all tetrahedra, by less than this in
/// barycentric coordinates.
const OUTSIDE: f64 = -1e-12;

impl TeSdf {
    /// The numbers of vertices and tetrahedra of a conforming domain by class (Sec. III-A). `None`
    /// for the bisection domain.
    pub fn classes(&self) -> Option<Classes> {
        let domain = self.conforming.as_ref()?;
        let sides = (0..domain.tetrahedra().len()).map(|root| self.side_of_root(root));
        let tetrahedra = domain.tetrahedra().iter().copied().zip(sides);
        let vertices = self.vertices.len() + domain.vertices().len();
        Some(Classes::count(vertices, tetrahedra, |v| (v as usize) < self.vertices.len()))
    }

    /// The side of a root. All of its cells are on this side.
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

    /// The positions of the vertices of the mesh.
    pub(crate) fn placed(&self) -> Placed<'_> {
        Placed { vertices: &self.vertices, frame: self.frame }
    }

    /// Number of tetrahedra that the bisection forest grows from.
    pub(crate) fn root_count(&self) -> usize {
        self.conforming.as_ref().map_or(6, |domain| domain.tetrahedra().len())
    }

    /// A root of the forest, in the local frame.
    pub(crate) fn root(&self, root: usize) -> Cell {
        match &self.conforming {
            None => self.cube.root(root),
            Some(domain) => Cell { corners: domain.corners(self.placed(), root), depth: 0 },
        }
    }

    /// Locates a point of the local frame: the tetrahedron of a conforming domain that has the
    /// point, and the coordinates of the point in it.
    ///
    /// On a border it is the first tetrahedron found. By rounding, a point may be a little out of
    /// all tetrahedra. Then it is the tetrahedron that the point is the least out of.
    pub(crate) fn locate_root(&self, domain: &Conforming, p: DVec3) -> Option<(usize, [f64; 4])> {
        let placed = self.placed();
        let mut best: Option<(f64, usize, [f64; 4])> = None;
        let (bounds, root) = domain.tree().root();
        let mut stack = [root; AabbTree::MAX_DEPTH + 2];
        let mut top = usize::from(bounds.contains(p));
        while top > 0 {
            top -= 1;
            let (start, end) = match stack[top] {
                Child::Leaf { start, end } => (start as usize, end as usize),
                Child::Node(node) => {
                    for (bounds, child) in domain.tree().nodes()[node as usize] {
                        stack[top] = child;
                        top += usize::from(bounds.contains(p));
                    }
                    continue;
                }
            };
            for &t in &domain.tree().order()[start..end] {
                let corners = domain.corners(placed, t as usize);
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

    /// Calls `visit` with the tetrahedra of a conforming domain whose boxes overlap `bounds` (local
    /// frame). The order does not matter.
    pub(crate) fn visit_roots(&self, domain: &Conforming, bounds: Aabb, mut visit: impl FnMut(usize)) {
        domain.tree().visit(|b| b.overlaps(bounds), |leaf| leaf.iter().for_each(|&t| visit(t as usize)));
    }
}

/// Whether a point is in front of a side by more than rounding. This is so for most tetrahedra
/// whose boxes have the point.
fn is_clearly_outside([a, b, c, d]: &[DVec3; 4], p: DVec3) -> bool {
    let (ab, ac, ad, ap) = (*b - *a, *c - *a, *d - *a, p - *a);
    // Six times the volumes of the point with three of the sides.
    let across = [ac.cross(ad), ad.cross(ab), ab.cross(ac)];
    let whole = ab.dot(across[0]);
    let parts = across.map(|side| ap.dot(side) * whole.signum());
    // Slivers need the second term: the rounding of volumes with edges up to 4.
    let slack = 1e-9 * whole.abs() + 1e-13;
    parts.iter().any(|&part| part < -slack) || parts.iter().sum::<f64>() > whole.abs() + slack
}
