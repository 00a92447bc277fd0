//! Shortens the list of a finished cell to what some point of it needs.

use super::candidates::Candidates;
use super::filter::{Scratch, filter};
use super::settled::Settled;
use super::surface::Surface;
use crate::base::Chains;
use crate::domain::Cell;
use crate::geometry::Feature;

/// Entries per face, before tightening, that all levels are worth. Meshes of well-shaped faces have about 100, a gear of 20,000 needles 211.
const ENTRIES_PER_FACE: f64 = 250.0;
/// Faces that a small mesh counts as in addition.
const SMALL_MESH: f64 = 1000.0;
/// What a level multiplies the work by: measured from 2 to 12 levels.
const WORK_PER_LEVEL: f64 = 1.28;
/// A list gets three levels less each time that it is twice as long as this, as its own work grows faster than it.
const LONG: usize = 512;

/// How many levels lists are worth, so that the work stays in proportion to the faces of the mesh.
///
/// An entry costs some 65 looks at faces at 12 levels. Where needles lie side by side there are many entries, and nearly all are needed:
/// tightening takes away a tenth, not the half that it takes elsewhere.
#[derive(Clone, Copy, Debug)]
pub struct Levels {
    all: u32,
}

impl Levels {
    /// At most `levels`, for lists that have so many `entries` together before they are tightened.
    pub fn new(levels: u32, entries: usize, faces: usize) -> Self {
        let mut affordable = ENTRIES_PER_FACE * (faces as f64 + SMALL_MESH);
        let mut all = levels;
        while all > 1 && entries as f64 > affordable {
            affordable *= WORK_PER_LEVEL;
            all -= 1;
        }
        Self { all }
    }

    /// For one list.
    pub fn of(self, list: &[u32]) -> u32 {
        let doublings = (list.len() / LONG).max(1).ilog2();
        self.all.saturating_sub(3 * doublings).max(self.all.min(1))
    }
}

/// The shortest list that the filter can certify by bisecting up to `levels` deeper.
///
/// The cells of the deeper levels are not kept: they only tell the faces apart. A requirement is
/// settled once some probed point has it closest; bisection goes on only where a survivor is not
/// settled yet, so that nearly all of the work goes to the faces in doubt.
///
/// `chains` are those of the filters that left the list; what comes back besides it are those that the new list rests on.
pub fn tighten(
    surface: &Surface,
    cell: &Cell,
    list: &[u32],
    levels: u32,
    chains: Chains,
    scratch: &mut Scratch,
) -> (Vec<u32>, Chains) {
    let mut settled = std::mem::take(&mut scratch.settled);
    settled.start(surface);
    let mut needed = Needed { surface, settled, heaviest: chains };
    let mut pool = scratch.pool();
    pool.fill(surface, list, cell);
    needed.descend(*cell, &pool.candidates(), levels, chains, scratch);
    scratch.give_back(pool);
    let tight = surface.cover(needed.settled.sorted());
    scratch.settled = needed.settled;
    (tight, needed.heaviest)
}

struct Needed<'a> {
    surface: &'a Surface,
    settled: Settled,
    /// The heaviest chains of rule C on a way down so far.
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
        // Nothing below can add what these faces do not imply.
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
