//! The tetrahedra that the bisection forest grows from: those of the cube, or of a conforming domain.
use glam::DVec3;

use super::TeSdf;
use super::conforming::{Conforming, Placed};
use super::layout::{Label, Node};
use crate::base::Side;
use crate::domain::{Cell, Classes};
use crate::geometry::{Aabb, AabbTree, Child, barycentric};

/// A point of the border may be out of all tetrahedra by rounding: by less than this, in barycentric coordinates.
const OUTSIDE: f64 = -1e-12;

impl TeSdf {
    /// How many vertices and tetrahedra of a conforming domain there are of each class (Sec. III-A); `None` for the bisection domain.
    pub fn classes(&self) -> Option<Classes> {
        let domain = self.conforming.as_ref()?;
        let sides = (0..domain.tetrahedra().len()).map(|root| self.side_of_root(root));
        let tetrahedra = domain.tetrahedra().iter().copied().zip(sides);
        let vertices = self.vertices.len() + domain.vertices().len();
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

    /// Where the vertices of the mesh are.
    pub(crate) fn placed(&self) -> Placed<'_> {
        Placed { vertices: &self.vertices, frame: self.frame }
    }

    /// Number of tetrahedra that the bisection forest grows from.
    pub(crate) fn root_count(&self) -> usize {
        self.conforming.as_ref().map_or(6, |domain| domain.tetrahedra().len())
    }

    /// One of them, in the local frame.
    pub(crate) fn root(&self, root: usize) -> Cell {
        match &self.conforming {
            None => self.cube.root(root),
            Some(domain) => Cell { corners: domain.corners(self.placed(), root), depth: 0 },
        }
    }

    /// The tetrahedron of a conforming domain that holds a point of the local frame, with the point's coordinates in it. On a border the
    /// first one found; by rounding a point may be a little out of all, and then the one that it is the least out of.
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

    /// The tetrahedra of a conforming domain whose boxes overlap `bounds` (local frame), in no order that matters.
    pub(crate) fn visit_roots(&self, domain: &Conforming, bounds: Aabb, mut visit: impl FnMut(usize)) {
        domain.tree().visit(|b| b.overlaps(bounds), |leaf| leaf.iter().for_each(|&t| visit(t as usize)));
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
