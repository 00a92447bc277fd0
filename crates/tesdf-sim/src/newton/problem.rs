//! The convex problem of one island, and Newton's method that minimises it.
//!
//! A spring gives way under load. Where the corners of a face have different numbers of springs, it
//! gives way unevenly, and a body at rest tilts and slides off. So the forces are raised by the
//! method of multipliers (Hestenes, *Multiplier and gradient methods*, 1969; Powell, *A method for
//! nonlinear constraints in minimization problems*, 1969), until no contact gives way: each spring
//! gets a compression that it keeps without giving way, the compression of the minimum before.
use nalgebra::Vector6;

use super::NewtonOptions;
use super::linear::{BlockMatrix, Pattern, dot};
use super::rows::{FreeBody, Resistance, Row};

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
    resistance: Resistance,
}

/// Result of a minimisation.
#[derive(Clone, Debug)]
pub struct Minimum {
    /// Velocities of the bodies of the island.
    pub velocity: Vec<Vector6<f64>>,
    /// Number of Newton iterations.
    pub iterations: u32,
    /// Whether every minimisation reached the tolerance.
    pub converged: bool,
}

/// The state of a minimisation.
#[derive(Clone, Debug)]
struct Iterate {
    velocity: Vec<Vector6<f64>>,
    /// For each row: the gap at the end of the step, less `compression`, m.
    gaps: Vec<f64>,
    /// For each row: the compression of its spring when the gap is zero, m.
    compression: Vec<f64>,
    /// Multiplies the stiffness of rigid rows.
    stiffening: f64,
}

/// Every time that the forces are raised, the springs become stiffer by this factor. An error then
/// falls by the stiffness κ of that minimisation, and not always by the first κ. Stiff springs also
/// let go of contacts that are nearly as near as their neighbours: a contact gives up force by its
/// gap in each minimisation.
const STIFFENING: f64 = 10.0;

/// Maximum number of times that forces are raised. At rest 4 to 5 suffice. Contacts that contradict
/// each other never come to an end: a peg in a hole that is too narrow, or, by rounding, two equal
/// faces on each other.
const ROUNDS: u32 = 8;

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
        let spring = |(row, gap): (Row, f64)| {
            let Row { sides, stiffness, resistance, .. } = row;
            Spring { sides, pair: None, gap, stiffness, resistance }
        };
        let mut rows: Vec<Spring> = rows.map(spring).collect();
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

    /// Minimises from `start`. Where rows are rigid, raises their forces and minimises again, until
    /// no rigid row gives way.
    pub fn minimise(&self, start: Vec<Vector6<f64>>, options: &NewtonOptions) -> Minimum {
        let mut at = self.start(start);
        let (iterations, converged) = self.raise_forces(&mut at, options);
        Minimum { velocity: at.velocity, iterations, converged }
    }

    fn start(&self, velocity: Vec<Vector6<f64>>) -> Iterate {
        let gaps = self.rows.iter().map(|row| row.gap + self.time_step * row.rate(&velocity)).collect();
        Iterate { velocity, gaps, compression: vec![0.0; self.rows.len()], stiffening: 1.0 }
    }

    /// Returns the number of Newton iterations, and whether each minimisation reached the tolerance.
    fn raise_forces(&self, at: &mut Iterate, options: &NewtonOptions) -> (u32, bool) {
        let (mut iterations, mut converged) = self.descend(at, options);
        let most = at.gaps.iter().fold(0.0f64, |most, gap| most.max(-gap));
        for _ in 0..ROUNDS {
            if !converged || self.error(at) <= options.tolerance * most {
                break;
            }
            self.raise(at);
            let (more, good) = self.descend(at, options);
            (iterations, converged) = (iterations + more, good);
        }
        (iterations, converged)
    }

    /// Newton's method with an exact line search. Returns the number of iterations, and whether it
    /// reached the tolerance.
    fn descend(&self, at: &mut Iterate, options: &NewtonOptions) -> (u32, bool) {
        let goal = options.tolerance * options.tolerance * self.energy();
        for iteration in 1..=options.max_iterations {
            let force = self.force(at);
            let Some(direction) = self.direction(at, &force, options) else { return (iteration, false) };
            let rates: Vec<f64> = self.rows.iter().map(|row| self.time_step * row.rate(&direction)).collect();
            // This is twice the decrease that a quadratic function would have.
            let small = dot(&force, &direction) <= goal;
            let step = if small { 1.0 } else { self.line_search(at, &direction, &rates) };
            at.velocity.iter_mut().zip(&direction).for_each(|(v, d)| *v += step * d);
            let mut same = step == 1.0;
            for (gap, rate) in at.gaps.iter_mut().zip(&rates) {
                let before = *gap < 0.0;
                *gap += step * rate;
                same &= before == (*gap < 0.0);
            }
            // If all springs kept their state, the function is quadratic along the step and this is
            // its minimum.
            if small || (same && self.bodies.len() <= options.dense_bodies) {
                return (iteration, true);
            }
        }
        (options.max_iterations, false)
    }

    /// The greatest distance by which a rigid row gives way, or keeps a force across a gap, m.
    fn error(&self, at: &Iterate) -> f64 {
        let rows = self.rows.iter().zip(&at.gaps).zip(&at.compression);
        let rigid = rows.filter(|((row, _), _)| row.resistance == Resistance::Rigid);
        rigid.map(|((_, gap), c)| ((-gap).max(0.0) - c).abs()).fold(0.0, f64::max)
    }

    /// Gives each rigid row its present force as the force at gap zero, and stiffens it.
    fn raise(&self, at: &mut Iterate) {
        for ((row, gap), compression) in self.rows.iter().zip(&mut at.gaps).zip(&mut at.compression) {
            if row.resistance == Resistance::Rigid {
                let next = (-*gap).max(0.0) / STIFFENING;
                *gap += *compression - next;
                *compression = next;
            }
        }
        at.stiffening *= STIFFENING;
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
    fn force(&self, at: &Iterate) -> Vec<Vector6<f64>> {
        let of_body =
            |((body, v), target): ((&&FreeBody, &Vector6<f64>), &Vector6<f64>)| body.inertia * (target - v);
        let mut force: Vec<_> = self.bodies.iter().zip(&at.velocity).zip(&self.target).map(of_body).collect();
        for (row, &gap) in self.rows.iter().zip(&at.gaps).filter(|&(_, &gap)| gap < 0.0) {
            let push = -row.stiffness_at(at) * gap * self.time_step;
            row.sides.iter().flatten().for_each(|(body, j)| force[*body].axpy(push, j, 1.0));
        }
        force
    }

    fn direction(
        &self,
        at: &Iterate,
        force: &[Vector6<f64>],
        options: &NewtonOptions,
    ) -> Option<Vec<Vector6<f64>>> {
        let mut hessian =
            BlockMatrix::new(&self.pattern, self.bodies.iter().map(|body| body.inertia).collect());
        let h2 = self.time_step * self.time_step;
        for (row, _) in self.rows.iter().zip(&at.gaps).filter(|&(_, &gap)| gap < 0.0) {
            hessian.add(&row.sides, row.pair, row.stiffness_at(at) * h2);
        }
        match self.bodies.len() <= options.dense_bodies {
            true => hessian.solve_dense(force),
            false => hessian.solve_iterative(force),
        }
    }

    /// The step length along `direction` at which the derivative is zero. The derivative increases
    /// and is piecewise linear.
    fn line_search(&self, at: &Iterate, direction: &[Vector6<f64>], rates: &[f64]) -> f64 {
        let (mut constant, mut linear) = (0.0, 0.0);
        for (((body, v), target), d) in self.bodies.iter().zip(&at.velocity).zip(&self.target).zip(direction)
        {
            let momentum = body.inertia * d;
            constant += momentum.dot(&(v - target));
            linear += momentum.dot(d);
        }
        let derivative = |step: f64| {
            let (mut value, mut slope) = (constant + step * linear, linear);
            for ((row, gap), rate) in self.rows.iter().zip(&at.gaps).zip(rates) {
                let gap = gap + step * rate;
                if gap < 0.0 {
                    value += row.stiffness_at(at) * gap * rate;
                    slope += row.stiffness_at(at) * rate * rate;
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
    fn stiffness_at(&self, at: &Iterate) -> f64 {
        match self.resistance {
            Resistance::Spring => self.stiffness,
            Resistance::Rigid => self.stiffness * at.stiffening,
        }
    }

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
            let sides = [Some((a, vector())), other];
            let (stiffness, resistance) = (30.0 / (h * h), Resistance::Spring);
            let row = Row { sides, gap, relaxed_gap: gap, stiffness, resistance };
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
                let force = problem.force(&problem.start(found.velocity));
                let size: f64 = problem.energy().sqrt();
                let left = dot(&force, &force).sqrt();
                assert!(left < 1e-5 * size, "seed {seed}, dense up to {dense_bodies}: {left:e} of {size:e}");
            }
        }
    }

    /// The conditions of Karush, Kuhn and Tucker: forces and momenta are in balance, no gap is
    /// negative, and there is no force across a gap.
    #[test]
    fn rigid_contacts_do_not_give_way() {
        let mass =
            MassProperties { mass: 2.0, center: DVec3::ZERO, inertia: DMat3::from_diagonal(DVec3::ONE) };
        let free: Vec<_> = (0..5).map(|k| FreeBody::new(k, &mass, &State::at_rest(Pose::IDENTITY))).collect();
        for seed in 0..20 {
            let mut problem = random_problem(&free, 1e-3, seed);
            // Without motion no gap is negative, so the rows do not contradict each other.
            problem.rows.iter_mut().for_each(|row| row.gap = row.gap.abs());
            problem.rows.iter_mut().for_each(|row| row.resistance = Resistance::Rigid);
            let mut at = problem.start(problem.target.clone());
            let (_, converged) = problem.raise_forces(&mut at, &NewtonOptions::default());
            assert!(converged, "seed {seed}");
            let force = problem.force(&at);
            assert!(dot(&force, &force).sqrt() < 1e-6 * problem.energy().sqrt(), "seed {seed}: {force:?}");
            let pushing = at.gaps.iter().filter(|gap| **gap < 0.0).count();
            assert!(pushing > 5, "seed {seed}: {pushing} contacts");
            for ((row, &gap), compression) in problem.rows.iter().zip(&at.gaps).zip(&at.compression) {
                let end = row.gap + 1e-3 * row.rate(&at.velocity);
                assert!((end - gap - compression).abs() < 1e-15, "seed {seed}: {end:e}");
                assert!(end > -1e-12 && (end < 1e-12 || gap >= 0.0), "seed {seed}: {end:e}, {gap:e}");
            }
        }
    }
}
