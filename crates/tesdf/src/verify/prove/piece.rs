//! A piece of a cell, and cutting it in two.
use glam::DVec3;

use super::exact::{U, difference};
use super::parts::Face;

/// The edges of a tetrahedron.
const EDGES: [(usize, usize); 6] = [(0, 1), (0, 2), (0, 3), (1, 2), (1, 3), (2, 3)];

/// A tetrahedron.
#[derive(Clone, Copy, Debug)]
pub struct Piece {
    /// Corners, relative to the centroid of the cell.
    pub corners: [DVec3; 4],
    /// Bound of how far the pieces may miss points of the cell, because cuts are rounded.
    pub drift: f64,
    /// Number of cuts that led to this piece.
    pub depth: u32,
}

/// A cut: an edge and its point that becomes the new corner.
#[derive(Clone, Copy, Debug)]
pub struct Cut {
    /// The ends of the edge. In each child, the new corner replaces one of them.
    pub edge: [usize; 2],
    /// The new corner.
    pub corner: DVec3,
    drift: f64,
}

impl Piece {
    /// The whole cell.
    pub fn whole(corners: [DVec3; 4]) -> Self {
        Self { corners, drift: 0.0, depth: 0 }
    }

    /// Centre and radius of a ball that contains the piece.
    pub fn ball(&self) -> (DVec3, f64) {
        let [a, b, c, d] = self.corners;
        let center = 0.25 * ((a + b) + (c + d));
        let radius = self.corners.iter().map(|p| p.distance(center)).fold(0.0, f64::max);
        (center, radius * (1.0 + 8.0 * U))
    }

    /// A cut at the middle of the longest edge.
    pub fn halved(&self) -> Cut {
        let [i, j] = self.longest();
        let (a, b) = (self.corners[i], self.corners[j]);
        let lost = DVec3::from_array([0, 1, 2].map(|k| difference(a[k], -b[k]).1));
        Cut { edge: [i, j], corner: 0.5 * (a + b), drift: lost.length() }
    }

    fn longest(&self) -> [usize; 2] {
        let length = |(i, j): (usize, usize)| self.corners[i].distance_squared(self.corners[j]);
        let longest =
            EDGES.into_iter().fold(EDGES[0], |best, e| if length(e) > length(best) { e } else { best });
        [longest.0, longest.1]
    }

    /// A cut along a side of the prism over a face; `None` when no side clearly passes through the
    /// piece.
    ///
    /// When two coplanar faces meet over a piece, halving alone would never separate their regions.
    pub fn cut_by(&self, face: &Face) -> Option<Cut> {
        let sides = self.corners.map(|c| face.sides(c));
        let [i, j] = self.longest();
        let clear = CLEAR * self.corners[i].distance(self.corners[j]);
        for k in 0..3 {
            let at = |corner: usize| sides[corner].map_or(0.0, |s| s[k]);
            let crosses = |&(i, j): &(usize, usize)| at(i).min(at(j)) < -clear && at(i).max(at(j)) > clear;
            let width = |(i, j): (usize, usize)| (at(i) - at(j)).abs();
            let widest = EDGES.into_iter().filter(crosses).max_by(|&a, &b| width(a).total_cmp(&width(b)));
            if let Some((i, j)) = widest {
                let (a, b) = (self.corners[i], self.corners[j]);
                let corner = a + (at(i) / (at(i) - at(j))) * (b - a);
                return Some(Cut { edge: [i, j], corner, drift: 8.0 * U * a.length().max(b.length()) });
            }
        }
        None
    }

    /// The part on one side of a cut. `end`, 0 or 1, is the end of the edge that is replaced.
    pub fn child(&self, cut: &Cut, end: usize) -> Self {
        let mut child = Self { drift: self.drift + cut.drift, depth: self.depth + 1, ..*self };
        child.corners[cut.edge[end]] = cut.corner;
        child
    }
}

/// A plane must leave at least this fraction of the longest edge on both sides to be used for a
/// cut.
const CLEAR: f64 = 1e-3;
