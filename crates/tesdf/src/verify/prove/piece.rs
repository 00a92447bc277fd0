//! A piece of a cell, and how it is cut in two.
use glam::DVec3;

use super::exact::{U, difference};
use super::parts::Face;

/// The edges of a tetrahedron.
const EDGES: [(usize, usize); 6] = [(0, 1), (0, 2), (0, 3), (1, 2), (1, 3), (2, 3)];

/// A tetrahedron.
#[derive(Clone, Copy, Debug)]
pub struct Piece {
    /// Corners, relative to the middle of the cell.
    pub corners: [DVec3; 4],
    /// By how much the pieces may miss points of the cell, as cuts are rounded.
    pub drift: f64,
    /// Number of cuts.
    pub depth: u32,
}

/// A cut: an edge, and the point of it that becomes the new corner.
#[derive(Clone, Copy, Debug)]
pub struct Cut {
    /// The ends of the edge; each child has the new corner in place of one of them.
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

    /// A point in the middle, and the radius of a ball around it that holds the piece.
    pub fn ball(&self) -> (DVec3, f64) {
        let [a, b, c, d] = self.corners;
        let center = 0.25 * ((a + b) + (c + d));
        let radius = self.corners.iter().map(|p| p.distance(center)).fold(0.0, f64::max);
        (center, radius * (1.0 + 8.0 * U))
    }

    /// Half of the longest edge.
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

    /// Along the side of the prism over a face, unless no side clearly passes through the piece.
    ///
    /// Where two faces of one plane meet over a piece, halving would never tell them apart.
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

    /// The part on one side of a cut: `end` 0 or 1 of the edge is replaced.
    pub fn child(&self, cut: &Cut, end: usize) -> Self {
        let mut child = Self { drift: self.drift + cut.drift, depth: self.depth + 1, ..*self };
        child.corners[cut.edge[end]] = cut.corner;
        child
    }
}

/// Share of the longest edge that a plane must leave on both sides to cut.
const CLEAR: f64 = 1e-3;
