//! An iterate of the interior point method, and the iterations to the solution.
use nalgebra::Vector6;
use tesdf::base::elementary;

use super::constants::{
    CLOSED, Effort, FEW, FINE, FIRST, FREEZE, LEAST_CENTRING, LENGTHENS, LONG, PROXIMAL, SHORT, SHORTER,
    WIDTHS,
};
use super::state::{State, bounded};
use super::sum::Sum;
use super::{Interior, Limits, Solution};
use crate::Residual;
use crate::newton::lanes::{Lanes, WIDTH, two};
use crate::newton::line::{Bundle, Forces, Slips, dot};
use crate::newton::linear::{BlockMatrix, Factor};

/// What an iteration knows of a bundle.
#[derive(Clone, Copy, Debug, Default)]
struct Local {
    /// Gap and force that do not fit.
    residual: Lanes,
    /// The decrease of the force with the gap.
    stiffness: Lanes,
    slip: Slipping,
}

/// What an iteration knows of a friction.
#[derive(Clone, Copy, Debug, Default)]
struct Slipping {
    /// u
    slip: [Lanes; 2],
    /// b
    limit: Lanes,
    /// a
    width: Lanes,
    /// r
    length: Lanes,
    /// u / r
    along: [Lanes; 2],
    /// −λ / b, at most 1.
    share: [Lanes; 2],
    /// The decrease of the friction with the slip: xx, xy, yy.
    stiffness: [Lanes; 3],
    /// The least a.
    least: Lanes,
}

/// The changes of push and friction when the velocities stay.
#[derive(Clone, Copy, Debug, Default)]
struct Standing {
    push: Lanes,
    friction: [Lanes; 2],
}

/// The change of a bundle.
#[derive(Clone, Copy, Debug, Default)]
struct Change {
    force: Lanes,
    slack: [Lanes; 2],
    /// The friction after a whole step, not its change.
    friction: [Lanes; 2],
}

/// A change of all unknowns.
#[derive(Default)]
struct Direction {
    velocity: Vec<Vector6<f64>>,
    rows: Vec<Change>,
    /// The greatest step at which all rooms and slacks are positive.
    longest: f64,
}

/// The step at which values become zero.
#[inline(always)]
fn to_zero(value: Lanes, change: Lanes) -> Lanes {
    value.zip(change, |value, change| if change < 0.0 { -value / change } else { f64::INFINITY })
}

/// An iterate.
pub struct Iterate<'a> {
    of: &'a Interior<'a>,
    velocity: Vec<Vector6<f64>>,
    states: Vec<State>,
    /// ν of friction.
    centre: f64,
    /// Number of factorisations so far.
    iterations: u32,
    /// Number of bounds.
    bounds: usize,
    /// ν at the end.
    least: f64,
    /// What the iteration knows of the bundles, ...
    locals: Vec<Local>,
    standing: Vec<Standing>,
    /// ... and what it aims at: for each bound of each row, the change of room × slack.
    aims: Vec<[Lanes; 2]>,
}

impl<'a> Iterate<'a> {
    /// From velocities and forces that are nearly right.
    pub fn from(of: &'a Interior<'a>, velocity: Vec<Vector6<f64>>, forces: &[Forces], centre: f64) -> Self {
        let state = |(k, bundle, relative): (usize, &Bundle, [f64; 6])| {
            State::new(bundle, &relative, centre, &forces[k])
        };
        let states: Vec<_> = of.bundles(&velocity).map(state).collect();
        let (bounds, least, count) = (of.count_bounds(), of.least(), states.len());
        Self {
            of,
            velocity,
            states,
            centre,
            iterations: 0,
            bounds,
            least,
            locals: Vec::with_capacity(count),
            standing: Vec::with_capacity(count),
            aims: Vec::with_capacity(count),
        }
    }

    /// From the velocities that the springs of all rows would lead to.
    pub fn cold(of: &'a Interior<'a>) -> Self {
        let centre = f64::max(elementary::powi(FIRST * of.greatest_violation(), 2), of.least());
        let none = vec![Forces::default(); of.lines.bundles.len()];
        let mut matrix = BlockMatrix::symmetric(of.pattern, of.bodies.inertia.to_vec());
        let mut momentum: Vec<_> =
            of.bodies.inertia.iter().zip(&of.bodies.target).map(|(m, v)| m * v).collect();
        for batch in &of.lines.batches {
            let group = &of.lines.groups[batch.group];
            let (mut sum, mut acting) = (Sum::default(), [Lanes::ZERO; 6]);
            for bundle in &of.lines.bundles[batch.bundles.clone()] {
                let mut k = Lanes::splat(1.0);
                for lane in (0..WIDTH).filter(|&lane| bundle.count_bounds(lane) == 0) {
                    k.0[lane] = 1.0 / bundle.compliance.0[lane].max(PROXIMAL);
                }
                let way = bundle.slip.as_ref().map_or([Lanes::ZERO; 2], |slip| slip.way.map(|way| -way));
                bundle.act(-(k * bundle.gap), way, &mut acting);
                let [zero, one] = [0.0, 1.0].map(Lanes::splat);
                sum.add(bundle, k, (&bundle.normal, [zero; 2]), [one, zero, one]);
            }
            group.act(acting.map(Lanes::sum), &mut momentum);
            matrix.add(group, &sum.total(!batch.slips));
        }
        // Joints are stiff, so rounding may make the matrix indefinite.
        let velocity =
            matrix.factor().map_or_else(|| of.bodies.target.to_vec(), |factor| factor.solve(&momentum));
        Self { iterations: 1, ..Self::from(of, velocity, &none, centre) }
    }

    /// The mean of room × slack.
    #[inline(always)]
    fn product(&self) -> f64 {
        let products = self.states.iter().map(State::products);
        let sum = products.fold(Lanes::ZERO, |sum, [a, b]| sum + (a + b));
        sum.sum() / self.bounds.max(1) as f64
    }

    /// What the rows do.
    fn forces(&self) -> Vec<Forces> {
        let lines = self.of.lines;
        let mut all: Vec<Forces> =
            self.states.iter().zip(&lines.bundles).map(|(state, bundle)| state.forces(bundle)).collect();
        for (k, bundle) in lines.bundles.iter().enumerate() {
            if let Some(Slips { torsion: Some(torsion), .. }) = bundle.slip {
                let push = all[torsion.of].push;
                let of_push = |push, friction| if push == 0.0 { 0.0 } else { friction };
                all[k].friction = all[k].friction.map(|friction| push.zip(friction, of_push));
            }
        }
        all
    }

    /// Finds what an iteration has to know. Returns the matrix, the momentum that velocities and
    /// forces leave, and that which the predictor has to bring.
    #[inline(always)]
    fn linearise(
        &mut self,
        limits: &Limits,
        width: f64,
        is_coulomb: bool,
    ) -> (BlockMatrix<'a>, [Vec<Vector6<f64>>; 2]) {
        let lines = self.of.lines;
        let inertia = self.of.bodies.inertia.to_vec();
        let mut matrix = match is_coulomb {
            true => BlockMatrix::general(self.of.pattern, inertia),
            false => BlockMatrix::symmetric(self.of.pattern, inertia),
        };
        let mut momentum = self.of.lack(&self.velocity);
        let mut brought = vec![Vector6::zeros(); momentum.len()];
        // Batches have all bundles in their order.
        self.locals.clear();
        self.standing.clear();
        self.aims.clear();
        for batch in &lines.batches {
            let group = &lines.groups[batch.group];
            let relative = group.of(&self.velocity);
            let (mut sum, mut acting, mut change) = (Sum::default(), [Lanes::ZERO; 6], [Lanes::ZERO; 6]);
            for k in batch.bundles.clone() {
                let of = lines.pushing(k);
                let push = self.states[of].force;
                let (bundle, state) = (&lines.bundles[k], &mut self.states[k]);
                let limit = bundle.slip.as_ref().map_or(Lanes::ZERO, |slip| limits.of(k, slip, push));
                let local = Local::new(bundle, state, &relative, limit, self.centre, width);
                if bundle.slip.is_some() {
                    state.friction = two(|k| -(local.slip.limit * local.slip.share[k]));
                }
                bundle.act(state.force, state.friction, &mut acting);
                let products = state.products();
                let away = two(|k| -products[k]);
                let followed = (of != k).then(|| self.standing[of].push);
                let standing = local.standing(bundle, state, &away, self.least, followed, is_coulomb);
                bundle.act(standing.push, standing.added(state), &mut change);
                let follows = match (&bundle.slip, is_coulomb) {
                    (Some(slip), true) => {
                        let stiffness = if of == k { local.stiffness } else { self.locals[of].stiffness };
                        let follows = -(slip.coefficient * stiffness);
                        two(|k| follows * local.slip.along[k])
                    }
                    _ => [Lanes::ZERO; 2],
                };
                let normal = &lines.bundles[of].normal;
                sum.add(bundle, local.stiffness, (normal, follows), local.slip.stiffness);
                self.locals.push(local);
                self.standing.push(standing);
                self.aims.push(away);
            }
            group.act(acting.map(Lanes::sum), &mut momentum);
            group.act(change.map(Lanes::sum), &mut brought);
            matrix.add(group, &sum.total(!batch.slips));
        }
        brought.iter_mut().zip(&momentum).for_each(|(to, momentum)| *to += momentum);
        (matrix, [momentum, brought])
    }

    /// The change of all unknowns to the aims, for the present `momentum`, where ν of friction is
    /// to become `centre`.
    #[inline(always)]
    fn direction(
        &mut self,
        factor: &Factor<'_>,
        momentum: &[Vector6<f64>],
        centre: f64,
        is_coulomb: bool,
        to: &mut Direction,
    ) {
        let lines = self.of.lines;
        let mut brought = momentum.to_vec();
        for batch in &lines.batches {
            let mut change = [Lanes::ZERO; 6];
            for k in batch.bundles.clone() {
                let (bundle, state) = (&lines.bundles[k], &self.states[k]);
                let of = lines.pushing(k);
                let followed = (of != k).then(|| self.standing[of].push);
                let standing =
                    self.locals[k].standing(bundle, state, &self.aims[k], centre, followed, is_coulomb);
                bundle.act(standing.push, standing.added(state), &mut change);
                self.standing[k] = standing;
            }
            lines.groups[batch.group].act(change.map(Lanes::sum), &mut brought);
        }
        self.follow(factor, &brought, is_coulomb, to);
    }

    /// The change of all unknowns with the momentum `brought`.
    #[inline(always)]
    fn follow(&self, factor: &Factor<'_>, brought: &[Vector6<f64>], is_coulomb: bool, to: &mut Direction) {
        let lines = self.of.lines;
        to.velocity = factor.solve(brought);
        to.rows.clear();
        to.rows.reserve(lines.bundles.len());
        let mut longest = Lanes::splat(f64::INFINITY);
        for batch in &lines.batches {
            let relative = lines.groups[batch.group].of(&to.velocity);
            for k in batch.bundles.clone() {
                let (bundle, local, state) = (&lines.bundles[k], &self.locals[k], &self.states[k]);
                let (standing, products) = (&self.standing[k], &self.aims[k]);
                let yields_at =
                    |k: usize| self.locals[k].stiffness * dot(&lines.bundles[k].normal, &relative);
                let yields = yields_at(k);
                let force = standing.push - yields;
                let slack = [
                    (products[0] - state.slack[0] * force) / state.room[0],
                    (products[1] + state.slack[1] * force) / state.room[1],
                ];
                let mut friction = [Lanes::ZERO; 2];
                if let Some(slip) = &bundle.slip {
                    let ([x, y], [xx, xy, yy]) = (slip.change(&relative), local.slip.stiffness);
                    let [u, v] = local.slip.along;
                    friction = standing.friction;
                    friction[0] -= xx * x + xy * y;
                    friction[1] -= xy * x + yy * y;
                    if is_coulomb {
                        let follows =
                            slip.coefficient * slip.torsion.map_or(yields, |torsion| yields_at(torsion.of));
                        friction[0] += follows * u;
                        friction[1] += follows * v;
                    }
                }
                for (value, change) in [
                    (state.room[0], force),
                    (state.room[1], -force),
                    (state.slack[0], slack[0]),
                    (state.slack[1], slack[1]),
                ] {
                    longest = longest.zip(to_zero(value, change), |a, b| if b < a { b } else { a });
                }
                to.rows.push(Change { force, slack, friction });
            }
        }
        to.longest = longest.least();
    }

    /// The direction of an iteration, how far to go along it, and ν of friction at its end. The
    /// three `directions` are memory.
    #[inline(always)]
    fn next(
        &mut self,
        factor: &Factor<'_>,
        momentum: &[Vector6<f64>],
        brought: &[Vector6<f64>],
        is_coulomb: bool,
        [predictor, corrected, again]: &mut [Direction; 3],
    ) -> (f64, f64) {
        self.follow(factor, brought, is_coulomb, predictor);
        if self.bounds == 0 {
            std::mem::swap(predictor, corrected);
            return (1.0, self.centre);
        }
        let affine = predictor.longest.min(1.0);
        let product = self.product();
        let centring = elementary::powi(1.0 - affine, 3).max(LEAST_CENTRING);
        let centre = (centring * product).max(self.least).min(product.max(self.least));
        for ((aims, change), state) in self.aims.iter_mut().zip(&predictor.rows).zip(&self.states) {
            // They were the products, away from zero.
            let centre = Lanes::splat(centre);
            aims[0] = bounded(state.room[0], centre + aims[0] - change.slack[0] * change.force);
            aims[1] = bounded(state.room[1], centre + aims[1] + change.slack[1] * change.force);
        }
        self.direction(factor, momentum, centre, is_coulomb, corrected);
        if corrected.longest < 1.0 / LENGTHENS {
            let farther = (1.5 * corrected.longest + 0.1).min(1.0);
            for ((aims, state), change) in self.aims.iter_mut().zip(&self.states).zip(&corrected.rows) {
                for (k, force) in [(0, change.force), (1, -change.force)] {
                    let room = state.room[k] + force * farther;
                    let product = room * (state.slack[k] + change.slack[k] * farther);
                    let missing = product.map(|product| {
                        (product.clamp(0.1 * centre, 10.0 * centre) - product).max(-10.0 * centre)
                    });
                    aims[k] += bounded(state.room[k], missing);
                }
            }
            self.direction(factor, momentum, centre, is_coulomb, again);
            if again.longest.min(1.0) >= LENGTHENS * corrected.longest {
                std::mem::swap(corrected, again);
            }
        }
        let shorter = SHORTER * (100.0 * (1.0 - affine)).clamp(1e-4, 1.0);
        (((1.0 - shorter) * corrected.longest).min(1.0), centre)
    }

    /// Goes along a direction. Returns the greatest way that friction would bring beyond its limit,
    /// m.
    #[inline(always)]
    fn advance(&mut self, direction: &Direction, step: f64, limits: &Limits) -> f64 {
        let mut beyond = Lanes::ZERO;
        self.velocity.iter_mut().zip(&direction.velocity).for_each(|(v, change)| *v += step * change);
        for (k, (change, bundle)) in direction.rows.iter().zip(&self.of.lines.bundles).enumerate() {
            let state = &mut self.states[k];
            let force = change.force * step;
            state.force += force;
            state.room[0] += force;
            state.room[1] -= force;
            state.slack[0] += change.slack[0] * step;
            state.slack[1] += change.slack[1] * step;
            let Some(slip) = &bundle.slip else { continue };
            // That which limits torsional friction has gone along before.
            let limit = limits.of(k, slip, self.states[self.of.lines.pushing(k)].force);
            let state = &mut self.states[k];
            let [x, y] = two(|k| state.friction[k] + (change.friction[k] - state.friction[k]) * step);
            let size = (x * x + y * y).sqrt();
            let share = limit.zip(size, |limit, size| if size > limit { limit / size } else { 1.0 });
            state.friction = [x * share, y * share];
            beyond = beyond.max((size - limit) / slip.scale);
        }
        beyond.0.into_iter().fold(0.0, f64::max)
    }

    /// The greatest gap and force that do not fit, m.
    #[inline(always)]
    fn open(&self) -> f64 {
        let of_bundle = |(local, bundle): (&Local, &Bundle)| local.residual.map(f64::abs) / bundle.scale;
        let greatest = self.locals.iter().zip(&self.of.lines.bundles).map(of_bundle);
        greatest.fold(Lanes::ZERO, Lanes::max).0.into_iter().fold(0.0, f64::max)
    }

    /// Iterates to the end.
    pub fn descend(self, limits: Limits, effort: Effort) -> Solution {
        #[cfg(target_arch = "x86_64")]
        if std::arch::is_x86_feature_detected!("avx2") {
            // SAFETY: the processor has AVX2.
            return unsafe { self.descend_with_avx2(limits, effort) };
        }
        self.descend_with_baseline(limits, effort)
    }

    /// The same code, and so the same bits, compiled for vectors of twice the width: an iteration
    /// takes two thirds of the time.
    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2")]
    fn descend_with_avx2(self, limits: Limits, effort: Effort) -> Solution {
        self.descend_with_baseline(limits, effort)
    }

    #[inline(always)]
    fn descend_with_baseline(mut self, mut limits: Limits, effort: Effort) -> Solution {
        let has_friction = self.of.has_friction();
        let [freeze, few] = [self.of.mean_square(FREEZE), FEW * self.least];
        let balanced = self.of.balanced();
        let (mut width, mut short_steps, mut left) = (effort.width, 0, effort.iterations);
        let mut directions = [(); 3].map(|()| Direction::default());
        // The solution with the first width.
        let mut coarse = None;
        while left > 0 && short_steps < effort.short_steps {
            left -= 1;
            if matches!(limits, Limits::Lagged) && self.product() < freeze {
                limits = Limits::Fixed(self.of.limits(&self.forces()));
            }
            let is_coulomb = has_friction && matches!(limits, Limits::Coulomb);
            let (matrix, [momentum, brought]) = self.linearise(&limits, WIDTHS[width], is_coulomb);
            let Some(factor) = matrix.factor() else { break };
            self.iterations += 1;
            let (step, centre) = self.next(&factor, &momentum, &brought, is_coulomb, &mut directions);
            let direction = &directions[1];
            let beyond = self.advance(direction, step, &limits);
            self.centre = (self.centre + step * (centre - self.centre)).max(self.least);
            let way = self.of.way(&direction.velocity);
            if !way.is_finite() {
                break;
            }
            short_steps = if step < SHORT { short_steps + 1 } else { 0 };
            let open = || self.open() * (1.0 - step);
            let is_balanced = || !is_coulomb || self.of.way_of_momentum(&momentum) < balanced;
            if step > LONG
                && way < effort.settled
                && open() < CLOSED
                && is_balanced()
                && beyond < balanced
                && self.product() <= few
            {
                if !has_friction || width + 1 == WIDTHS.len() {
                    return self.solution(&limits, true);
                }
                coarse = Some(self.solution(&limits, true));
                (width, short_steps, left) = (width + 1, 0, FINE);
            }
        }
        match coarse {
            Some(coarse) => Solution { iterations: self.iterations, ..coarse },
            None => self.solution(&limits, false),
        }
    }

    fn solution(&self, limits: &Limits, converged: bool) -> Solution {
        let limits = if let Limits::Fixed(limits) = limits { limits.clone() } else { Vec::new() };
        let (velocity, forces) = (self.velocity.clone(), self.forces());
        Solution {
            velocity,
            forces,
            iterations: self.iterations,
            converged,
            residual: Residual::default(),
            limits,
        }
    }
}

impl Local {
    /// Of a bundle whose friction is at most `limit`.
    #[inline(always)]
    fn new(
        bundle: &Bundle,
        state: &State,
        relative: &[f64; 6],
        limit: Lanes,
        centre: f64,
        width: f64,
    ) -> Self {
        // Where a bound is infinite, the slack is zero and the room infinite.
        let [low, high] = two(|k| state.slack[k] / state.room[k]);
        let softness = (bundle.compliance + low + high).zip(low + high, |softness, bounds| {
            if bounds == 0.0 { softness.max(PROXIMAL) } else { softness }
        });
        let residual =
            bundle.at(relative) + bundle.compliance * state.force - state.slack[0] + state.slack[1];
        let slip = bundle.slip.as_ref().map_or(Slipping::default(), |slip| {
            let [x, y] = slip.change(relative);
            let u = [slip.way[0] + x, slip.way[1] + y];
            // A spring sticks as softly as it pushes.
            let least = (slip.scale * width).max(limit * bundle.compliance * 0.5);
            let width = (Lanes::splat(centre) / limit).max(least);
            let length = (width * width + u[0] * u[0] + u[1] * u[1]).sqrt();
            let along = two(|k| u[k] / length);
            let [x, y] = state.friction;
            let size = (x * x + y * y).sqrt().max(limit);
            let share = two(|k| -(state.friction[k] / size));
            let k = limit / (width + length);
            let one = Lanes::splat(1.0);
            let stiffness = [
                k * (one - share[0] * along[0]),
                k * (share[0] * along[1] + share[1] * along[0]) * -0.5,
                k * (one - share[1] * along[1]),
            ];
            Slipping { slip: u, limit, width, least, length, along, share, stiffness }
        });
        Self { residual, stiffness: Lanes::splat(1.0) / softness, slip }
    }

    /// The changes when the velocities stay, to these changes of the products, and to ν of
    /// friction. Friction follows its own push, or that which has `followed`.
    #[inline(always)]
    fn standing(
        &self,
        bundle: &Bundle,
        state: &State,
        products: &[Lanes; 2],
        centre: f64,
        followed: Option<Lanes>,
        is_coulomb: bool,
    ) -> Standing {
        let [low, high] = two(|k| products[k] / state.room[k]);
        let push = self.stiffness * (low - high - self.residual);
        let friction = bundle.slip.as_ref().map_or([Lanes::ZERO; 2], |slip| {
            let at = &self.slip;
            let wider = (Lanes::splat(centre) / at.limit).max(at.least) - at.width;
            let [k, wider] = [at.limit / (at.width + at.length), at.limit * wider / at.length];
            let push = followed.unwrap_or(push);
            let follows = if is_coulomb { slip.coefficient * push } else { Lanes::ZERO };
            two(|i| wider * at.share[i] - k * at.slip[i] - follows * at.along[i])
        });
        Standing { push, friction }
    }
}

impl Standing {
    /// The change of the friction.
    #[inline(always)]
    fn added(&self, state: &State) -> [Lanes; 2] {
        two(|k| self.friction[k] - state.friction[k])
    }
}
