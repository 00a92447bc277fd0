//! The forces of the last step, from which the first minimisation of a step begins: bodies that
//! rest or are carried have nearly the same forces in each step.
//!
//! They are no part of the state of a run: every [`FORGETS`] steps a step begins without them. So a
//! run that is continued makes the steps since then again, and gets the same bytes.
use super::rows::{Row, RowForce, RowId, carry};

/// Steps whose number is a multiple of this begin without forces.
pub const FORGETS: u64 = 16;

/// The forces of the last step.
#[derive(Clone, Debug, Default)]
pub struct Kept {
    ids: Vec<RowId>,
    forces: Vec<RowForce>,
    /// Number of steps so far.
    steps: u64,
}

impl Kept {
    /// Those of rows with the ids of `rows`.
    pub fn of(&self, rows: &[Row]) -> Option<Vec<RowForce>> {
        (!self.ids.is_empty()).then(|| carry(self.ids.iter().copied(), &self.forces, rows))
    }

    /// Keeps what these rows do.
    pub fn keep(&mut self, rows: &[Row], forces: Vec<RowForce>) {
        self.ids.clear();
        self.ids.extend(rows.iter().map(|row| row.id));
        self.forces = forces;
    }

    /// Before a step.
    pub fn begin(&mut self) {
        if self.steps.is_multiple_of(FORGETS) {
            self.forget();
        }
    }

    /// After a step, also one that is recalled.
    pub fn end(&mut self) {
        self.steps += 1;
    }

    /// The forces are not those of the states.
    pub fn forget(&mut self) {
        self.ids.clear();
    }

    /// At the beginning of a run.
    pub fn restart(&mut self) {
        *self = Self::default();
    }
}
