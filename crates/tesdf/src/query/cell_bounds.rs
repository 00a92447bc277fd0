//! Lower bounds of the signed distances in cells: what a detection skips cells by.
use glam::DVec3;

use super::{Place, Precision};
use crate::TeSdf;
use crate::asset::CellBounds;
use crate::asset::layout::{Label, Node};
use crate::base::Side;
use crate::domain::Cell;

/// What rounding may have added to a bound: that of `f32`, and its conversion.
const ROUNDING: f64 = 4e-6;

impl TeSdf {
    /// The least signed distances of the cells; made on first use.
    pub(crate) fn cell_bounds(&self) -> &CellBounds {
        self.cell_bounds.get_or_init(|| {
            let mut bounds = vec![0.0f32; self.nodes.len()];
            // Children follow their parents: cells on the way down, bounds on the way up.
            let mut stack: Vec<(u32, Cell)> =
                (0..self.root_count()).map(|root| (root as u32, self.root(root))).collect();
            while let Some((word, cell)) = stack.pop() {
                match Node::decode(self.nodes[word as usize], &self.lists) {
                    Node::Split(c) => stack.extend([(c, cell.child(0)), (c + 1, cell.child(1))]),
                    leaf => bounds[word as usize] = self.least_in_leaf(&leaf, &cell) as f32,
                }
            }
            for word in (0..bounds.len()).rev() {
                if let Node::Split(c) = Node::decode(self.nodes[word], &self.lists) {
                    bounds[word] = bounds[c as usize].min(bounds[c as usize + 1]);
                }
            }
            CellBounds::of(&bounds)
        })
    }

    fn least_in_leaf(&self, leaf: &Node, cell: &Cell) -> f64 {
        let center = cell.centroid();
        let reach = cell.radius();
        let at_center = |place| self.found_at(center, place, Precision::F32).signed_distance - reach;
        let least = match *leaf {
            Node::Listed(Label::Outside, offset) => self.with_list(offset, |faces| {
                let least = |&face: &u32| self.least_to_face(face, center, &cell.corners);
                faces.ids().iter().map(least).fold(f64::INFINITY, f64::min)
            }),
            Node::Far(Side::Outside) => at_center(Place::Far(Side::Outside)),
            Node::NotOfDomain => {
                // Far out nothing is as near as the bounds.
                let low = at_center(Place::NotOfDomain).max(0.0);
                low.max(self.band() * (1.0 - 1e-9))
            }
            _ => 0.0,
        };
        (least - ROUNDING).max(0.0)
    }

    /// The distance to a face is convex, so its tangent at the centre is below it: a bound of the second order in the size of
    /// the cell.
    fn least_to_face(&self, face: u32, center: DVec3, corners: &[DVec3; 4]) -> f64 {
        let closest = self.records[face as usize].triangle().closest(center - self.cube.middle());
        let outward = center - self.cube.middle() - closest.point;
        let Some(gradient) = outward.try_normalize() else { return 0.0 };
        let least = corners.iter().map(|c| gradient.dot(*c - center)).fold(f64::INFINITY, f64::min);
        closest.distance + least
    }
}
