//! An iterate of the interior point method, and the iterations to the solution.
use nalgebra::Vector6;

use super::{Effort, Interior, Limits, Solution, WIDTHS};
use crate::newton::line::{Force, Line};
use crate::newton::linear::{BlockMatrix, Factor};

/// Lagged limits stay once the root of ν is below this gap, m.
const FREEZE: f64 = 1e-5;
/// An iterate is the solution when the last iteration moved no body by more than this, and leaves no
/// more of a gap, m.
const SETTLED: f64 = 1e-10;
/// With friction, the forces are off by less than this way, and this share of the way without rows.
const BALANCED: [f64; 2] = [1e-8, 1e-6];
/// ν ends at the square of this gap, m, ...
const LEAST_GAP: f64 = 1e-11;
/// ... or below this multiple of it, 0.1 nm squared. A box at rest is 1e-16 m above its rigid place
/// then, and nothing pushes it across a gap of nanometres.
const FEW: f64 = 1e2;
/// ν begins with the square of this multiple of the greatest gap that is to be closed.
const FIRST: f64 = 3.0;
/// Most iterations with the second one of [`WIDTHS`].
const FINE: u32 = 4;
/// The least share of ν that an iteration aims at.
const LEAST_CENTRING: f64 = 1e-6;
/// A step that goes all the way to a bound is shortened by this share, and less where the predictor
/// is nearly free of bounds.
const SHORTER: f64 = 0.01;
/// Steps below are short, and above long.
const SHORT: f64 = 0.3;
const LONG: f64 = 0.7;
/// Gondzio's correction is taken where it lengthens the step by this factor.
const LENGTHENS: f64 = 1.05;

/// The state of a row.
#[derive(Clone, Copy, Debug)]
struct State {
    force: f64,
    /// How far the force is within each bound. Beside a bound, the difference would have no digits.
    room: [f64; 2],
    /// What a gap is beyond zero where the force is at the bound.
    slack: [f64; 2],
    friction: [f64; 2],
}

/// What an iteration knows of a row.
#[derive(Clone, Copy, Debug, Default)]
struct Local {
    /// Gap and force that do not fit.
    residual: f64,
    /// The decrease of the force with the gap.
    stiffness: f64,
    slip: Slipping,
}

/// What an iteration knows of a friction.
#[derive(Clone, Copy, Debug, Default)]
struct Slipping {
    /// u
    slip: [f64; 2],
    /// b
    limit: f64,
    /// a
    width: f64,
    /// r
    length: f64,
    /// u / r
    along: [f64; 2],
    /// −λ / b, at most 1.
    share: [f64; 2],
    /// The decrease of the friction with the slip: xx, xy, yy.
    stiffness: [f64; 3],
    /// The least a.
    least: f64,
}

/// A change of all unknowns.
struct Direction {
    velocity: Vec<Vector6<f64>>,
    rows: Vec<RowDirection>,
}

#[derive(Clone, Copy, Debug, Default)]
struct RowDirection {
    force: f64,
    slack: [f64; 2],
    /// The friction after a whole step, not its change.
    friction: [f64; 2],
}

/// What a direction aims at.
struct Aim<'a> {
    /// For each bound of each row: the change of room × slack.
    products: &'a [[f64; 2]],
    /// ν of friction.
    centre: f64,
}

/// Positive slack and room whose difference is `gap` and whose product is `centre`.
fn on_path(gap: f64, centre: f64) -> [f64; 2] {
    let root = (gap * gap + 4.0 * centre).sqrt();
    let slack = if gap > 0.0 { 0.5 * (gap + root) } else { 2.0 * centre / (root - gap) };
    [slack, centre / slack]
}

impl State {
    /// The state at the gap `gap` with this ν. A row without bounds keeps the force `kept`.
    fn new(line: &Line, gap: f64, centre: f64, kept: Force) -> Self {
        let [low, high] = line.bounds;
        let (force, room, slack) = match (low.is_finite(), high.is_finite()) {
            (true, false) => {
                let [slack, room] = on_path(gap, centre);
                (low + room, [room, f64::INFINITY], [slack, 0.0])
            }
            (false, true) => {
                let [slack, room] = on_path(-gap, centre);
                (high - room, [f64::INFINITY, room], [0.0, slack])
            }
            (true, true) => {
                // ν / (half + x) − ν / (half − x) = gap
                let half = 0.5 * (high - low);
                let root = centre + (centre * centre + (gap * half).powi(2)).sqrt();
                let x = -gap * half * half / root;
                // (half − |x|) (half + |x|) = 2 ν |x| / |gap|
                let near = 2.0 * centre * half * half / root / (half + x.abs());
                let room = if x < 0.0 { [near, half - x] } else { [half + x, near] };
                (0.5 * (low + high) + x, room, room.map(|room| centre / room))
            }
            (false, false) => (kept.push, [f64::INFINITY; 2], [0.0; 2]),
        };
        Self { force, room, slack, friction: kept.friction }
    }

    /// Room × slack of each bound.
    #[inline]
    fn products(&self, line: &Line) -> [f64; 2] {
        let of = |k: usize| if line.bounds[k].is_finite() { self.room[k] * self.slack[k] } else { 0.0 };
        [of(0), of(1)]
    }

    /// The force that is reported. An open contact has none.
    fn force(&self, line: &Line) -> Force {
        let is_at = |k: usize| line.bounds[k].is_finite() && self.room[k] < self.slack[k];
        match [is_at(0), is_at(1)] {
            [true, _] => Force { push: line.bounds[0], friction: [0.0; 2] },
            [_, true] => Force { push: line.bounds[1], friction: [0.0; 2] },
            _ => Force { push: self.force, friction: self.friction },
        }
    }
}

/// An iterate.
pub struct Run<'a> {
    of: &'a Interior<'a>,
    velocity: Vec<Vector6<f64>>,
    rows: Vec<State>,
    /// ν of friction.
    centre: f64,
    /// Number of factorisations so far.
    iterations: u32,
    /// Number of bounds.
    bounds: usize,
    /// ν at the end.
    least: f64,
}

impl<'a> Run<'a> {
    /// From velocities and forces that are nearly right.
    pub fn from(of: &'a Interior<'a>, velocity: Vec<Vector6<f64>>, forces: &[Force], centre: f64) -> Self {
        let state = |(line, force): (&&Line, &Force)| {
            // Where only one bound is near, so that the force comes out again.
            let kept = if line.count_bounds() == 2 { 0.0 } else { force.push };
            State::new(line, line.at(&velocity) - kept, centre, *force)
        };
        let rows = of.lines.iter().zip(forces).map(state).collect();
        let (bounds, least) = (of.count_bounds(), of.mean_square(LEAST_GAP));
        Self { of, velocity, rows, centre, iterations: 0, bounds, least }
    }

    /// From the velocities that the springs of all rows would lead to.
    pub fn cold(of: &'a Interior<'a>) -> Self {
        let violations = of.lines.iter().map(|line| line.violation(&of.bodies.target));
        let greatest = violations.fold(0.0, f64::max);
        let centre = f64::max((FIRST * greatest).powi(2), of.mean_square(LEAST_GAP));
        let none = vec![Force::default(); of.lines.len()];
        let mut matrix = BlockMatrix::symmetric(of.pattern, of.bodies.inertia.to_vec());
        let mut momentum: Vec<_> =
            of.bodies.inertia.iter().zip(&of.bodies.target).map(|(m, v)| m * v).collect();
        for line in &of.lines {
            let k = if line.count_bounds() > 0 { 1.0 } else { 1.0 / line.compliance };
            let way = line.slip.as_ref().map_or([0.0; 2], |slip| slip.way);
            line.act(-k * line.gap, way.map(|way| -way), &mut momentum);
            match &line.slip {
                Some(slip) => {
                    matrix.add(&slip.sides, line.pair, &[[k, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]);
                }
                None => matrix.add(&line.sides, line.pair, &[[k]]),
            }
        }
        // Joints are stiff, so rounding may make the matrix indefinite.
        let velocity =
            matrix.factor().map_or_else(|| of.bodies.target.to_vec(), |factor| factor.solve(&momentum));
        Self { iterations: 1, ..Self::from(of, velocity, &none, centre) }
    }

    /// The mean of room × slack.
    fn product(&self) -> f64 {
        let products = self.rows.iter().zip(&self.of.lines).map(|(row, line)| row.products(line));
        let sum = products.fold(0.0, |sum, [a, b]| sum + a + b);
        sum / self.bounds.max(1) as f64
    }

    /// What the rows do.
    fn forces(&self) -> Vec<Force> {
        self.rows.iter().zip(&self.of.lines).map(|(row, line)| row.force(line)).collect()
    }

    /// The momentum that velocities and forces leave.
    fn momentum(&self) -> Vec<Vector6<f64>> {
        let mut momentum = self.of.lack(&self.velocity);
        for (line, row) in self.of.lines.iter().zip(&self.rows) {
            line.act(row.force, row.friction, &mut momentum);
        }
        momentum
    }

    fn local(&self, k: usize, limits: &Limits, width: f64) -> Local {
        let (line, row) = (self.of.lines[k], &self.rows[k]);
        let gap = line.at(&self.velocity);
        // Where a bound is infinite, the slack is zero.
        let softness = line.compliance + row.slack[0] / row.room[0] + row.slack[1] / row.room[1];
        let residual = gap + line.compliance * row.force - row.slack[0] + row.slack[1];
        let slip = line.slip.as_ref().map_or(Slipping::default(), |slip| {
            let [x, y] = slip.change(&self.velocity);
            let u = [slip.way[0] + x, slip.way[1] + y];
            let limit = limits.of(k, slip, row.force);
            // A spring sticks as softly as it pushes.
            let least = (width * slip.scale).max(0.5 * limit * line.compliance);
            let path = self.centre / limit;
            let width = path.max(least);
            let length = (width * width + u[0] * u[0] + u[1] * u[1]).sqrt();
            let along = u.map(|u| u / length);
            let size = row.friction[0].hypot(row.friction[1]).max(limit);
            let share = row.friction.map(|friction| -friction / size);
            let k = limit / (width + length);
            let stiffness = [
                k * (1.0 - share[0] * along[0]),
                -0.5 * k * (share[0] * along[1] + share[1] * along[0]),
                k * (1.0 - share[1] * along[1]),
            ];
            Slipping { slip: u, limit, width, least, length, along, share, stiffness }
        });
        Local { residual, stiffness: 1.0 / softness, slip }
    }

    fn matrix(&self, locals: &[Local], is_coulomb: bool) -> BlockMatrix<'a> {
        let inertia = self.of.bodies.inertia.to_vec();
        let mut matrix = match is_coulomb {
            true => BlockMatrix::general(self.of.pattern, inertia),
            false => BlockMatrix::symmetric(self.of.pattern, inertia),
        };
        for (line, Local { stiffness: d, slip: at, .. }) in self.of.lines.iter().zip(locals) {
            match &line.slip {
                Some(slip) => {
                    let [xx, xy, yy] = at.stiffness;
                    let follows = if is_coulomb { -slip.coefficient * d } else { 0.0 };
                    let b =
                        [[*d, 0.0, 0.0], [follows * at.along[0], xx, xy], [follows * at.along[1], xy, yy]];
                    matrix.add(&slip.sides, line.pair, &b);
                }
                None => matrix.add(&line.sides, line.pair, &[[*d]]),
            }
        }
        matrix
    }

    /// The change of all unknowns to an aim, for the present `momentum`.
    fn direction(
        &self,
        factor: &Factor<'_>,
        momentum: &[Vector6<f64>],
        locals: &[Local],
        aim: &Aim<'_>,
        is_coulomb: bool,
    ) -> Direction {
        let mut momentum = momentum.to_vec();
        // The changes of push and friction when the velocities stay.
        let mut standing = Vec::with_capacity(self.rows.len());
        for (k, (line, row)) in self.of.lines.iter().zip(&self.rows).enumerate() {
            let (local, products) = (&locals[k], aim.products[k]);
            let push =
                local.stiffness * (products[0] / row.room[0] - products[1] / row.room[1] - local.residual);
            let friction = line.slip.as_ref().map_or([0.0; 2], |slip| {
                let at = &local.slip;
                let wider = (aim.centre / at.limit).max(at.least) - at.width;
                let follows = if is_coulomb { slip.coefficient * push } else { 0.0 };
                let [k, wider] = [at.limit / (at.width + at.length), at.limit * wider / at.length];
                [0, 1].map(|i| wider * at.share[i] - k * at.slip[i] - follows * at.along[i])
            });
            line.act(push, [friction[0] - row.friction[0], friction[1] - row.friction[1]], &mut momentum);
            standing.push((push, friction));
        }
        let velocity = factor.solve(&momentum);
        let of_row = |k: usize| {
            let (line, local, row, (push, friction)) =
                (self.of.lines[k], &locals[k], &self.rows[k], standing[k]);
            let yields = local.stiffness * line.change(&velocity);
            let force = push - yields;
            let products = aim.products[k];
            let slack = [
                (products[0] - row.slack[0] * force) / row.room[0],
                (products[1] + row.slack[1] * force) / row.room[1],
            ];
            let friction = line.slip.as_ref().map_or([0.0; 2], |slip| {
                let ([x, y], [xx, xy, yy]) = (slip.change(&velocity), local.slip.stiffness);
                let follows = if is_coulomb { slip.coefficient * yields } else { 0.0 };
                let [u, v] = local.slip.along;
                [friction[0] - xx * x - xy * y + follows * u, friction[1] - xy * x - yy * y + follows * v]
            });
            RowDirection { force, slack, friction }
        };
        Direction { rows: (0..self.rows.len()).map(of_row).collect(), velocity }
    }

    /// The greatest step at which all rooms and slacks are positive.
    fn longest(&self, direction: &Direction) -> f64 {
        let to_zero = |value: f64, change: f64| if change < 0.0 { -value / change } else { f64::INFINITY };
        let of_row = |((row, change), line): ((&State, &RowDirection), &&Line)| {
            let of_bound = |k: usize, force: f64| match line.bounds[k].is_finite() {
                true => to_zero(row.slack[k], change.slack[k]).min(to_zero(row.room[k], force)),
                false => f64::INFINITY,
            };
            of_bound(0, change.force).min(of_bound(1, -change.force))
        };
        self.rows.iter().zip(&direction.rows).zip(&self.of.lines).map(of_row).fold(f64::INFINITY, f64::min)
    }

    /// The direction of an iteration, how far to go along it, and ν of friction at its end.
    fn next(
        &self,
        factor: &Factor<'_>,
        momentum: &[Vector6<f64>],
        locals: &[Local],
        is_coulomb: bool,
    ) -> (Direction, f64, f64) {
        let direction = |products: &[[f64; 2]], centre: f64| {
            self.direction(factor, momentum, locals, &Aim { products, centre }, is_coulomb)
        };
        let products: Vec<[f64; 2]> =
            self.rows.iter().zip(&self.of.lines).map(|(row, line)| row.products(line)).collect();
        let away: Vec<[f64; 2]> = products.iter().map(|now| now.map(|product| -product)).collect();
        let predictor = direction(&away, self.least);
        if self.bounds == 0 {
            return (predictor, 1.0, self.centre);
        }
        let affine = self.longest(&predictor).min(1.0);
        let product = self.product();
        let centring = (1.0 - affine).powi(3).max(LEAST_CENTRING);
        let centre = (centring * product).max(self.least).min(product.max(self.least));
        let mut aims: Vec<[f64; 2]> = Vec::with_capacity(products.len());
        for ((now, change), line) in products.iter().zip(&predictor.rows).zip(&self.of.lines) {
            let aim = |k: usize, sign: f64| match line.bounds[k].is_finite() {
                true => centre - now[k] - sign * change.slack[k] * change.force,
                false => 0.0,
            };
            aims.push([aim(0, 1.0), aim(1, -1.0)]);
        }
        let mut corrected = direction(&aims, centre);
        let mut longest = self.longest(&corrected);
        if longest < 1.0 / LENGTHENS {
            let farther = (1.5 * longest + 0.1).min(1.0);
            for (((aims, row), change), line) in
                aims.iter_mut().zip(&self.rows).zip(&corrected.rows).zip(&self.of.lines)
            {
                for (k, sign) in
                    [(0, 1.0), (1, -1.0)].into_iter().filter(|&(k, _)| line.bounds[k].is_finite())
                {
                    let room = row.room[k] + farther * sign * change.force;
                    let product = room * (row.slack[k] + farther * change.slack[k]);
                    aims[k] += (product.clamp(0.1 * centre, 10.0 * centre) - product).max(-10.0 * centre);
                }
            }
            let again = direction(&aims, centre);
            let reach = self.longest(&again);
            if reach.min(1.0) >= LENGTHENS * longest {
                (corrected, longest) = (again, reach);
            }
        }
        let shorter = SHORTER * (100.0 * (1.0 - affine)).clamp(1e-4, 1.0);
        (corrected, ((1.0 - shorter) * longest).min(1.0), centre)
    }

    /// Goes along a direction.
    fn advance(&mut self, direction: &Direction, step: f64, limits: &Limits) {
        self.velocity.iter_mut().zip(&direction.velocity).for_each(|(v, change)| *v += step * change);
        for (k, ((row, change), line)) in
            self.rows.iter_mut().zip(&direction.rows).zip(&self.of.lines).enumerate()
        {
            row.force += step * change.force;
            row.room[0] += step * change.force;
            row.room[1] -= step * change.force;
            row.slack[0] += step * change.slack[0];
            row.slack[1] += step * change.slack[1];
            let Some(slip) = &line.slip else { continue };
            let limit = limits.of(k, slip, row.force);
            row.friction = [0, 1].map(|k| row.friction[k] + step * (change.friction[k] - row.friction[k]));
            let size = row.friction[0].hypot(row.friction[1]);
            if size > limit {
                row.friction = row.friction.map(|friction| friction * limit / size);
            }
        }
    }

    /// Iterates to the end.
    pub fn descend(mut self, mut limits: Limits, effort: Effort) -> Solution {
        let has_friction = self.of.has_friction();
        let [freeze, few] = [self.of.mean_square(FREEZE), FEW * self.least];
        let balanced = BALANCED[0] + BALANCED[1] * self.of.way(&self.of.bodies.target);
        let (mut width, mut short_steps, mut left) = (effort.width, 0, effort.iterations);
        // The solution with the first width.
        let mut coarse = None;
        while left > 0 && short_steps < effort.short_steps {
            left -= 1;
            if matches!(limits, Limits::Lagged) && self.product() < freeze {
                limits = Limits::Fixed(self.of.limits(&self.forces()));
            }
            let is_coulomb = has_friction && matches!(limits, Limits::Coulomb);
            let locals: Vec<Local> =
                (0..self.rows.len()).map(|k| self.local(k, &limits, WIDTHS[width])).collect();
            for (row, local) in self.rows.iter_mut().zip(&locals) {
                row.friction = local.slip.share.map(|share| -local.slip.limit * share);
            }
            let momentum = self.momentum();
            let Some(factor) = self.matrix(&locals, is_coulomb).factor() else { break };
            self.iterations += 1;
            let (direction, step, centre) = self.next(&factor, &momentum, &locals, is_coulomb);
            self.advance(&direction, step, &limits);
            self.centre = (self.centre + step * (centre - self.centre)).max(self.least);
            let way = self.of.way(&direction.velocity);
            if !way.is_finite() {
                break;
            }
            short_steps = if step < SHORT { short_steps + 1 } else { 0 };
            let open = || {
                let gaps = locals.iter().zip(&self.of.lines).map(|(l, line)| l.residual.abs() / line.scale);
                gaps.fold(0.0, f64::max) * (1.0 - step)
            };
            let is_balanced = || !is_coulomb || self.of.way_of_momentum(&momentum) < balanced;
            if step > LONG && way < SETTLED && open() < SETTLED && is_balanced() && self.product() <= few {
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
        Solution { velocity, forces, iterations: self.iterations, converged, limits }
    }
}
