//! Shortens the list of a finished cell to the faces that some point of the cell needs.

use super::candidates::Candidates;
use super::filter::{Scratch, filter};
use super::requirement_set::RequirementSet;
use super::surface::{Requirement, Surface};
use crate::base::Chains;
use crate::domain::Cell;
use crate::geometry::Feature;

/// Entries per face, before tightening, for which all levels are affordable. Meshes of well-shaped
/// faces have about 100, a gear of 20,000 needles has 211.
const ENTRIES_PER_FACE: f64 = 250.0;
/// Faces that are added to the count, so that a small mesh gets enough levels.
const SMALL_MESH: f64 = 1000.0;
/// Factor of the work for each further level, measured from 2 to 12 levels.
const WORK_PER_LEVEL: f64 = 1.28;
/// A list gets three levels fewer each time that it is twice as long as this, because its work
/// grows faster than its length.
const LONG: usize = 512;

/// How many levels the lists get, so that the work stays in proportion to the faces of the mesh.
///
/// With 12 levels, an entry costs some 65 looks at faces. Where needles lie side by side, there are
/// many entries and nearly all of them are needed: tightening removes a tenth of them, and not the
/// half that it removes elsewhere.
#[derive(Clone, Copy, Debug)]
pub struct Levels {
    all: u32,
}

impl Levels {
    /// At most `levels`, for lists that together have `entries` before tightening.
    pub fn new(levels: u32, entries: usize, faces: usize) -> Self {
        let mut affordable = ENTRIES_PER_FACE * (faces as f64 + SMALL_MESH);
        let mut all = levels;
        while all > 1 && entries as f64 > affordable {
            affordable *= WORK_PER_LEVEL;
            all -= 1;
        }
        Self { all }
    }

    /// The levels for one list.
    pub fn of(self, list: &[u32]) -> u32 {
        let doublings = (list.len() / LONG).max(1).ilog2();
        self.all.saturating_sub(3 * doublings).max(self.all.min(1))
    }
}

/// Finds the shortest list that the filter can certify with up to `levels` more bisections.
///
/// The cells of these bisections are not kept: they only tell the faces apart. A requirement is
/// settled when it is closest at some probed point. Bisection goes on only where a survivor is not
/// settled yet, so nearly all of the work is spent on faces in doubt.
///
/// `chains` are those of the filters that left the list. The returned chains are those that the new
/// list rests on.
pub fn tighten(
    surface: &Surface,
    cell: &Cell,
    list: &[u32],
    levels: u32,
    chains: Chains,
    scratch: &mut Scratch,
) -> (Vec<u32>, Chains) {
    let (needed, chains) = needed(surface, cell, list, levels, chains, scratch);
    (surface.cover(&needed), chains)
}

/// The requirements of [`tighten`] before faces are chosen for them, ascending.
pub fn needed(
    surface: &Surface,
    cell: &Cell,
    list: &[u32],
    levels: u32,
    chains: Chains,
    scratch: &mut Scratch,
) -> (Vec<Requirement>, Chains) {
    let mut settled = std::mem::take(&mut scratch.settled);
    settled.start(surface);
    let mut needed = Needed { surface, settled, heaviest: chains };
    let mut pool = scratch.pool();
    pool.fill(surface, list, cell);
    needed.descend(*cell, &pool.candidates(), levels, chains, scratch);
    scratch.give_back(pool);
    let sorted = needed.settled.sorted().to_vec();
    scratch.settled = needed.settled;
    (sorted, needed.heaviest)
}

struct Needed<'a> {
    surface: &'a Surface,
    settled: RequirementSet,
    /// The heaviest chains of rule C on the way down so far.
    heaviest: Chains,
}

impl Needed<'_> {
    fn descend(
        &mut self,
        cell: Cell,
        candidates: &Candidates,
        levels: u32,
        chains: Chains,
        scratch: &mut Scratch,
    ) {
        // No cell below can add a requirement that these faces do not imply.
        if candidates.faces.iter().all(|&face| self.holds_whole(face)) {
            return;
        }
        let surface = self.surface;
        let filtered = filter(surface, &cell, candidates, chains, scratch);
        let chains = filtered.chains;
        self.heaviest = self.heaviest.max(chains);
        for &(index, feature) in &filtered.closest {
            self.settled.settle(surface, surface.requirement(candidates.faces[index as usize], feature));
        }
        let mut open = false;
        for s in &filtered.survivors {
            if s.meets || levels == 0 {
                self.settled.settle(surface, s.requirement);
            }
            open |= !self.settled.holds(s.requirement);
        }
        if open {
            let mut pool = scratch.pool();
            pool.narrow(surface, &cell, candidates, &filtered.survivors);
            scratch.reuse(filtered);
            for side in 0..2 {
                let below = pool.of_child(candidates, cell.child_corners(side));
                self.descend(cell.child(side), &below, levels - 1, chains, scratch);
            }
            scratch.give_back(pool);
        } else {
            scratch.reuse(filtered);
        }
    }

    fn holds_whole(&self, face: u32) -> bool {
        self.settled.holds(self.surface.requirement(face, Feature::Face))
    }
}
