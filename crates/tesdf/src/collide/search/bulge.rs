//! The part of the round side of a cylinder that a piece stands for.
use glam::DVec3;

use crate::collide::bodies::round_side::RoundSide;

/// A piece of which corners are on a round side. What is between them there lies beside the piece.
#[derive(Clone, Debug)]
pub struct Bulge {
    round: RoundSide,
    /// Which corners are on it.
    is_on: [bool; 3],
    /// The surface lies within this distance of the piece.
    pub height: f64,
}

/// The corners of the edges of a triangle.
const EDGES: [(usize, usize); 3] = [(0, 1), (1, 2), (2, 0)];

impl Bulge {
    /// Of a face of the prism of a cylinder; `None` of one that has no edge on the round side.
    pub fn of_face(round: RoundSide, corners: [DVec3; 3]) -> Option<Self> {
        // Only the middles of the ends are on the axis.
        let is_on = corners.map(|p| round.beside(p).length() > 0.5 * round.radius);
        Self::new(round, is_on, corners)
    }

    fn new(round: RoundSide, is_on: [bool; 3], corners: [DVec3; 3]) -> Option<Self> {
        let chord = EDGES.iter().filter(|&&(k, l)| is_on[k] && is_on[l]);
        let chord = chord.map(|&(k, l)| round.chord(corners[k], corners[l])).fold(0.0, f64::max);
        // Between places that differ by an angle α, at most 1 - cos(α / 2), or α² / 8, of the radius.
        // Pieces span less than 0.2, where α is at most 1.002 times its chord.
        let height = 1.01 * chord * chord / (8.0 * round.radius);
        (height > 0.0).then_some(Self { round, is_on, height })
    }

    /// The point of the surface that a point of the piece stands for.
    pub fn on_surface(&self, p: DVec3) -> DVec3 {
        match self.is_on {
            [true, true, true] => self.round.nearest(p),
            // What is on an end is on the surface.
            _ => p,
        }
    }

    /// The corners of the two halves, and their bulges. The middle of an edge between two corners on
    /// the round side is on it, too. `is_flat` tells whether only the bulge is too high.
    pub fn halves(&self, corners: [DVec3; 3], is_flat: bool) -> [([DVec3; 3], Option<Self>); 2] {
        let Self { round, is_on, .. } = self;
        let length = |&(k, l): &(usize, usize)| match is_flat {
            true if is_on[k] && is_on[l] => round.chord(corners[k], corners[l]),
            true => 0.0,
            false => corners[k].distance(corners[l]),
        };
        let longest = EDGES.iter().max_by(|a, b| length(a).total_cmp(&length(b)));
        let &(k, l) = longest.unwrap_or(&EDGES[0]);
        let is_on_round = is_on[k] && is_on[l];
        let middle = 0.5 * (corners[k] + corners[l]);
        let middle = if is_on_round { round.nearest(middle) } else { middle };
        [l, k].map(|moved| {
            let (mut corners, mut is_on) = (corners, *is_on);
            (corners[moved], is_on[moved]) = (middle, is_on_round);
            (corners, Self::new(*round, is_on, corners))
        })
    }
}
