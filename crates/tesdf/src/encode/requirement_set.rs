use super::surface::{Part, Requirement, Surface};
use crate::geometry::Feature;

/// A set of requirements, with the requirements that its faces imply.
#[derive(Debug, Default)]
pub struct RequirementSet {
    list: Vec<Requirement>,
    /// By the index of a requirement, a mark: `round` when it was implied in this round, `round +
    /// 1` when it was settled.
    mark: Vec<u64>,
    round: u64,
}

impl RequirementSet {
    /// Empties the set.
    pub(super) fn start(&mut self, surface: &Surface) {
        self.list.clear();
        self.mark.resize(surface.parts(), 0);
        self.round += 2;
    }

    /// Adds a whole face.
    pub(super) fn settle_face(&mut self, surface: &Surface, face: u32) {
        self.settle(surface, surface.requirement(face, Feature::Face));
    }

    pub(super) fn settle(&mut self, surface: &Surface, requirement: Requirement) {
        if self.mark[requirement.index()] == self.round + 1 {
            return;
        }
        self.mark[requirement.index()] = self.round + 1;
        self.list.push(requirement);
        if let Part::Face(face) = surface.part(requirement) {
            for part in surface.implied(face) {
                let mark = &mut self.mark[part.index()];
                *mark = self.round.max(*mark);
            }
        }
    }

    /// The settled requirements, ascending.
    pub(super) fn sorted(&mut self) -> &[Requirement] {
        self.list.sort_unstable();
        &self.list
    }

    /// Whether the requirement is in the set, or a face that has it.
    pub(super) fn holds(&self, requirement: Requirement) -> bool {
        self.mark[requirement.index()] >= self.round
    }
}
