use glam::DVec3;
use serde::Serialize;

use super::TeSdf;
use super::layout::{Label, List, Node};
use crate::base::Side;
use crate::domain::Cell;

/// A cell: a tetrahedron of the domain.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CellView {
    /// The name of the cell: the number of its word in `domain.nodes`, which is also
    /// [`Contact::tet_b`](crate::collide::Contact::tet_b).
    pub id: u32,
    /// The corners, in the unit of the mesh.
    pub corners: [DVec3; 4],
    /// Number of bisections from a sixth of the cube, or from a tetrahedron of a conforming domain.
    pub depth: u32,
    /// Where the cell lies, and what answers for its points.
    pub kind: CellKind,
    /// Number of faces in its list. 0 for a cell without a list.
    pub list_length: usize,
}

/// Where a cell lies, and what answers for its points.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum CellKind {
    /// Outside of the solid. The cell has a list.
    Outside,
    /// Inside of the solid. The cell has a list.
    Inside,
    /// The surface comes into the cell, or close to it. The cell has a list.
    Crossing,
    /// Outside of the solid and far from the surface. The face tree answers.
    FarOutside,
    /// Inside of the solid and far from the surface. The face tree answers.
    FarInside,
    /// Farther out than the band.
    NotOfDomain,
}

impl CellKind {
    /// Whether the cell has a list.
    pub fn is_listed(self) -> bool {
        matches!(self, Self::Outside | Self::Inside | Self::Crossing)
    }
}

impl TeSdf {
    /// The faces in the list of a cell, by their ids in the source, ascending. `cell` is the
    /// [id](CellView::id) of the cell. Empty for a cell without a list, and for an id that is no
    /// cell.
    pub fn list_of(&self, cell: u32) -> Vec<u32> {
        let Some(&word) = self.nodes.get(cell as usize) else { return Vec::new() };
        let Node::Listed(_, offset) = Node::decode(word, &self.lists) else { return Vec::new() };
        let mut faces: Vec<u32> =
            self.with_list(offset, |faces| faces.ids().iter().map(|&f| self.face_ids[f as usize]).collect());
        faces.sort_unstable();
        faces
    }

    /// Calls `visit` with every cell, depth first, always in the same order.
    ///
    /// The cells fill a cube around the solid, or are the tetrahedra of a conforming domain,
    /// bisected or not. All cells together, without those of the kind [`CellKind::NotOfDomain`],
    /// are the domain.
    pub fn visit_cells(&self, mut visit: impl FnMut(&CellView)) {
        // Opening has checked that children follow their parents, so this loop ends.
        let mut stack: Vec<(u32, Cell)> =
            (0..self.root_count()).rev().map(|root| (root as u32, self.root(root))).collect();
        while let Some((word, cell)) = stack.pop() {
            let (kind, offset) = match Node::decode(self.nodes[word as usize], &self.lists) {
                Node::Split(children) => {
                    stack.push((children + 1, cell.child(1)));
                    stack.push((children, cell.child(0)));
                    continue;
                }
                Node::Listed(Label::Outside, offset) => (CellKind::Outside, Some(offset)),
                Node::Listed(Label::Inside, offset) => (CellKind::Inside, Some(offset)),
                Node::Listed(Label::Crossing(_), offset) => (CellKind::Crossing, Some(offset)),
                Node::Far(Side::Outside) => (CellKind::FarOutside, None),
                Node::Far(Side::Inside) => (CellKind::FarInside, None),
                Node::NotOfDomain => (CellKind::NotOfDomain, None),
            };
            let list = offset.and_then(|offset| List::decode(&self.lists, offset));
            visit(&CellView {
                id: word,
                corners: cell.corners.map(|p| self.frame.to_world(p)),
                depth: cell.depth,
                kind,
                list_length: list.map_or(0, List::len),
            });
        }
    }
}
