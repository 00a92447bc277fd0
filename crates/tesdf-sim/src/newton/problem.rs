//! The convex problem of one island, and Newton's method that minimises it.
use nalgebra::Vector6;

use super::NewtonOptions;
use super::linear::{BlockMatrix, Pattern, dot};
use super::rows::{FreeBody, Row};

/// The function `½ |v − target|²_M + Σ ½ K min(0, gap + h J v)²` of the velocities `v`.
#[derive(Debug)]
pub struct Problem<'a> {
    bodies: Vec<&'a FreeBody>,
    target: Vec<Vector6<f64>>,
    rows: Vec<Spring>,
    pattern: Pattern,
    time_step: f64,
}

/// A row whose bodies are indices within the island.
#[derive(Clone, Debug)]
struct Spring {
    sides: [Option<(usize, Vector6<f64>)>; 2],
    pair: Option<usize>,
    gap: f64,
    stiffness: f64,
}

/// Result of a minimisation.
#[derive(Clone, Debug)]
pub struct Minimum {
    /// Velocities of the bodies of the island.
    pub velocity: Vec<Vector6<f64>>,
    /// Number of Newton iterations.
    pub iterations: u32,
    /// Whether the minimisation reached the tolerance.
    pub converged: bool,
}

/// Maximum number of evaluations of a line search. The derivative is piecewise linear, so its root
/// is usually found after a few.
const LINE_SEARCH: usize = 60;

impl<'a> Problem<'a> {
    /// `target` has one velocity per body, in the order of `bodies`. Each row comes with its gap,
    /// m, and refers to bodies by their index in `bodies`.
    pub fn new(
        bodies: Vec<&'a FreeBody>,
        target: Vec<Vector6<f64>>,
        rows: impl Iterator<Item = (Row, f64)>,
        time_step: f64,
    ) -> Self {
        let mut rows: Vec<Spring> = rows
            .map(|(row, gap)| Spring { sides: row.sides, pair: None, gap, stiffness: row.stiffness })
            .collect();
        let pair = |row: &Spring| match row.sides {
            [Some((a, _)), Some((b, _))] => Some((a.min(b), a.max(b))),
            _ => None,
        };
        let mut pairs: Vec<_> = rows.iter().filter_map(pair).collect();
        pairs.sort_unstable();
        pairs.dedup();
        for row in &mut rows {
            row.pair = pair(row).and_then(|p| pairs.binary_search(&p).ok());
        }
        Self { bodies, target, rows, pattern: Pattern { pairs }, time_step }
    }

    /// Minimises by Newton's method from `start`, with an exact line search.
    pub fn minimise(&self, start: Vec<Vector6<f64>>, options: &NewtonOptions) -> Minimum {
        let h = self.time_step;
        let mut velocity = start;
        let mut gaps: Vec<f64> = self.rows.iter().map(|row| row.gap + h * row.rate(&velocity)).collect();
        let goal = options.tolerance * options.tolerance * self.energy();
        for iteration in 1..=options.max_iterations {
            let force = self.force(&velocity, &gaps);
            let Some(direction) = self.direction(&gaps, &force, options) else {
                return Minimum { velocity, iterations: iteration, converged: false };
            };
            // This is twice the decrease that a quadratic function would have.
            if dot(&force, &direction) <= goal {
                return Minimum { velocity, iterations: iteration, converged: true };
            }
            let rates: Vec<f64> = self.rows.iter().map(|row| h * row.rate(&direction)).collect();
            let step = self.line_search(&velocity, &direction, &gaps, &rates);
            velocity.iter_mut().zip(&direction).for_each(|(v, d)| *v += step * d);
            let mut same = step == 1.0;
            for (gap, rate) in gaps.iter_mut().zip(&rates) {
                let before = *gap < 0.0;
                *gap += step * rate;
                same &= before == (*gap < 0.0);
            }
            if same && self.bodies.len() <= options.dense_bodies {
                // All springs kept their state, so the function is quadratic along the step and
                // this is its minimum.
                return Minimum { velocity, iterations: iteration, converged: true };
            }
        }
        Minimum { velocity, iterations: options.max_iterations, converged: false }
    }

    /// The energy that the tolerance is relative to: twice the kinetic energy of the motion without
    /// contacts, plus twice the energy of the springs that this motion would compress.
    fn energy(&self) -> f64 {
        let springs = self
            .rows
            .iter()
            .map(|row| row.stiffness * (row.gap + self.time_step * row.rate(&self.target)).min(0.0).powi(2));
        let motion = self.bodies.iter().zip(&self.target).map(|(body, v)| v.dot(&(body.inertia * v)));
        motion.sum::<f64>() + springs.sum::<f64>()
    }

    /// The negative gradient.
    fn force(&self, velocity: &[Vector6<f64>], gaps: &[f64]) -> Vec<Vector6<f64>> {
        let of_body =
            |((body, v), target): ((&&FreeBody, &Vector6<f64>), &Vector6<f64>)| body.inertia * (target - v);
        let mut force: Vec<_> = self.bodies.iter().zip(velocity).zip(&self.target).map(of_body).collect();
        for (row, &gap) in self.rows.iter().zip(gaps).filter(|&(_, &gap)| gap < 0.0) {
            let push = -row.stiffness * gap * self.time_step;
            row.sides.iter().flatten().for_each(|(body, j)| force[*body].axpy(push, j, 1.0));
        }
        force
    }

    fn direction(
        &self,
        gaps: &[f64],
        force: &[Vector6<f64>],
        options: &NewtonOptions,
    ) -> Option<Vec<Vector6<f64>>> {
        let mut hessian =
            BlockMatrix::new(&self.pattern, self.bodies.iter().map(|body| body.inertia).collect());
        let h2 = self.time_step * self.time_step;
        for (row, _) in self.rows.iter().zip(gaps).filter(|&(_, &gap)| gap < 0.0) {
            hessian.add(&row.sides, row.pair, row.stiffness * h2);
        }
        match self.bodies.len() <= options.dense_bodies {
            true => hessian.solve_dense(force),
            false => hessian.solve_iterative(force),
        }
    }

    /// The step length along `direction` at which the derivative is zero. The derivative increases
    /// and is piecewise linear.
    fn line_search(
        &self,
        velocity: &[Vector6<f64>],
        direction: &[Vector6<f64>],
        gaps: &[f64],
        rates: &[f64],
    ) -> f64 {
        let (mut constant, mut linear) = (0.0, 0.0);
        for (((body, v), target), d) in self.bodies.iter().zip(velocity).zip(&self.target).zip(direction) {
            let momentum = body.inertia * d;
            constant += momentum.dot(&(v - target));
            linear += momentum.dot(d);
        }
        let derivative = |step: f64| {
            let (mut value, mut slope) = (constant + step * linear, linear);
            for ((row, gap), rate) in self.rows.iter().zip(gaps).zip(rates) {
                let gap = gap + step * rate;
                if gap < 0.0 {
                    value += row.stiffness * gap * rate;
                    slope += row.stiffness * rate * rate;
                }
            }
            (value, slope)
        };
        let start = derivative(0.0).0;
        let (mut low, mut high) = (0.0, f64::INFINITY);
        let mut step = 1.0;
        for _ in 0..LINE_SEARCH {
            let (value, slope) = derivative(step);
            if value.abs() <= 1e-10 * start.abs() {
                break;
            }
            if value < 0.0 {
                low = step
            } else {
                high = step
            }
            let next = step - value / slope;
            step = match next > low && next < high {
                true => next,
                false if high.is_finite() => 0.5 * (low + high),
                false => 2.0 * step,
            };
        }
        step
    }
}

impl Spring {
    #[inline]
    fn rate(&self, velocity: &[Vector6<f64>]) -> f64 {
        self.sides.iter().flatten().map(|(body, j)| j.dot(&velocity[*body])).sum()
    }
}

#[cfg(test)]
mod tests {
    use glam::{DMat3, DVec3};
    use tesdf::collide::Pose;

    use super::*;
    use crate::{MassProperties, State};

    /// A chain of bodies with random rows; some rows connect a body to a fixed body.
    fn random_problem(free: &[FreeBody], h: f64, seed: u64) -> Problem<'_> {
        let random = &mut fastrand::Rng::with_seed(seed);
        let mut number = || random.f64() - 0.5;
        let mut vector = || Vector6::from_fn(|_, _| number());
        let target = free.iter().map(|_| vector()).collect();
        let mut rows = Vec::new();
        for k in 0..60 * free.len() {
            let (a, b) = (k % free.len(), (k + 1) % free.len());
            let other = (k % 3 > 0 && a != b).then(|| (b, vector()));
            let gap = 0.1 * h * vector()[0];
            let row =
                Row { sides: [Some((a, vector())), other], gap, relaxed_gap: gap, stiffness: 30.0 / (h * h) };
            rows.push((row, gap));
        }
        Problem::new(free.iter().collect(), target, rows.into_iter(), h)
    }

    #[test]
    fn the_gradient_vanishes_at_the_minimum_dense_and_iterative() {
        let mass = MassProperties {
            mass: 2.0,
            center: DVec3::ZERO,
            inertia: DMat3::from_diagonal(DVec3::new(0.1, 0.2, 0.3)),
        };
        let free: Vec<_> = (0..5).map(|k| FreeBody::new(k, &mass, &State::at_rest(Pose::IDENTITY))).collect();
        for seed in 0..20 {
            let problem = random_problem(&free, 1e-3, seed);
            for dense_bodies in [0, 12] {
                let options = NewtonOptions { dense_bodies, ..NewtonOptions::default() };
                let found = problem.minimise(problem.target.clone(), &options);
                assert!(found.converged, "seed {seed}: {found:?}");
                let gaps: Vec<f64> =
                    problem.rows.iter().map(|row| row.gap + 1e-3 * row.rate(&found.velocity)).collect();
                let force = problem.force(&found.velocity, &gaps);
                let size: f64 = problem.energy().sqrt();
                let left = dot(&force, &force).sqrt();
                assert!(left < 1e-5 * size, "seed {seed}, dense up to {dense_bodies}: {left:e} of {size:e}");
            }
        }
    }
}
