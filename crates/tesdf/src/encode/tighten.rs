//! Shortens the list of a finished cell to what some point of it needs.

use super::filter::{Candidate, Scratch, filter, probe};
use super::surface::{Requirement, Surface};
use crate::domain::Cell;

/// The shortest list that the filter can certify by bisecting up to `levels` deeper.
///
/// The cells of the deeper levels are not kept: they only tell the faces apart. A requirement is
/// settled once some probed point has it closest; bisection goes on only where a survivor is not
/// settled yet, so that nearly all of the work goes to the faces in doubt.
pub fn tighten(surface: &Surface, cell: &Cell, list: &[u32], levels: u32, scratch: &mut Scratch) -> Vec<u32> {
    let candidates = list
        .iter()
        .map(|&face| Candidate { face, at: cell.corners.map(|c| probe(surface, face, c)) })
        .collect();
    let mut needed = Needed { surface, settled: Vec::with_capacity(list.len()) };
    needed.descend(*cell, candidates, levels, scratch);
    needed.settled.sort_unstable();
    surface.cover(&needed.settled)
}

struct Needed<'a> {
    surface: &'a Surface,
    settled: Vec<Requirement>,
}

impl Needed<'_> {
    fn descend(&mut self, cell: Cell, candidates: Vec<Candidate>, levels: u32, scratch: &mut Scratch) {
        let filtered = filter(self.surface, &cell, &candidates, scratch);
        for &(index, feature) in &filtered.closest {
            self.settle(self.surface.requirement(candidates[index as usize].face, feature));
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
        let midpoint = cell.midpoint();
        let alive: Vec<_> = filtered
            .survivors
            .iter()
            .map(|s| &candidates[s.index as usize])
            .map(|g| (g, probe(self.surface, g.face, midpoint)))
            .collect();
        let children = [0, 1].map(|side| {
            let from = cell.child_corners(side);
            let at = |g: &Candidate, m| from.map(|k| if k == 4 { m } else { g.at[k] });
            alive.iter().map(|&(g, m)| Candidate { face: g.face, at: at(g, m) }).collect::<Vec<_>>()
        });
        drop(alive);
        for (side, child) in children.into_iter().enumerate() {
            self.descend(cell.child(side), child, levels - 1, scratch);
        }
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
