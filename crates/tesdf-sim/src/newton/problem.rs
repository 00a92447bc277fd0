//! The convex problem of one island, and Newton's method that minimises it.
//!
//! A spring gives way under load. Where the corners of a face have different numbers of springs, it
//! gives way unevenly, and a body at rest tilts and slides off. So the forces are raised by the
//! method of multipliers (Hestenes, *Multiplier and gradient methods*, 1969; Powell, *A method for
//! nonlinear constraints in minimization problems*, 1969), until no contact gives way: each spring
//! gets a compression that it keeps without giving way, the compression of the minimum before.
use std::borrow::Borrow;

use nalgebra::{Matrix6, Vector6};

use super::NewtonOptions;
use super::linear::{BlockMatrix, Pattern, dot};
use super::rows::Row;
use super::spring::{Change, Deflection, Grips, Spring};

/// The function `½ |v − target|²_M + Σ energy of the springs` of the velocities `v`.
#[derive(Debug)]
pub struct Problem {
    inertia: Vec<Matrix6<f64>>,
    target: Vec<Vector6<f64>>,
    springs: Vec<Spring>,
    pattern: Pattern,
    time_step: f64,
}

/// Result of a minimisation.
#[derive(Clone, Debug)]
pub struct Minimum {
    /// Velocities of the bodies of the island.
    pub velocity: Vec<Vector6<f64>>,
    /// The force of each row along its sides, N or N m.
    pub forces: Vec<f64>,
    /// Number of Newton iterations.
    pub iterations: u32,
    /// Whether every minimisation reached the tolerance, and the limits of friction have settled.
    pub converged: bool,
}

/// The state of a minimisation.
#[derive(Clone, Debug)]
struct Iterate {
    velocity: Vec<Vector6<f64>>,
    /// One for each spring.
    deflections: Vec<Deflection>,
    /// Multiplies the stiffness of rigid rows.
    stiffening: f64,
    /// Whether the limits of friction follow the pushes of the contacts. Once they have settled
    /// they stay: rounding moves the pushes of contacts that share a load, the more the stiffer
    /// they are.
    grips: Grips,
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

/// Maximum number of further times where contacts have friction, until its limits have settled.
const ROUNDS_OF_FRICTION: u32 = 16;

/// Springs do not become stiffer than this factor. More would leave no digits to the masses.
const STIFFEST: f64 = 1e8;

/// The same while the limits of friction follow: the stiffer the springs, the more the pushes of
/// contacts that share a load differ from one minimisation to the next. At 1e4 the limits of a
/// gripper that closes around a brick went on changing by 2 %.
const STIFFEST_UNSETTLED: f64 = 1e3;

/// The limits of friction have settled when their changes are less than this share of them.
const LAG: f64 = 3e-3;

/// Limits of friction below this share of the forces that would stop the bodies do not matter.
const NO_LIMIT: f64 = 1e-6;

/// A stalled motor may exceed its target by this multiple of the greatest way by which other rows
/// give way: in the first minimisations, all bodies between two fingers give way under their
/// pushes.
const EXCESS: f64 = 100.0;

/// A contact is nearly closed when its gap is at most this share of the way by which it differs
/// between the velocities of the start and those without contacts.
const NEAR: f64 = 0.1;

/// Maximum number of evaluations of a line search. The derivative is piecewise linear without
/// friction, so its root is usually found after a few.
const LINE_SEARCH: usize = 60;

impl Problem {
    /// `target` has one velocity per body, in the order of `bodies`. Each row comes with its gap,
    /// and refers to bodies by their index in `bodies`.
    pub fn new(
        inertia: Vec<Matrix6<f64>>,
        target: Vec<Vector6<f64>>,
        rows: impl Iterator<Item = (impl Borrow<Row>, f64)>,
        time_step: f64,
    ) -> Self {
        let mut springs: Vec<Spring> = rows.map(|(row, gap)| Spring::new(row.borrow(), gap)).collect();
        let pair = |spring: &Spring| match spring.sides {
            [Some((a, _)), Some((b, _))] => Some((a.min(b), a.max(b))),
            _ => None,
        };
        let pattern = Pattern::new(inertia.len(), springs.iter().filter_map(pair).collect());
        for spring in &mut springs {
            spring.pair = pair(spring).and_then(|(a, b)| pattern.pair(a, b));
        }
        Self { inertia, target, springs, pattern, time_step }
    }

    /// Minimises from `start`. Where rows are rigid or have friction, raises their forces and
    /// minimises again, until no rigid row gives way and the limits of friction have settled.
    ///
    /// Most contacts stay open, so the minimisation begins with those that are nearly closed. It is
    /// repeated with the others that its solution closes, until there are none. Contacts may give
    /// way by the tolerance, so others that are closed by less do not need a repetition: in a wall
    /// of bricks, where hundreds are open by rounding alone, each repetition closed a few more.
    pub fn minimise(&self, start: Vec<Vector6<f64>>, options: &NewtonOptions) -> Minimum {
        let h = self.time_step;
        let gap = |spring: &Spring, v: &[Vector6<f64>]| spring.gap + h * spring.rate(v);
        let is_near = |spring: &Spring| {
            let [now, free] = [gap(spring, &start), gap(spring, &self.target)];
            !spring.is_contact() || now <= NEAR * (now - free).abs()
        };
        let mut near: Vec<bool> = self.springs.iter().map(is_near).collect();
        let (mut velocity, mut iterations) = (start, 0);
        loop {
            let springs = self.springs.iter().zip(&near).filter_map(|(spring, near)| near.then_some(spring));
            let part = Part { problem: self, springs: springs.collect() };
            // The forces are found anew, so that they do not depend on the contacts before.
            let mut at = part.start(velocity);
            let (more, converged, slack) = part.raise_forces(&mut at, options);
            iterations += more;
            velocity = std::mem::take(&mut at.velocity);
            let mut is_complete = true;
            for (near, spring) in near.iter_mut().zip(&self.springs).filter(|(near, _)| !**near) {
                let gap = gap(spring, &velocity);
                *near = gap < slack;
                is_complete &= gap >= -slack;
            }
            if is_complete {
                let mut acting = part.forces(&at).into_iter();
                let forces = near.iter().map(|near| if *near { acting.next().unwrap_or(0.0) } else { 0.0 });
                return Minimum { velocity, forces: forces.collect(), iterations, converged };
            }
        }
    }
}

/// The problem with some of its springs.
struct Part<'a> {
    problem: &'a Problem,
    springs: Vec<&'a Spring>,
}

impl Part<'_> {
    fn start(&self, velocity: Vec<Vector6<f64>>) -> Iterate {
        let deflections = self.springs.iter().map(|s| s.start(&velocity, self.problem.time_step)).collect();
        let has_friction = self.springs.iter().any(|s| s.friction.is_some());
        let grips = if has_friction { Grips::Follow } else { Grips::Stay };
        Iterate { velocity, deflections, stiffening: 1.0, grips }
    }

    /// The force of each row along its sides, N or N m.
    fn forces(&self, at: &Iterate) -> Vec<f64> {
        self.springs.iter().zip(&at.deflections).map(|(s, d)| s.force(d, at.stiffening).0).collect()
    }

    /// Returns the number of Newton iterations, whether it converged, and the distance by which
    /// rigid rows may give way, m.
    fn raise_forces(&self, at: &mut Iterate, options: &NewtonOptions) -> (u32, bool, f64) {
        let (mut iterations, mut converged) = self.descend(at, options);
        let [_, most] = self.error(at);
        let slack = options.tolerance * most;
        let rounds = match at.grips {
            Grips::Follow => ROUNDS_OF_FRICTION + ROUNDS,
            Grips::Stay => ROUNDS,
        };
        for _ in 0..rounds {
            if self.lag(at) <= LAG {
                at.grips = Grips::Stay;
            }
            let settled = at.grips == Grips::Stay;
            if !converged || settled && self.error(at)[0] <= slack {
                break;
            }
            self.raise(at);
            let (more, good) = self.descend(at, options);
            (iterations, converged) = (iterations + more, good);
        }
        (iterations, converged && (at.grips == Grips::Stay || self.lag(at) <= LAG), slack)
    }

    /// Newton's method with an exact line search. Returns the number of iterations, and whether it
    /// reached the tolerance.
    fn descend(&self, at: &mut Iterate, options: &NewtonOptions) -> (u32, bool) {
        let goal = options.tolerance * options.tolerance * self.energy();
        for iteration in 1..=options.max_iterations {
            let force = self.force(at);
            let Some(direction) = self.direction(at, &force) else { return (iteration, false) };
            let changes: Vec<_> =
                self.springs.iter().map(|s| s.change(&direction, self.problem.time_step)).collect();
            // This is twice the decrease that a quadratic function would have.
            let small = dot(&force, &direction) <= goal;
            let step = if small { 1.0 } else { self.line_search(at, &direction, &changes) };
            at.velocity.iter_mut().zip(&direction).for_each(|(v, d)| *v += step * d);
            let mut is_quadratic = step == 1.0;
            for ((spring, deflection), change) in self.springs.iter().zip(&mut at.deflections).zip(&changes) {
                let after = deflection.after(change, step);
                is_quadratic = is_quadratic && spring.is_linear_between(deflection, &after, at.stiffening);
                *deflection = after;
            }
            // If all springs kept their state, the function is quadratic along the step and this is
            // its minimum.
            if small || is_quadratic {
                return (iteration, true);
            }
        }
        (options.max_iterations, false)
    }

    /// The greatest distance by which a rigid row gives way, or keeps a force that it should not,
    /// and the greatest one that corresponds to a force. The two are m or rad.
    fn error(&self, at: &Iterate) -> [f64; 2] {
        let errors = self.springs.iter().zip(&at.deflections).map(|(s, d)| s.error(d, at.stiffening));
        errors.fold([0.0; 2], |[a, b], [c, d]| [a.max(c), b.max(d)])
    }

    /// The changes of the limits of friction that are due, as a share of these limits. Limits far
    /// below the forces that would stop the bodies in this step are of no account: where two bodies
    /// just come together, rounding makes the push.
    fn lag(&self, at: &Iterate) -> f64 {
        let grips = self.springs.iter().zip(&at.deflections).filter_map(|(s, d)| s.grips(d, at.stiffening));
        let [change, all] = grips.fold([0.0; 2], |[a, b], [next, now]| [a + (next - now).abs(), b + next]);
        let stop = self
            .problem
            .inertia
            .iter()
            .zip(&self.problem.target)
            .map(|(inertia, v)| (inertia * v).fixed_rows::<3>(0).norm());
        let least = NO_LIMIT * stop.sum::<f64>() / self.problem.time_step;
        if change > 0.0 { change / all.max(least) } else { 0.0 }
    }

    /// Gives each rigid row its present force as the force at zero deflection, and stiffens it. A
    /// stalled motor that exceeds its target becomes a row again.
    fn raise(&self, at: &mut Iterate) {
        let stiffest = match at.grips {
            Grips::Follow => STIFFEST_UNSETTLED,
            Grips::Stay => STIFFEST,
        };
        let factor = STIFFENING.min(stiffest / at.stiffening);
        let others = self.springs.iter().zip(&at.deflections).filter(|(_, d)| !d.is_stalled());
        let worst = others.map(|(s, d)| s.error(d, at.stiffening)[0]).fold(0.0, f64::max);
        for (spring, deflection) in self.springs.iter().zip(&mut at.deflections) {
            let exceeds = spring.excess(deflection) > EXCESS * worst;
            spring.keep(deflection, at.stiffening, factor, at.grips);
            if exceeds {
                deflection.release();
            }
        }
        at.stiffening *= factor;
    }

    /// The energy that the tolerance is relative to: twice the kinetic energy of the motion without
    /// contacts, plus twice the energy of the springs that this motion would compress.
    fn energy(&self) -> f64 {
        let energy = |spring: &&Spring| {
            let deflection = spring.deflection(&self.problem.target, self.problem.time_step);
            spring.force(&deflection, 1.0).0 * -deflection.gap
        };
        let motion =
            self.problem.inertia.iter().zip(&self.problem.target).map(|(inertia, v)| v.dot(&(inertia * v)));
        motion.sum::<f64>() + self.springs.iter().map(energy).sum::<f64>()
    }

    /// The negative gradient.
    fn force(&self, at: &Iterate) -> Vec<Vector6<f64>> {
        let of_body =
            |((inertia, v), target): ((&Matrix6<f64>, &Vector6<f64>), &Vector6<f64>)| inertia * (target - v);
        let mut force: Vec<_> =
            self.problem.inertia.iter().zip(&at.velocity).zip(&self.problem.target).map(of_body).collect();
        for (spring, deflection) in self.springs.iter().zip(&at.deflections) {
            spring.push(deflection, at.stiffening, self.problem.time_step, &mut force);
        }
        force
    }

    fn direction(&self, at: &Iterate, force: &[Vector6<f64>]) -> Option<Vec<Vector6<f64>>> {
        let mut hessian = BlockMatrix::new(&self.problem.pattern, self.problem.inertia.clone());
        let h2 = self.problem.time_step * self.problem.time_step;
        for (spring, deflection) in self.springs.iter().zip(&at.deflections) {
            spring.stiffen(deflection, at.stiffening, h2, &mut hessian);
        }
        hessian.solve(force)
    }

    /// The step length along `direction` at which the derivative is zero. The derivative increases.
    fn line_search(&self, at: &Iterate, direction: &[Vector6<f64>], changes: &[Change]) -> f64 {
        let (mut constant, mut linear) = (0.0, 0.0);
        for (((inertia, v), target), d) in
            self.problem.inertia.iter().zip(&at.velocity).zip(&self.problem.target).zip(direction)
        {
            let momentum = inertia * d;
            constant += momentum.dot(&(v - target));
            linear += momentum.dot(d);
        }
        let derivative = |step: f64| {
            let (mut value, mut slope) = (constant + step * linear, linear);
            for ((spring, deflection), change) in self.springs.iter().zip(&at.deflections).zip(changes) {
                let resistance = spring.resist(&deflection.after(change, step), change, at.stiffening);
                value += resistance.0;
                slope += resistance.1;
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

#[cfg(test)]
mod tests {
    use glam::{DMat3, DQuat, DVec3};

    use super::*;
    use crate::MassProperties;
    use crate::newton::rows::{FreeBody, Resistance};

    /// A chain of bodies with random rows; some rows connect a body to a fixed body.
    fn random_problem(free: &[FreeBody], h: f64, seed: u64) -> Problem {
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
            let bounds = [0.0, f64::INFINITY];
            let arms = [DVec3::ZERO; 2];
            let row =
                Row { sides, arms, gap, relaxed_gap: gap, stiffness, bounds, resistance, friction: None };
            rows.push((row, gap));
        }
        Problem::new(free.iter().map(|body| body.inertia).collect(), target, rows.into_iter(), h)
    }

    fn whole<'a>(problem: &'a Problem) -> Part<'a> {
        Part { problem, springs: problem.springs.iter().collect() }
    }

    #[test]
    fn the_gradient_vanishes_at_the_minimum() {
        let mass = MassProperties {
            mass: 2.0,
            center: DVec3::ZERO,
            inertia: DMat3::from_diagonal(DVec3::new(0.1, 0.2, 0.3)),
        };
        let free: Vec<_> = (0..5).map(|k| FreeBody::new(k, &mass, DQuat::IDENTITY)).collect();
        for seed in 0..20 {
            let problem = random_problem(&free, 1e-3, seed);
            let options = NewtonOptions::default();
            let found = problem.minimise(problem.target.clone(), &options);
            assert!(found.converged, "seed {seed}: {found:?}");
            let all = whole(&problem);
            let force = all.force(&all.start(found.velocity));
            let size: f64 = all.energy().sqrt();
            let left = dot(&force, &force).sqrt();
            assert!(left < 1e-5 * size, "seed {seed}: {left:e} of {size:e}");
        }
    }

    /// The conditions of Karush, Kuhn and Tucker: forces and momenta are in balance, no gap is
    /// negative, and there is no force across a gap.
    #[test]
    fn rigid_contacts_do_not_give_way() {
        let mass =
            MassProperties { mass: 2.0, center: DVec3::ZERO, inertia: DMat3::from_diagonal(DVec3::ONE) };
        let free: Vec<_> = (0..5).map(|k| FreeBody::new(k, &mass, DQuat::IDENTITY)).collect();
        for seed in 0..20 {
            let mut problem = random_problem(&free, 1e-3, seed);
            // Without motion no gap is negative, so the rows do not contradict each other.
            problem.springs.iter_mut().for_each(|spring| spring.gap = spring.gap.abs());
            problem.springs.iter_mut().for_each(|spring| spring.resistance = Resistance::Rigid);
            let all = whole(&problem);
            let mut at = all.start(problem.target.clone());
            let (_, converged, _) = all.raise_forces(&mut at, &NewtonOptions::default());
            assert!(converged, "seed {seed}");
            let force = all.force(&at);
            assert!(dot(&force, &force).sqrt() < 1e-6 * all.energy().sqrt(), "seed {seed}: {force:?}");
            let pushing = at.deflections.iter().filter(|d| d.gap < 0.0).count();
            assert!(pushing > 5, "seed {seed}: {pushing} contacts");
            for (spring, d) in problem.springs.iter().zip(&at.deflections) {
                let end = spring.gap + 1e-3 * spring.rate(&at.velocity);
                assert!((end - d.gap - d.compression()).abs() < 1e-15, "seed {seed}: {end:e}");
                assert!(end > -1e-12 && (end < 1e-12 || d.gap >= 0.0), "seed {seed}: {end:e}, {d:?}");
            }
        }
    }
}
