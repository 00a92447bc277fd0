//! From what distance on a cell needs each face of its list: Eq. (7), by bounds.
use super::candidates::{Candidates, GRADIENT};
use super::filter::{Scratch, filter};
use super::surface::{Requirement, Surface};
use crate::base::Chains;
use crate::domain::Cell;

/// A face of a list, with what truncation asks.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ranked {
    /// The face.
    pub face: u32,
    /// Less comes first.
    pub order: f64,
    /// At points nearer to the surface than this the cell does not need the face (local frame).
    pub distance: f64,
}

/// Bisections below a cell that tell from what distance on it needs a face.
const LEVELS: u32 = 8;
/// Sub-cells this small against their distance from the surface are not bisected on: their bounds are as sharp as they need be.
const SMALL: f64 = 0.02;

/// For each face of a list a lower bound of d_f, Eq. (7): the least distance over the sub-cells in which the face, or an edge or
/// vertex that it stands in for, survives the filter. Infinite for a face that no sub-cell needs.
///
/// A point that is nearer to the surface than the bounds of all faces that are left out has its closest feature in the list: the
/// feature survives in its sub-cell, so the face that has it, or stands in for it, has a bound of at most its distance.
///
/// `chains` are those that the list rests on; what comes back besides are those that the bounds rest on.
pub fn rank(
    surface: &Surface,
    cell: &Cell,
    list: &[u32],
    chains: Chains,
    scratch: &mut Scratch,
) -> (Vec<Ranked>, Chains) {
    let mut needs = Needs { surface, found: Vec::new(), heaviest: chains };
    let mut pool = scratch.pool();
    pool.fill(surface, list, cell);
    needs.descend(cell, &pool.candidates(), LEVELS, chains, scratch);
    scratch.give_back(pool);
    let Needs { found: mut needs, heaviest, .. } = needs;
    needs.sort_by(|a: &(Requirement, f64), b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)));
    needs.dedup_by_key(|need| need.0);
    let mut distances = vec![f64::INFINITY; list.len()];
    let (faces, parts): (Vec<_>, Vec<_>) = needs.into_iter().partition(|need| surface.is_face(need.0));
    for (distance, &face) in distances.iter_mut().zip(list) {
        let own = faces.iter().filter(|need| surface.holds(face, need.0));
        *distance = own.map(|need| need.1).fold(f64::INFINITY, f64::min);
    }
    stand_in(surface, list, parts, &mut distances);
    let ranked = |(&face, distance)| Ranked { face, order: distance, distance };
    (list.iter().zip(distances).map(ranked).collect(), heaviest)
}

/// Lets one face stand in for each edge or vertex: of those that have it the one that is needed nearest to the surface anyway. Were it all of
/// them, the faces around every vertex of the cell would be needed at distance 0.
fn stand_in(surface: &Surface, list: &[u32], mut parts: Vec<(Requirement, f64)>, distances: &mut [f64]) {
    parts.sort_by(|a, b| a.1.total_cmp(&b.1).then(a.0.cmp(&b.0)));
    for (part, distance) in parts {
        let holders = (0..list.len()).filter(|&at| surface.holds(list[at], part));
        if let Some(at) = holders.min_by(|&a, &b| distances[a].total_cmp(&distances[b])) {
            distances[at] = distances[at].min(distance);
        }
    }
}

/// What sub-cells need, each with a lower bound of the distance where they do.
struct Needs<'a> {
    surface: &'a Surface,
    found: Vec<(Requirement, f64)>,
    /// The heaviest chains of rule C on a way down so far.
    heaviest: Chains,
}

impl Needs<'_> {
    fn descend(
        &mut self,
        cell: &Cell,
        candidates: &Candidates,
        levels: u32,
        chains: Chains,
        scratch: &mut Scratch,
    ) {
        let surface = self.surface;
        let filtered = filter(surface, cell, candidates, chains, scratch);
        let chains = filtered.chains;
        self.heaviest = self.heaviest.max(chains);
        if levels == 0 || filtered.radius < SMALL * filtered.distance || filtered.survivors.len() == 1 {
            let center = cell.centroid();
            for s in &filtered.survivors {
                let at = |row: usize| scratch.centroid[row * candidates.stride + s.index as usize];
                let gradient = glam::DVec3::new(at(GRADIENT), at(GRADIENT + 1), at(GRADIENT + 2));
                // The distance is convex: its tangent is below it. No tangent (NaN) on the face itself.
                let below =
                    cell.corners.iter().map(|c| gradient.dot(*c - center)).fold(f64::INFINITY, f64::min);
                let least = if s.meets { 0.0 } else { (at(0) + below - surface.margin).max(0.0) };
                self.found.push((s.requirement, least));
            }
            scratch.reuse(filtered);
            return;
        }
        let mut pool = scratch.pool();
        pool.narrow(surface, cell, candidates, &filtered.survivors);
        scratch.reuse(filtered);
        for side in 0..2 {
            let below = pool.of_child(candidates, cell.child_corners(side));
            self.descend(&cell.child(side), &below, levels - 1, chains, scratch);
        }
        scratch.give_back(pool);
    }
}
