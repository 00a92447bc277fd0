//! Proves, by the certified filter, that a list from elsewhere is exact.
use super::candidates::Candidates;
use super::filter::{Scratch, filter};
use super::requirement_set::RequirementSet;
use super::surface::Surface;
use crate::base::Chains;
use crate::domain::Cell;

/// How many bisections below a cell the proof may make.
const LEVELS: u32 = 12;

/// Proves that `list` is exact in `cell`, where only `candidates` can be closest. Returns the
/// chains of rule C that the proof rests on.
///
/// Returns `None` when the filter asks for a face, edge or vertex that the list does not have. The
/// list can still be exact then.
pub fn holds(
    surface: &Surface,
    cell: &Cell,
    candidates: &[u32],
    list: &[u32],
    scratch: &mut Scratch,
) -> Option<Chains> {
    let mut listed = std::mem::take(&mut scratch.settled);
    listed.start(surface);
    list.iter().for_each(|&face| listed.settle_face(surface, face));
    let mut pool = scratch.pool();
    pool.fill(surface, candidates, cell);
    let proof = descend(surface, *cell, &pool.candidates(), &listed, (LEVELS, Chains::NONE), scratch);
    scratch.give_back(pool);
    scratch.settled = listed;
    proof
}

fn descend(
    surface: &Surface,
    cell: Cell,
    candidates: &Candidates,
    listed: &RequirementSet,
    (levels, chains): (u32, Chains),
    scratch: &mut Scratch,
) -> Option<Chains> {
    let filtered = filter(surface, &cell, candidates, chains, scratch);
    let chains = filtered.chains;
    if filtered.survivors.iter().all(|s| listed.holds(s.requirement)) {
        scratch.reuse(filtered);
        return Some(chains);
    }
    if levels == 0 {
        return None;
    }
    let mut pool = scratch.pool();
    pool.narrow(surface, &cell, candidates, &filtered.survivors);
    scratch.reuse(filtered);
    let mut heaviest = Some(chains);
    for side in 0..2 {
        let below = pool.of_child(candidates, cell.child_corners(side));
        let found = descend(surface, cell.child(side), &below, listed, (levels - 1, chains), scratch);
        heaviest = Chains::of_both(heaviest, found);
    }
    scratch.give_back(pool);
    heaviest
}
