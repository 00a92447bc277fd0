//! The certified filter: finds the faces that can be closest somewhere in a cell.

use super::candidates::{Candidates, Pool, Survivor};
use super::chains::link_weight;
use super::doubles::{Doubles, GROUP, dispatch, visit_members};
use super::plane_rule::{PlaneRule, Rivals, Verdict};
use super::requirement_set::RequirementSet;
use super::surface::{Surface, Touching};
use crate::base::Chains;
use crate::domain::Cell;
use crate::geometry::{Feature, triangle_meets_tetrahedron};

/// A face that comes this near to a cell counts as meeting it. The length is in the local frame.
///
/// It is more than the rounding of point location (2^-52 of the cube). It is also more than 1e-9 ×
/// diagonal: nearer to the surface than that, the gradient comes from the faces around the closest
/// feature, so these faces must be in the list.
pub const PAD: f64 = 2.5e-9;

/// The result of the filter for a cell.
#[derive(Debug)]
pub struct Filtered {
    /// Faces that may be closest somewhere in the cell, or that meet it.
    pub survivors: Vec<Survivor>,
    /// Whether a face comes within [`PAD`] of the cell.
    pub crossing: bool,
    /// Radius of the least ball around the centroid that contains the cell.
    pub radius: f64,
    /// Least distance at the centroid.
    pub distance: f64,
    /// The closest candidate of each corner and of the centroid, and the part of it that is
    /// closest.
    pub closest: [(u32, Feature); 5],
    /// The chains of rule C up to this cell, with those of its own filter.
    pub chains: Chains,
}

/// Buffers that a thread uses again for each cell.
#[derive(Debug, Default)]
pub struct Scratch {
    /// The distances of the last cell's candidates from its centroid.
    pub(super) centroid: Vec<f64>,
    alive: Vec<u8>,
    near: Vec<u8>,
    verdict: Verdict,
    rivals: Rivals,
    survivors: Vec<Survivor>,
    meeting: Vec<Survivor>,
    /// For each survivor the weight of the longest chain of rule C that ends there, or [`DROPPED`].
    chained: Vec<u32>,
    pools: Vec<Pool>,
    pub(super) settled: RequirementSet,
}

impl Scratch {
    /// Keeps the memory of a result that is no longer needed.
    pub fn reuse(&mut self, filtered: Filtered) {
        self.survivors = filtered.survivors;
    }

    /// Gives memory for candidates.
    pub fn pool(&mut self) -> Pool {
        self.pools.pop().unwrap_or_default()
    }

    /// Takes the memory back for the next [`pool`](Self::pool).
    pub fn give_back(&mut self, pool: Pool) {
        self.pools.push(pool);
    }
}

/// A cell with more survivors than this is bisected anyway, and rule C looks at its children again.
const MAX_SHARING: usize = 256;
/// A vertex with more faces than this is looked at in such a cell too. Where the vertex is the
/// closest point of all of its faces, bisection drops none of them.
const LARGE_FAN: usize = 512;

/// Marks a survivor that rule C has dropped. No chain has this weight.
const DROPPED: u32 = u32::MAX;

/// More candidates than this are thinned out by rule A alone.
pub(super) const MANY: usize = 1 << 12;

/// Applies rules A (point), B (plane) and C (shared feature) to the candidates of a cell.
///
/// The proofs are in `docs/math.md`. Rules A and B drop a face only when another face is closer in
/// the whole cell by more than [`MARGIN`](super::surface::MARGIN). This is a strict partial order,
/// so the sequence of these tests does not matter. Rule C then goes through the remaining faces in
/// order. A face that meets the cell is kept whatever the rules say.
///
/// `chains` are those of the filters that left the candidates. Rule C stops where their budget is
/// used up.
pub fn filter(
    surface: &Surface,
    cell: &Cell,
    candidates: &Candidates,
    chains: Chains,
    scratch: &mut Scratch,
) -> Filtered {
    let m = cell.centroid();
    let n = candidates.faces.len();
    let radius = cell.radius();
    let at_centroid = candidates.look_from(surface, m, &mut scratch.centroid);

    // The closest points of the corners and of the centroid: the strongest rivals for rule A.
    let [a, b, c, d] = candidates.nearest;
    let nearest = [a, b, c, d, at_centroid];
    let reach = nearest.map(|h| cell.corners.map(|c| c.distance(h.point) + surface.margin));
    let closest = nearest.map(|h| (h.index, h.feature));
    let mut survivors = std::mem::take(&mut scratch.survivors);
    survivors.clear();
    let mut filtered =
        Filtered { survivors, crossing: false, radius, distance: at_centroid.distance, closest, chains };

    scratch.alive.resize(candidates.stride / GROUP, 0);
    scratch.near.resize(candidates.stride / GROUP, 0);
    let distances = candidates.seen.map(|rows| &rows[..candidates.stride]);
    let centroid = &scratch.centroid[..candidates.stride];
    point_rule(surface.isa, distances, &reach, centroid, radius + PAD, &mut scratch.alive, &mut scratch.near);
    if !n.is_multiple_of(GROUP) {
        let used = (1 << (n % GROUP)) - 1;
        if let (Some(alive), Some(near)) = (scratch.alive.last_mut(), scratch.near.last_mut()) {
            *alive &= used;
            *near &= used;
        }
    }

    if surface.touching == Touching::Ignored {
        scratch.near.fill(0);
    }

    if n > MANY {
        // Shallow cells are bisected anyway, and rules B and C compare pairs of faces. Every face
        // that may come within the padding of the cell stays.
        let kept = surface.touching == Touching::Kept;
        visit_members(&scratch.alive, &scratch.near, |index, _| {
            let requirement = surface.requirement(candidates.faces[index], Feature::Face);
            filtered.survivors.push(Survivor { index: index as u32, requirement, meets: kept });
        });
        filtered.crossing = kept && filtered.distance <= radius + PAD;
        return filtered;
    }

    let rivals = scratch.rivals.choose(candidates, &scratch.alive);
    PlaneRule::new(surface, cell, candidates, &scratch.centroid, rivals).judge(
        surface.isa,
        &scratch.alive,
        &scratch.near,
        &mut scratch.verdict,
    );
    scratch.meeting.clear();
    visit_members(&scratch.alive, &scratch.near, |index, alive| {
        let face = candidates.faces[index];
        let (low, beaten) = scratch.verdict.of(index);
        let meets = low <= PAD
            && surface.touching == Touching::Kept
            && triangle_meets_tetrahedron(&surface.triangles[face as usize].corners, &cell.corners, PAD);
        filtered.crossing |= meets;
        let feature = if meets { Feature::Face } else { candidates.feature(index) };
        let survivor =
            Survivor { index: index as u32, requirement: surface.requirement(face, feature), meets };
        if alive && !beaten {
            filtered.survivors.push(survivor);
        } else if meets {
            scratch.meeting.push(survivor);
        }
    });
    filtered.chains =
        share_features(surface, cell, candidates, chains, &mut filtered.survivors, &mut scratch.chained);
    filtered.survivors.extend_from_slice(&scratch.meeting);
    filtered
}

dispatch! {
    /// Rule A: sets a bit in `alive` for each candidate that is not farther than one of five points
    /// as seen from all corners. Sets a bit in `near` for each candidate that comes near the
    /// centroid.
    fn point_rule(
        distances: [&[f64]; 4],
        reach: &[[f64; 4]; 5],
        centroid: &[f64],
        radius: f64,
        alive: &mut [u8],
        near: &mut [u8],
    ) = point_rule_lanes
}

#[inline(always)]
fn point_rule_lanes<L: Doubles>(
    distances: [&[f64]; 4],
    reach: &[[f64; 4]; 5],
    centroid: &[f64],
    radius: f64,
    alive: &mut [u8],
    near: &mut [u8],
) {
    for group in 0..alive.len() {
        let (mut dropped, mut close) = (0, 0);
        let mut lane = 0;
        while lane < GROUP {
            let at = group * GROUP + lane;
            let d = [
                L::load(distances[0], at),
                L::load(distances[1], at),
                L::load(distances[2], at),
                L::load(distances[3], at),
            ];
            for r in reach {
                let first = L::both(d[0].at_least(L::splat(r[0])), d[1].at_least(L::splat(r[1])));
                let second = L::both(d[2].at_least(L::splat(r[2])), d[3].at_least(L::splat(r[3])));
                dropped |= L::bits(L::both(first, second)) << lane;
            }
            close |= L::bits(L::splat(radius).at_least(L::load(centroid, at))) << lane;
            lane += L::LANES;
        }
        alive[group] = !dropped;
        near[group] = close;
    }
}

/// Rule C: of the faces of which the whole cell needs one and the same edge or vertex, one face is
/// enough.
///
/// Goes through the survivors in order. A survivor is dropped when another remaining survivor has
/// the part that the cell needs. Of several it takes the last, so that chains stay short.
fn share_features(
    surface: &Surface,
    cell: &Cell,
    candidates: &Candidates,
    chains: Chains,
    survivors: &mut Vec<Survivor>,
    chained: &mut Vec<u32>,
) -> Chains {
    let many = survivors.len() > MAX_SHARING;
    chained.clear();
    chained.resize(survivors.len(), 0);
    let mut heaviest = 0;
    // Faces of a fan often ask for the same vertex one after the other.
    let mut before = None;
    for (i, g) in survivors.iter().enumerate() {
        let part = g.requirement;
        if surface.is_face(part) || (many && surface.faces_of(part).len() <= LARGE_FAN) {
            continue;
        }
        let face = |at: usize| candidates.faces[survivors[at].index as usize];
        let found = before.filter(|&(asked, at)| asked == part && at > i).or_else(|| {
            let holds = |&at: &usize| at != i && chained[at] != DROPPED && surface.holds(face(at), part);
            Some((part, (0..survivors.len()).rev().find(holds)?))
        });
        let Some((_, at)) = found else { continue };
        before = found;
        let Some(link) = link_weight(surface, cell, part, face(i)) else { continue };
        let weight = chained[i] + link;
        if chains.allow(weight) {
            chained[at] = chained[at].max(weight);
            chained[i] = DROPPED;
            heaviest = heaviest.max(weight);
        }
    }
    let mut left = chained.iter().map(|&weight| weight != DROPPED);
    survivors.retain(|_| left.next() == Some(true));
    chains.and(heaviest)
}
