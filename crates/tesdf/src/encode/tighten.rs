//! Shortens the list of a finished cell to what some point of it needs.

use super::candidates::{Candidates, Pool};
use super::filter::{Scratch, filter};
use super::surface::{Requirement, Surface};
use crate::domain::Cell;

/// The shortest list that the filter can certify by bisecting up to `levels` deeper.
///
/// The cells of the deeper levels are not kept: they only tell the faces apart. A requirement is
/// settled once some probed point has it closest; bisection goes on only where a survivor is not
/// settled yet, so that nearly all of the work goes to the faces in doubt.
pub fn tighten(surface: &Surface, cell: &Cell, list: &[u32], levels: u32, scratch: &mut Scratch) -> Vec<u32> {
    let mut needed = Needed { surface, settled: Vec::with_capacity(list.len()) };
    let mut pool = scratch.pool();
    pool.fill(surface, list, cell);
    needed.descend(*cell, &pool.seen_from([0, 1, 2, 3]), levels, scratch);
    scratch.give_back(pool);
    needed.settled.sort_unstable();
    surface.cover(&needed.settled)
}

struct Needed<'a> {
    surface: &'a Surface,
    settled: Vec<Requirement>,
}

impl Needed<'_> {
    fn descend(&mut self, cell: Cell, candidates: &Candidates, levels: u32, scratch: &mut Scratch) {
        let filtered = filter(self.surface, &cell, candidates, scratch);
        for &(index, feature) in &filtered.closest {
            self.settle(self.surface.requirement(candidates.faces[index as usize], feature));
        }
        let mut open = false;
        for s in &filtered.survivors {
            if s.meets || levels == 0 {
                self.settle(s.requirement);
            }
            open |= !self.is_settled(s.requirement);
        }
        if !open {
            return;
        }
        let mut pool: Pool = scratch.pool();
        pool.narrow(self.surface, &cell, candidates, &filtered.survivors);
        drop(filtered);
        for side in 0..2 {
            let seen = pool.seen_from(cell.child_corners(side));
            self.descend(cell.child(side), &seen, levels - 1, scratch);
        }
        scratch.give_back(pool);
    }

    fn settle(&mut self, requirement: Requirement) {
        if !self.settled.contains(&requirement) {
            self.settled.push(requirement);
        }
    }

    fn is_settled(&self, requirement: Requirement) -> bool {
        self.settled.iter().any(|&s| s == requirement || self.surface.implies(s, requirement))
    }
}
