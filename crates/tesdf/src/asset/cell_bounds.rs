use glam::DVec3;

use super::TeSdf;
use super::layout::{Label, Node, Side};
use crate::domain::Cell;
use crate::query::{Place, Precision};

/// For every word of the forest a lower bound of the signed distances in its cell, made when a detection first wants it.
///
/// A byte each: the square root of the bound, as a share of that of the greatest one, rounded down.
#[derive(Clone, Debug)]
pub(crate) struct CellBounds {
    bytes: Vec<u8>,
    /// Squared steps to lengths of the local frame.
    unit: f64,
}

const STEPS: f64 = 255.0;

impl CellBounds {
    /// That of no cell is known.
    pub fn none() -> Self {
        Self { bytes: Vec::new(), unit: 0.0 }
    }

    /// For the cells of an asset.
    pub fn new(asset: &TeSdf) -> Self {
        let mut bounds = vec![0.0f32; asset.nodes.len()];
        // Children follow their parents: cells on the way down, bounds on the way up.
        let mut stack: Vec<(u32, Cell)> =
            (0..asset.root_count()).map(|root| (root as u32, asset.root(root))).collect();
        while let Some((word, cell)) = stack.pop() {
            match Node::decode(asset.nodes[word as usize], &asset.lists) {
                Node::Split(c) => stack.extend([(c, cell.child(0)), (c + 1, cell.child(1))]),
                leaf => bounds[word as usize] = asset.least_in_leaf(&leaf, &cell) as f32,
            }
        }
        for word in (0..bounds.len()).rev() {
            if let Node::Split(c) = Node::decode(asset.nodes[word], &asset.lists) {
                bounds[word] = bounds[c as usize].min(bounds[c as usize + 1]);
            }
        }
        let greatest = bounds.iter().copied().fold(f32::MIN_POSITIVE, f32::max);
        let unit = f64::from(greatest) / (STEPS * STEPS);
        let byte = |b: &f32| {
            let mut step = (f64::from(*b) / unit).sqrt().floor().min(STEPS);
            while step > 0.0 && step * step * unit > f64::from(*b) {
                step -= 1.0;
            }
            step as u8
        };
        Self { bytes: bounds.iter().map(byte).collect(), unit }
    }

    /// The bytes, and what a squared one is worth.
    pub fn bytes(&self) -> (&[u8], f64) {
        (&self.bytes, self.unit)
    }

    /// No point of the cell has a signed distance below this (local frame); 0 where the solid may be.
    #[inline]
    pub fn least(&self, word: u32) -> f64 {
        let step = f64::from(self.bytes.get(word as usize).copied().unwrap_or(0));
        step * step * self.unit
    }
}

/// What rounding may have added to a bound: that of `f32`, and its conversion.
const ROUNDING: f64 = 4e-6;

impl TeSdf {
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
