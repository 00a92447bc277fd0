//! Minimises the problems of all islands.
use std::collections::BTreeMap;

use glam::DVec3;
use nalgebra::Vector6;
use rayon::prelude::*;

use super::Newton;
use super::geometric::Motion;
use super::integrate::unpack;
use super::islands::{Island, islands};
use super::kept::Known;
use super::line::Placed;
use super::packed::{Packed, SolveIslands};
use super::problem::{Minimisation, Minimum, Problem};
use super::rows::{Gap, Resistance, Row, RowForce, carry, matches};
use super::step::Step;
use crate::{DynamicsError, Residual};

/// Bodies are wild when they are faster than what moves them by the first factor, or by the second
/// one where the solution did not converge. In a chain of joints from 10 kg to 10 g, such a
/// solution gave a link 1,900 rad/s. Later ones of the same step were compared with it and gave
/// 1e147 m/s.
const WILD: [f64; 2] = [10.0, 2.0];

/// Bodies that move by less in a step are not wild, m: rounding moves bodies that nothing moves.
const STILL: f64 = 1e-8;

/// Fewer rows are solved on the calling thread: that a thread of the pool wakes takes as long as some
/// hundred rows.
const ON_ONE_THREAD: usize = 500;

/// What a minimisation starts from.
#[derive(Clone, Copy)]
pub struct Guess<'a> {
    /// Of all free bodies.
    pub velocities: &'a [Vector6<f64>],
    /// What each row does; `None` where nothing is known.
    pub forces: Option<&'a [RowForce]>,
    /// What is kept of the last step, where it may be the solution.
    pub known: Option<&'a Known<'a>>,
}

impl Guess<'_> {
    /// The guess for an island, where it is known to be the solution: its bodies rest, and its rows
    /// are as before; or its problem is that of the last step.
    fn solved(&self, step: &Step, island: &Island, rows: &[Row], gap: Gap) -> Option<Minimum> {
        let known = self.known.and_then(|known| known.solution(step, island, rows, gap));
        if let Some((velocity, forces)) = known {
            return Some(Minimum::known(velocity, forces));
        }
        let mut of_island = island.rows.iter().map(|&k| &rows[k]);
        let is_solved = match gap {
            Gap::Position => island.bodies.iter().all(|&k| step.resting[k]),
            // The minimisation before was of the same problem, if no row parted bodies in it.
            Gap::Relaxed => {
                of_island.all(|row| row.relaxed_gap == row.gap && row.resistance != Resistance::Parting)
            }
        };
        let forces = self.forces.filter(|_| is_solved)?;
        let velocity = island.bodies.iter().map(|&k| self.velocities[k]).collect();
        Some(Minimum::known(velocity, island.rows.iter().map(|&k| forces[k]).collect()))
    }
}

/// What a minimisation is of.
struct Task<'a> {
    motion: &'a Motion,
    rows: &'a [Row],
    /// Rows that part bodies in place of those that were found, by their numbers.
    parting: BTreeMap<usize, Row>,
    gap: Gap,
    guess: Guess<'a>,
}

/// The problem of an island, and what its search begins with.
struct Posed<'a> {
    problem: Problem<'a>,
    /// Velocities of the bodies of the island.
    start: Vec<Vector6<f64>>,
    /// What each row does; `None` where nothing is known.
    forces: Option<Vec<RowForce>>,
    /// The greatest velocity that a row asks for, m/s or rad/s.
    asked: f64,
}

impl Posed<'_> {
    fn search(&self) -> Minimisation<'_, '_> {
        Minimisation::new(&self.problem, self.start.clone(), self.forces.as_deref())
    }
}

impl Newton {
    /// Minimises the problem of every island from `guess`. A body without rows keeps its target
    /// velocity.
    pub(super) fn solve(
        &self,
        step: &mut Step,
        motion: &Motion,
        rows: &[Row],
        gap: Gap,
        guess: Guess<'_>,
    ) -> Result<(Vec<Vector6<f64>>, Vec<RowForce>), DynamicsError> {
        let islands = islands(step.free.len(), rows);
        let parts =
            |(_, row): &(usize, &Row)| matches!(gap, Gap::Position) && row.resistance == Resistance::Parting;
        let parting = rows.iter().enumerate().filter(parts).map(|(k, row)| (k, row.parting())).collect();
        let task = Task { motion, rows, parting, gap, guess };
        let minima = match self.detector.solver() {
            Some(solver) if rows.len() >= solver.least_rows() => {
                self.minima_by(solver, step, &task, &islands)?
            }
            _ => {
                let minimum = |island: &Island| match guess.solved(step, island, rows, gap) {
                    Some(solved) => solved,
                    None => {
                        let posed = self.pose(step, &task, island);
                        let found = posed.problem.minimise(posed.start.clone(), posed.forces.as_deref());
                        self.tamed(step, island, rows, posed, found)
                    }
                };
                // One thread computes each minimum, and they are collected in order: the bits do
                // not depend on the number of threads.
                match islands.len() > 1 && rows.len() >= ON_ONE_THREAD {
                    true => islands.par_iter().map(minimum).collect::<Vec<_>>(),
                    false => islands.iter().map(minimum).collect(),
                }
            }
        };
        let (mut velocities, mut forces) = (motion.target.clone(), vec![RowForce::default(); rows.len()]);
        let report = &mut step.report;
        report.islands = islands.len();
        let mut slowest = 0;
        for (island, minimum) in islands.iter().zip(minima) {
            island.bodies.iter().zip(minimum.velocity).for_each(|(&k, v)| velocities[k] = v);
            island.rows.iter().zip(minimum.forces).for_each(|(&k, force)| forces[k] = force);
            slowest = slowest.max(minimum.iterations);
            report.converged &= minimum.converged;
            report.residual = report.residual.max(minimum.residual);
        }
        report.iterations += slowest;
        Ok((velocities, forces))
    }

    /// The minima of all islands, whose rounds `solver` solves together.
    fn minima_by(
        &self,
        solver: &dyn SolveIslands,
        step: &Step,
        task: &Task<'_>,
        islands: &[Island],
    ) -> Result<Vec<Minimum>, DynamicsError> {
        let known = islands.iter().map(|island| task.guess.solved(step, island, task.rows, task.gap));
        let mut minima: Vec<Option<Minimum>> = known.collect();
        let pose = |(island, known): (&Island, &Option<Minimum>)| match known {
            Some(_) => None,
            None => Some(self.pose(step, task, island)),
        };
        let posed: Vec<Option<Posed<'_>>> = islands.par_iter().zip(&minima).map(pose).collect();
        let open = posed.iter().enumerate().filter_map(|(k, posed)| Some((k, posed.as_ref()?)));
        let mut searches: Vec<_> = open.map(|(k, posed)| (k, posed.search())).collect();
        while !searches.is_empty() {
            let mut packed = Packed::default();
            let add = |(_, search): &(usize, Minimisation<'_, '_>)| {
                packed.add(&search.interior(), search.guess().as_ref())
            };
            let numbers: Vec<Option<usize>> = searches.iter().map(add).collect();
            let is_worth_it = packed.rows >= solver.least_rows().max(1);
            let results = is_worth_it.then(|| solver.solve(&packed)).transpose()?;
            let solution = |(number, (_, search)): (&Option<usize>, &(usize, Minimisation<'_, '_>))| {
                let of_device = results.as_ref().zip(*number);
                let found = of_device.and_then(|(results, number)| packed.solution(number, results));
                found.unwrap_or_else(|| search.interior().solve(search.guess()))
            };
            let solutions: Vec<_> = numbers.par_iter().zip(&searches).map(solution).collect();
            let mut solutions = solutions.into_iter();
            searches.retain_mut(|(k, search)| {
                minima[*k] = solutions.next().and_then(|solution| search.next(solution));
                minima[*k].is_none()
            });
        }
        drop(searches);
        let tamed = |((island, posed), minimum): ((&Island, Option<Posed<'_>>), Option<Minimum>)| match posed
        {
            Some(posed) => Some(self.tamed(step, island, task.rows, posed, minimum?)),
            None => minimum,
        };
        Ok(islands.iter().zip(posed).zip(minima).filter_map(tamed).collect())
    }

    /// The problem of an island.
    fn pose<'a>(&self, step: &Step, task: &'a Task<'a>, island: &Island) -> Posed<'a> {
        let Task { motion, rows, parting, gap, guess } = task;
        // Every free body of an island's rows is in `island.bodies`, which is sorted.
        let place = |body: usize| island.bodies.partition_point(|b| *b < body);
        let placed = |&k: &usize| {
            let row = &rows[k];
            let gap = match gap {
                Gap::Position => row.gap,
                Gap::Relaxed => row.relaxed_gap,
            };
            let bodies = row.sides.map(|side| side.map(|(body, _)| place(body)));
            let coupled = row.coupled.iter().map(|(body, _)| place(*body)).collect();
            Placed { row: parting.get(&k).unwrap_or(row), bodies, coupled, gap, resistance: row.resistance }
        };
        let of = |values: &[Vector6<f64>]| island.bodies.iter().map(|&k| values[k]).collect::<Vec<_>>();
        let inertia: Vec<_> = island.bodies.iter().map(|&k| motion.inertia[k]).collect();
        let placed: Vec<_> = island.rows.iter().map(placed).collect();
        let of_rows = |forces: &[RowForce]| island.rows.iter().map(|&k| forces[k]).collect::<Vec<_>>();
        let (start, forces) = (of(guess.velocities), guess.forces.map(of_rows));
        // Where nothing touched before, nothing is known.
        let forces = forces.filter(|forces| forces.iter().any(|force| force.along != 0.0));
        // An open contact asks for nothing.
        let asks = |placed: &Placed<'_>| if placed.row.is_contact() { -placed.gap } else { placed.gap.abs() };
        let asked = placed.iter().map(|placed| asks(placed) / step.h).fold(0.0, f64::max);
        Posed { problem: Problem::new(inertia, of(&motion.target), placed, step.h), start, forces, asked }
    }

    /// The minimum that was found; where its bodies are wild, that of soft contacts.
    fn tamed(
        &self,
        step: &Step,
        island: &Island,
        rows: &[Row],
        Posed { problem, start, asked, .. }: Posed<'_>,
        found: Minimum,
    ) -> Minimum {
        if !self.is_wild(step, island, rows, asked, problem.target(), &found) {
            return found;
        }
        let soft = problem.softened();
        let minimum = soft.minimise(start, None);
        let way = minimum.residual.way.max(soft.closed(&minimum.velocity));
        Minimum { converged: false, residual: Residual { way, ..minimum.residual }, ..minimum }
    }

    /// Whether bodies are much faster than anything asks them to be: what moves them, at the
    /// beginning of the step and without rows (`target`), or what rows ask for, m/s or rad/s, also
    /// through the ratios of couplings. An earlier solution of the step may be wild itself.
    ///
    /// Rigid contacts of wild bodies contradict each other: a box between a plane and a press that
    /// were 0.16 mm too near for it left sideways at 2 km/s, because its two sides were touched
    /// along directions that differed by 70 µrad.
    fn is_wild(
        &self,
        step: &Step,
        island: &Island,
        rows: &[Row],
        asked: f64,
        target: &[Vector6<f64>],
        found: &Minimum,
    ) -> bool {
        let sizes = || island.bodies.iter().map(|&k| self.sizes[step.free[k].body]);
        let speed = |linear: DVec3, angular: DVec3, size: f64| linear.length() + size * angular.length();
        let fastest = |velocities: &[Vector6<f64>]| {
            let speeds = velocities.iter().map(unpack).zip(sizes()).map(|((v, w), size)| speed(v, w, size));
            speeds.fold(0.0, f64::max)
        };
        let states = island.bodies.iter().map(|&k| &self.system.states()[step.free[k].body]);
        let before = states.zip(sizes()).map(|(state, size)| speed(state.linear, state.angular, size));
        let asked = asked * sizes().fold(1.0, f64::max);
        let known = asked + before.fold(fastest(target), f64::max);
        let gain: f64 = island.rows.iter().map(|&k| self.gain(step, &rows[k])).product();
        let [sure, unsure] = WILD;
        let factor = if found.converged { sure } else { unsure };
        fastest(&found.velocity) > STILL / step.h + factor * gain * known
    }

    /// How much faster one body of a coupling is than another one; 1 for other rows.
    fn gain(&self, step: &Step, row: &Row) -> f64 {
        let rate = |(free, j): &(usize, Vector6<f64>)| {
            let (linear, angular) = unpack(j);
            linear.length() + angular.length() / self.sizes[step.free[*free].body]
        };
        let rates = || row.coupled.iter().map(rate);
        match row.coupled.is_empty() {
            true => 1.0,
            false => rates().fold(0.0, f64::max) / rates().fold(f64::INFINITY, f64::min),
        }
    }
}

/// The forces of the rows `before` for `rows`.
pub fn carry_rows(before: &[Row], forces: &[RowForce], rows: &[Row]) -> Vec<RowForce> {
    carry(&matches(before.iter().map(|row| row.id), rows), forces)
}

/// A minimisation that starts from the last one.
pub fn from_last<'a>(velocities: &'a [Vector6<f64>], forces: &'a [RowForce]) -> Guess<'a> {
    Guess { velocities, forces: Some(forces), known: None }
}
