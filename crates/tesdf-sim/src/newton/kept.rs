//! What the last step has found, from which the first minimisation of a step begins: bodies that
//! rest or are carried have nearly the same forces in each step. Where the problem of an island is
//! that of the last step, bit for bit, so is its solution.
//!
//! It is no part of the state of a run: every [`FORGETS`] steps a step begins without it. So a
//! run that is continued makes the steps since then again, and gets the same bytes.
use nalgebra::{Matrix6, Vector6};

use super::islands::Island;
use super::rows::{FreeBody, Gap, Row, RowForce, carry, matches};
use super::step::Step;

/// Steps whose number is a multiple of this begin without forces.
pub const FORGETS: u64 = 16;

/// The forces of the last step, and what they solve.
#[derive(Clone, Debug, Default)]
pub struct Kept {
    rows: Vec<Row>,
    /// Of the minimisations that move the poses, and of those that the next step starts from.
    forces: [Vec<RowForce>; 2],
    /// Of the free bodies; empty where the step has not converged.
    bodies: Vec<Solved>,
    /// Duration of the part of the step, and of the whole step, s.
    times: [f64; 2],
    /// Number of steps so far.
    steps: u64,
}

/// What a step has found of a free body.
#[derive(Clone, Debug)]
struct Solved {
    /// Its number in the system.
    body: usize,
    /// Mass and inertia, and the velocity without rows.
    inertia: Matrix6<f64>,
    target: Vector6<f64>,
    /// The velocity at the beginning of the step.
    start: Vector6<f64>,
    /// The velocities that were found, as the forces.
    found: [Vector6<f64>; 2],
    /// Number of its rows.
    rows: usize,
}

/// What is kept of the rows of a step.
pub struct Known<'a> {
    kept: &'a Kept,
    /// The velocities of the free bodies at the beginning of the step.
    start: &'a [Vector6<f64>],
    /// Of each row, the index of its force among those that are kept.
    of_rows: Vec<Option<usize>>,
}

impl Kept {
    /// What is kept of rows with the ids of `rows`, in a step that begins with the velocities
    /// `start`.
    pub fn of<'a>(&'a self, rows: &[Row], start: &'a [Vector6<f64>]) -> Option<Known<'a>> {
        let ids = || self.rows.iter().map(|row| row.id);
        (!self.rows.is_empty()).then(|| Known { kept: self, start, of_rows: matches(ids(), rows) })
    }

    /// Keeps what these rows do in a step, which began with the velocities `start`. Velocities and
    /// forces are those that move the poses, and those that the next step starts from.
    pub fn keep(
        &mut self,
        step: &Step,
        start: &[Vector6<f64>],
        velocities: [&[Vector6<f64>]; 2],
        rows: Vec<Row>,
        forces: [Vec<RowForce>; 2],
    ) {
        (self.rows, self.forces, self.times) = (rows, forces, [step.h, step.whole]);
        self.bodies.clear();
        if step.report.converged {
            let of_body = |(k, free): (usize, &FreeBody)| Solved {
                body: free.body,
                inertia: free.inertia,
                target: step.target[k],
                start: start[k],
                found: velocities.map(|velocities| velocities[k]),
                rows: 0,
            };
            self.bodies.extend(step.free.iter().enumerate().map(of_body));
            for (k, _) in self.rows.iter().flat_map(Row::bodies) {
                self.bodies[*k].rows += 1;
            }
        }
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
        self.rows.clear();
        self.bodies.clear();
    }

    /// At the beginning of a run.
    pub fn restart(&mut self) {
        *self = Self::default();
    }
}

impl Known<'_> {
    /// The forces that the rows had.
    pub fn forces(&self) -> Vec<RowForce> {
        carry(&self.of_rows, &self.kept.forces[Gap::Position as usize])
    }

    /// The velocities of the bodies and the forces of the rows of an island whose problem is that
    /// of the last step.
    pub fn solution(
        &self,
        step: &Step,
        island: &Island,
        rows: &[Row],
        gap: Gap,
    ) -> Option<(Vec<Vector6<f64>>, Vec<RowForce>)> {
        let Kept { rows: kept, forces, bodies, times, .. } = self.kept;
        if *times != [step.h, step.whole] {
            return None;
        }
        let of_body = |&k: &usize| {
            let (free, then) = (&step.free[k], bodies.get(k)?);
            let is_same = then.body == free.body
                && then.start == self.start[k]
                && then.target == step.target[k]
                && then.inertia == free.inertia;
            is_same.then_some(then.found[gap as usize])
        };
        let velocities = island.bodies.iter().map(of_body).collect::<Option<_>>()?;
        let of_row = |&k: &usize| {
            let before = self.of_rows[k]?;
            (kept[before] == rows[k]).then(|| forces[gap as usize][before])
        };
        let forces = island.rows.iter().map(of_row).collect::<Option<_>>()?;
        // No row has gone, either.
        let rows_of_bodies: usize = island.bodies.iter().map(|&k| bodies[k].rows).sum();
        let sides = island.rows.iter().flat_map(|&k| rows[k].bodies());
        (sides.count() == rows_of_bodies).then_some((velocities, forces))
    }
}
