//! Lower bounds of the signed distances in cells, by which a detection skips cells.
use glam::DVec3;

use super::{Place, Precision};
use crate::TeSdf;
use crate::asset::CellBounds;
use crate::asset::layout::{Label, Node};
use crate::base::Side;
use crate::domain::Cell;

/// Rounding that a bound may contain: of `f32` values and of the conversion.
const ROUNDING: f64 = 4e-6;

impl TeSdf {
    /// Lower bounds of the signed distances in the cells; computed on first use.
    pub(crate) fn cell_bounds(&self) -> &CellBounds {
        self.cell_bounds.get_or_init(|| {
            let mut bounds = vec![0.0f32; self.nodes.len()];
            // Children follow their parents in the file. So cells are visited downwards, and bounds
            // are combined upwards.
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
            // The inside of an open mesh may be there.
            Node::Far(_) | Node::NotOfDomain if !self.is_outside_within(center, reach) => 0.0,
            Node::Far(Side::Outside) => at_center(Place::Far(Side::Outside)),
            Node::NotOfDomain => {
                // A cell outside the domain is at least as far away as the band.
                let low = at_center(Place::NotOfDomain).max(0.0);
                low.max(self.band() * (1.0 - 1e-9))
            }
            _ => 0.0,
        };
        (least - ROUNDING).max(0.0)
    }

    /// Whether all points within `radius` of `p` are certainly outside, or the sign changes at
    /// faces only.
    fn is_outside_within(&self, p: DVec3, radius: f64) -> bool {
        self.jump().is_none_or(|jump| {
            let apart = self.found_at(p, self.locate(p), Precision::F32).signed_distance;
            apart - ROUNDING > radius && jump.is_outside_within(p, radius)
        })
    }

    /// Lower bound of the distance to a face over a cell. The distance is convex, so its tangent at
    /// the centre lies below it. The error is of second order in the size of the cell.
    fn least_to_face(&self, face: u32, center: DVec3, corners: &[DVec3; 4]) -> f64 {
        let closest = self.records[face as usize].triangle().closest(center - self.cube.middle());
        let outward = center - self.cube.middle() - closest.point;
        let Some(gradient) = outward.try_normalize() else { return 0.0 };
        let least = corners.iter().map(|c| gradient.dot(*c - center)).fold(f64::INFINITY, f64::min);
        closest.distance + least
    }
}
