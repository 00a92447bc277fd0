//! Signs in a conforming domain: the labels of its tetrahedra, and that no part of the solid is
//! outside all of them.
use std::collections::HashMap;

use glam::DVec3;

use super::apart::{common_point, is_beside, orientation};
use super::report::{Claim, Fault};
use super::signs::{Signs, side_of};
use crate::asset::layout::{Label, Node};
use crate::base::Side;
use crate::domain::Cell;

impl Signs<'_> {
    /// The fault in the label of a tetrahedron of a conforming domain; `None` when the label is
    /// proved. `near` are the faces near it.
    ///
    /// Faces are sides of tetrahedra, so no face may meet the interior; this is tested exactly.
    /// Then the winding number is constant in the tetrahedron.
    pub fn root_fault(&self, root: usize, cell: &Cell, near: &[u32]) -> Option<Fault> {
        let centroid = cell.centroid();
        let winding = self.rays.at(centroid);
        let fault = match self.side_of_leaves(root) {
            None => Some("the cells of one tetrahedron have different labels".into()),
            Some(side) if (side == Side::Inside) != (winding >= 1) => {
                Some(format!("the label says {side:?}; the winding number at the centroid is {winding}"))
            }
            Some(_) if winding < 0 => Some(format!("the winding number is {winding}; expected 0 or more")),
            Some(_) => None,
        };
        if let Some(reason) = fault {
            return Some(Fault::refuted(Claim::Sign, reason).cell(root as u32).at(self.asset, centroid));
        }
        let radius = cell.corners.iter().map(|c| c.distance(centroid)).fold(0.0, f64::max);
        let comes_near = |face: &&u32| {
            let bound = self.surface.triangles[**face as usize].low(centroid, self.surface.error);
            bound.distance <= radius + 2.0 * self.surface.error
        };
        let corners_of = |face: u32| &self.surface.triangles[face as usize].corners;
        let passes = |face: &&u32| !is_beside(&cell.corners, corners_of(**face));
        let face = *near.iter().filter(comes_near).find(passes)?;
        let point = common_point(&cell.corners, corners_of(face)).unwrap_or(centroid);
        let reason = "a face passes through the tetrahedron, whose label says that none does";
        let fault = Fault::refuted(Claim::Sign, reason).cell(root as u32).at(self.asset, point);
        Some(fault.face(self.asset, face))
    }

    /// The common side of all cells of a tetrahedron; `None` when they differ.
    fn side_of_leaves(&self, root: usize) -> Option<Side> {
        let mut stack = vec![root as u32];
        let mut side = None;
        while let Some(word) = stack.pop() {
            match Node::decode(self.asset.nodes[word as usize], &self.asset.lists) {
                Node::Split(children) => stack.extend([children, children + 1]),
                Node::Listed(Label::Crossing(_), _) => return None,
                node if side.is_some_and(|s| s != side_of(node)) => return None,
                node => side = Some(side_of(node)),
            }
        }
        side
    }

    /// The fault in the space outside all tetrahedra, where every query answers outside; `None`
    /// when it is proved.
    ///
    /// The boundaries of the tetrahedra, each multiplied by the winding number in the tetrahedron,
    /// must add up to the surface. Then the winding number of a point is that of the tetrahedron
    /// that contains it, and 0 when there is none.
    pub fn outside_fault(&self, roots: &[Cell]) -> Option<Fault> {
        let mut sum: HashMap<[[u64; 3]; 3], i64> = HashMap::new();
        let mut add = |triangle: [DVec3; 3], times: i64| {
            if let Some((key, sign)) = oriented(triangle) {
                *sum.entry(key).or_default() += sign * times;
            }
        };
        for (root, cell) in roots.iter().enumerate() {
            let [a, b, c, d] = cell.corners;
            let volume = orientation(a, b, c, d);
            if volume == 0 {
                let reason = "the tetrahedron is flat";
                return Some(
                    Fault::refuted(Claim::Sign, reason).cell(root as u32).at(self.asset, cell.centroid()),
                );
            }
            let times = i64::from(volume * self.rays.at(cell.centroid()));
            for side in [[a, b, c], [a, c, d], [a, d, b], [b, d, c]] {
                add(side, times);
            }
        }
        for triangle in &self.surface.triangles {
            add(triangle.corners, -1);
        }
        let open = sum.into_iter().filter(|(_, times)| *times != 0).map(|(key, _)| key).min()?;
        let point = DVec3::from_array(open[0].map(f64::from_bits));
        let reason = "the tetrahedra inside of the solid do not fill the solid";
        Some(Fault::refuted(Claim::Sign, reason).at(self.asset, point))
    }
}

/// A triangle with its corners in a canonical order, and the sign of the permutation; `None` when
/// two corners are equal.
fn oriented(triangle: [DVec3; 3]) -> Option<([[u64; 3]; 3], i64)> {
    let mut key = triangle.map(|p| (p + 0.0).to_array().map(f64::to_bits));
    let mut sign = 1;
    for (i, j) in [(0, 1), (1, 2), (0, 1)] {
        if key[i] > key[j] {
            key.swap(i, j);
            sign = -sign;
        }
    }
    (key[0] != key[1] && key[1] != key[2]).then_some((key, sign))
}
