//! The problem of one island: rows that may act, and those that a solution calls.
use nalgebra::{Matrix6, Vector6};

use super::interior::{Guess, Interior, Solution};
use super::line::{Bodies, Inverse, Lines, Placed};
use super::pattern::Pattern;
use super::rows::{Resistance, RowForce, RowId};
use crate::Residual;

/// Bodies, the rows between them, and the velocities without rows.
#[derive(Debug)]
pub struct Problem<'a> {
    bodies: Bodies,
    rows: Vec<Placed<'a>>,
    pattern: Pattern,
}

/// The solution of a problem.
#[derive(Clone, Debug)]
pub struct Minimum {
    /// Velocities of the bodies of the island.
    pub velocity: Vec<Vector6<f64>>,
    /// What each row does.
    pub forces: Vec<RowForce>,
    /// Number of Newton iterations.
    pub iterations: u32,
    /// Whether the method came to its end, ...
    pub converged: bool,
    /// ... and what it left, where it did not.
    pub residual: Residual,
}

/// A contact may act when its gap is at most this share of the way by which it differs between the
/// velocities of the start and those without contacts, ...
const NEAR: f64 = 0.01;

/// ... or this share of the greatest such way in the island: bricks that stand side by side.
const NEAR_OF_ALL: f64 = 1e-3;

/// A contact is closed when its gap is below this, m.
const CLOSED: f64 = 1e-10;

/// The forces are a guess for more rows when these are closed by less than this, m.
const NEARLY_OPEN: f64 = 1e-3;

/// A body's points are within about this multiple of its radius of gyration.
const LEVER: f64 = 2.0;

impl Minimum {
    /// A solution that is known.
    pub fn known(velocity: Vec<Vector6<f64>>, forces: Vec<RowForce>) -> Self {
        Self { velocity, forces, iterations: 0, converged: true, residual: Residual::default() }
    }
}

impl<'a> Problem<'a> {
    /// `target` has one velocity per body.
    pub fn new(
        inertia: Vec<Matrix6<f64>>,
        mut target: Vec<Vector6<f64>>,
        rows: Vec<Placed<'a>>,
        time_step: f64,
    ) -> Self {
        let inverse: Vec<_> = inertia.iter().map(Inverse::of).collect();
        for placed in rows.iter().filter(|row| is_given(row)) {
            for (side, body) in placed.row.sides.iter().zip(placed.bodies) {
                if let (Some((_, j)), Some(body)) = (side, body) {
                    target[body] += inverse[body].times(j) * (time_step * placed.row.bounds[0]);
                }
            }
        }
        let mut pairs: Vec<_> = rows.iter().flat_map(pairs_of).collect();
        pairs.dedup();
        let pattern = Pattern::new(inertia.len(), pairs);
        let lever = |m: &Matrix6<f64>| LEVER * (m.fixed_view::<3, 3>(3, 3).trace() / m[(0, 0)]).sqrt();
        let levers = inertia.iter().map(lever).collect();
        Self { bodies: Bodies { inertia, inverse, target, levers, time_step }, rows, pattern }
    }

    /// The velocities without rows, but with those whose force is given.
    pub fn target(&self) -> &[Vector6<f64>] {
        &self.bodies.target
    }

    /// The problem whose contacts are springs.
    pub fn softened(mut self) -> Self {
        let is_contact = |placed: &&mut Placed<'_>| matches!(placed.row.id, RowId::Contact(..));
        for placed in self.rows.iter_mut().filter(is_contact) {
            placed.resistance = Resistance::Spring;
        }
        self
    }

    /// How far these velocities close a contact beyond its gap, m.
    pub fn closed(&self, velocity: &[Vector6<f64>]) -> f64 {
        let contacts = self.rows.iter().filter(|placed| placed.row.is_contact());
        contacts.map(|placed| -placed.at(velocity, self.bodies.time_step)).fold(0.0, f64::max)
    }

    /// Solves from `start`, where rows had the forces `guess`, if any.
    pub fn minimise(&self, start: Vec<Vector6<f64>>, guess: Option<&[RowForce]>) -> Minimum {
        let mut search = Minimisation::new(self, start, guess);
        loop {
            let found = search.interior().solve(search.guess());
            if let Some(minimum) = search.next(found) {
                return minimum;
            }
        }
    }
}

/// The search of a solution in rounds.
///
/// Most contacts stay open, so it begins with those that are nearly closed. It is repeated with
/// the others that its solution closes, until there are none.
pub struct Minimisation<'p, 'a> {
    problem: &'p Problem<'a>,
    /// The gap of each row without forces, m.
    free: Vec<f64>,
    /// Whether each row is in `lines`.
    acts: Vec<bool>,
    lines: Lines,
    /// What each row does.
    forces: Vec<RowForce>,
    /// Velocities that are nearly right with `forces`.
    near: Option<Vec<Vector6<f64>>>,
    iterations: u32,
}

impl<'p, 'a> Minimisation<'p, 'a> {
    /// As [`Problem::minimise`].
    pub fn new(problem: &'p Problem<'a>, start: Vec<Vector6<f64>>, guess: Option<&[RowForce]>) -> Self {
        let Bodies { target, time_step, .. } = &problem.bodies;
        let rows = &problem.rows;
        let gaps = |placed: &Placed<'_>| (placed.at(target, *time_step), placed.at(&start, *time_step));
        let (free, at_start): (Vec<_>, Vec<_>) = rows.iter().map(gaps).unzip();
        let change = |k: usize| (at_start[k] - free[k]).abs();
        let of_all = NEAR_OF_ALL * (0..rows.len()).map(change).fold(0.0, f64::max);
        let is_near =
            |k: usize| !rows[k].row.is_contact() || at_start[k] <= f64::max(NEAR * change(k), of_all);
        let has_force = |k: usize| guess.is_some_and(|guess| guess[k].along != 0.0);
        let may_act = |k: usize| !is_given(&rows[k]) && (has_force(k) || is_near(k));
        let acts: Vec<bool> = (0..rows.len()).map(may_act).collect();
        let forces = guess.map_or_else(|| vec![RowForce::default(); rows.len()], <[_]>::to_vec);
        let (near, lines) = (guess.map(|_| start), Lines::default());
        let mut search = Self { problem, free, acts, lines, forces, near, iterations: 0 };
        let first: Vec<usize> = (0..rows.len()).filter(|&k| search.acts[k]).collect();
        search.add(&first);
        search
    }

    fn add(&mut self, rows: &[usize]) {
        let Problem { bodies, rows: all, pattern } = self.problem;
        self.lines.add(rows, all, bodies, pattern);
    }

    /// The rows of this round.
    pub fn interior(&self) -> Interior<'_> {
        Interior { bodies: &self.problem.bodies, pattern: &self.problem.pattern, lines: &self.lines }
    }

    /// Velocities and forces that may be nearly right.
    pub fn guess(&self) -> Option<Guess> {
        let of_row = |k: usize| (self.problem.rows[k].row, self.forces[k]);
        self.near.clone().map(|velocity| (velocity, self.lines.forces(of_row)))
    }

    /// Ends the round with the solution of its rows. Returns the minimum, or `None` before another
    /// round.
    pub fn next(&mut self, found: Solution) -> Option<Minimum> {
        let Problem { rows, bodies, .. } = self.problem;
        self.iterations += found.iterations;
        for (bundle, of_bundle) in self.lines.bundles.iter().zip(&found.forces) {
            for (lane, &k) in bundle.rows().iter().enumerate() {
                bundle.tell(lane, rows[k].row, of_bundle, &mut self.forces[k]);
            }
        }
        let (mut closed, mut added) = (0.0, Vec::new());
        for (k, placed) in rows.iter().enumerate().filter(|(k, row)| !self.acts[*k] && !is_given(row)) {
            let now = placed.at(&found.velocity, bodies.time_step);
            if now < f64::max(NEAR * (now - self.free[k]).abs(), CLOSED) {
                added.push(k);
            }
            closed = f64::max(closed, -now);
        }
        if closed <= CLOSED || !found.velocity.iter().all(|v| v.norm().is_finite()) {
            let mut forces = std::mem::take(&mut self.forces);
            for (force, placed) in forces.iter_mut().zip(rows).filter(|(_, row)| is_given(row)) {
                *force = RowForce { along: placed.row.bounds[0], ..RowForce::default() };
            }
            let Solution { velocity, converged, residual, .. } = found;
            return Some(Minimum { velocity, forces, iterations: self.iterations, converged, residual });
        }
        added.iter().for_each(|&k| self.acts[k] = true);
        self.add(&added);
        self.near = (closed < NEARLY_OPEN && found.converged).then_some(found.velocity);
        None
    }
}

/// Whether the force of a row is given.
fn is_given(placed: &Placed<'_>) -> bool {
    placed.row.bounds[0] == placed.row.bounds[1]
}

/// The pairs of the bodies of a row, the lower one first.
fn pairs_of(placed: &Placed<'_>) -> impl Iterator<Item = (usize, usize)> {
    let of_sides = match placed.bodies {
        [Some(a), Some(b)] => Some((a.min(b), a.max(b))),
        _ => None,
    };
    let coupled = placed.coupled.iter().enumerate();
    of_sides.into_iter().chain(coupled.flat_map(|(k, &b)| placed.coupled[..k].iter().map(move |&a| (a, b))))
}

#[cfg(test)]
mod tests {
    use glam::{DMat3, DQuat, DVec3};

    use super::*;
    use crate::MassProperties;
    use crate::newton::integrate::{pack, unpack};
    use crate::newton::interior::LAG;
    use crate::newton::rows::{FreeBody, Friction, PUSHES, Row, Stiffness};

    const H: f64 = 1e-3;

    /// Five bodies whose masses differ by up to a factor of `ratio`.
    fn bodies(ratio: f64, random: &mut fastrand::Rng) -> Vec<FreeBody> {
        let mut body = |k| {
            let mass = 2.0 * ratio.powf(random.f64() - 0.5);
            let inertia = DMat3::from_diagonal(mass * DVec3::new(0.05, 0.1, 0.15));
            FreeBody::new(k, &MassProperties { mass, center: DVec3::ZERO, inertia }, DQuat::IDENTITY)
        };
        (0..5).map(&mut body).collect()
    }

    /// A contact without friction.
    fn contact_row(k: usize, bodies: [Option<usize>; 2], arms: [DVec3; 2], normal: DVec3, gap: f64) -> Row {
        let side = |side: usize, n: DVec3| bodies[side].map(|body| (body, pack(n, arms[side].cross(n))));
        Row {
            id: RowId::Joint(k),
            sides: [side(0, normal), side(1, -normal)],
            coupled: Vec::new(),
            point: DVec3::ZERO,
            arms,
            gap,
            relaxed_gap: gap,
            stiffness: Stiffness::Absolute(30.0 / (H * H)),
            bounds: PUSHES,
            resistance: Resistance::Rigid,
            friction: None,
        }
    }

    /// Contacts at random points with random normals, most of them open when nothing moves. The
    /// bodies are side by side.
    fn contacts(count: usize, coefficient: f64, random: &mut fastrand::Rng) -> Vec<Row> {
        let mut vector = || DVec3::new(random.f64() - 0.5, random.f64() - 0.5, random.f64() - 0.5);
        let centres: [DVec3; 5] = [(); 5].map(|()| 0.5 * vector());
        let mut contact = |k: usize| {
            let (a, b, normal, point) = (k % 5, (k + 1) % 5, vector().normalize(), vector());
            let arms = [a, b].map(|body| point - centres[body]);
            let bodies = [Some(a), Some(b).filter(|_| !k.is_multiple_of(3))];
            let row = contact_row(k, bodies, arms, normal, 0.1 * H * vector().x.abs());
            let way = (0.01 * H * vector()).reject_from_normalized(normal);
            let friction = Friction { normal, coefficient, way, torsional: 0.0, turn: 0.0 };
            Row { friction: (coefficient > 0.0).then_some(friction), ..row }
        };
        (0..count).map(&mut contact).collect()
    }

    fn problem<'a>(free: &[FreeBody], target: &[Vector6<f64>], rows: &'a [Row]) -> Problem<'a> {
        let inertia = free.iter().map(|body| body.inertia).collect();
        let placed = |row: &'a Row| {
            let bodies = row.sides.map(|side| side.map(|(body, _)| body));
            let coupled = row.coupled.iter().map(|(body, _)| *body).collect();
            Placed { row, bodies, coupled, gap: row.gap, resistance: row.resistance }
        };
        Problem::new(inertia, target.to_vec(), rows.iter().map(placed).collect(), H)
    }

    fn velocities(random: &mut fastrand::Rng) -> Vec<Vector6<f64>> {
        (0..5).map(|_| Vector6::from_fn(|_, _| random.f64() - 0.5)).collect()
    }

    /// Says what of the laws a solution does not keep: momentum, the law of each row, and that of
    /// friction.
    fn check(
        free: &[FreeBody],
        target: &[Vector6<f64>],
        rows: &[Row],
        found: &Minimum,
    ) -> Result<(), String> {
        let mut lack: Vec<_> = free
            .iter()
            .zip(target)
            .zip(&found.velocity)
            .map(|((body, to), v)| body.inertia * (to - v))
            .collect();
        for (k, (row, force)) in rows.iter().zip(&found.forces).enumerate() {
            for (side, (arm, sign)) in row.sides.iter().zip([(row.arms[0], H), (row.arms[1], -H)]) {
                let Some((body, j)) = side else { continue };
                let friction = sign * force.friction;
                lack[*body] += j * (H * force.along) + pack(friction, arm.cross(friction));
                if let Some(Friction { normal, .. }) = row.friction {
                    lack[*body] += pack(DVec3::ZERO, sign * force.torsion * normal);
                }
            }
            let gap = row.gap + H * row.rate(&found.velocity);
            for (body, j) in &row.coupled {
                lack[*body] += j * (H * force.along);
            }
            // A force that a spring with this kept force has again.
            let of_side = |(body, j): &(usize, Vector6<f64>)| j.dot(&(free[*body].inverse * j));
            let per_gap = 1.0 / (H * H * row.bodies().map(of_side).sum::<f64>());
            let again = match row.resistance {
                Resistance::Rigid => force.along - per_gap * gap,
                Resistance::Spring | Resistance::Parting => -30.0 / (H * H) * gap,
            };
            let off = (again.clamp(row.bounds[0], row.bounds[1]) - force.along) / per_gap;
            if off.abs() > 1e-9 {
                return Err(format!("row {k}: {force:?} at a gap of {gap:e} m"));
            }
            let Some(friction) = row.friction else { continue };
            let at = |side: usize| {
                row.sides[side].map_or(DVec3::ZERO, |(body, _)| {
                    let (linear, angular) = unpack(&found.velocity[body]);
                    linear + angular.cross(row.arms[side])
                })
            };
            let slip = friction.way + (H * (at(0) - at(1))).reject_from_normalized(friction.normal);
            let limit = friction.coefficient * force.along;
            let again = (force.friction - per_gap * slip).clamp_length_max(limit);
            // Limits that lag may be off by this share.
            if again.distance(force.friction) > 1e-9 * per_gap + LAG * limit {
                return Err(format!("row {k}: {force:?} at a slip of {slip} m"));
            }
            let spin = |side: usize| {
                row.sides[side].map_or(0.0, |(body, _)| unpack(&found.velocity[body]).1.dot(friction.normal))
            };
            let turn = friction.turn + H * (spin(0) - spin(1));
            let limit = friction.torsional * force.along;
            let again = (force.torsion - per_gap * turn).clamp(-limit, limit);
            if (again - force.torsion).abs() > 1e-9 * per_gap + LAG * limit {
                return Err(format!("row {k}: {force:?} at a turn of {turn} rad"));
            }
        }
        let off = lack.iter().zip(free).map(|(p, body)| H * (body.inverse * p).norm()).fold(0.0, f64::max);
        if off > 1e-8 { Err(format!("momentum is off by {off:e} m")) } else { Ok(()) }
    }

    /// The conditions of Karush, Kuhn and Tucker, with masses up to a thousand times each other.
    #[test]
    fn solutions_keep_the_laws_of_contact_and_friction() {
        for seed in 0..60 {
            let random = &mut fastrand::Rng::with_seed(seed);
            let coefficient = [0.0, 0.1, 0.2][seed as usize % 3];
            let free = bodies([1.0, 10.0, 1e3][seed as usize / 3 % 3], random);
            let (target, rows) = (velocities(random), contacts(100, coefficient, random));
            let found = problem(&free, &target, &rows).minimise(target.clone(), None);
            assert!(found.converged, "seed {seed}");
            check(&free, &target, &rows, &found).unwrap_or_else(|off| panic!("seed {seed}: {off}"));
            assert!(found.forces.iter().filter(|force| force.along > 0.0).count() > 5, "seed {seed}");
        }
    }

    /// With and without sliding friction, of some contacts, and of all.
    #[test]
    fn torsional_friction_keeps_its_law() {
        let mut stick = [0; 2];
        for seed in 0..60 {
            let random = &mut fastrand::Rng::with_seed(seed);
            let coefficient = [0.0, 0.1, 0.2][seed as usize % 3];
            let free = bodies([1.0, 10.0, 1e3][seed as usize / 3 % 3], random);
            let (target, mut rows) = (velocities(random), contacts(100, coefficient, random));
            let none = Friction {
                normal: DVec3::ZERO,
                coefficient: 0.0,
                way: DVec3::ZERO,
                torsional: 0.0,
                turn: 0.0,
            };
            for (k, row) in rows.iter_mut().enumerate() {
                if seed % 2 == 1 && k % 3 == 0 {
                    continue;
                }
                let side = row.sides[0].unwrap().1;
                let torsional = 0.1 * random.f64();
                let turn = 0.01 * H * (random.f64() - 0.5);
                let friction = row.friction.unwrap_or(Friction { normal: unpack(&side).0, ..none });
                row.friction = Some(Friction { torsional, turn, ..friction });
            }
            let found = problem(&free, &target, &rows).minimise(target.clone(), None);
            assert!(found.converged, "seed {seed}");
            check(&free, &target, &rows, &found).unwrap_or_else(|off| panic!("seed {seed}: {off}"));
            for (row, force) in rows.iter().zip(&found.forces).filter(|(_, force)| force.along > 1e-3) {
                let Some(Friction { torsional, .. }) = row.friction else { continue };
                if torsional > 0.0 {
                    stick[usize::from(force.torsion.abs() < 0.99 * torsional * force.along)] += 1;
                }
            }
            let again = problem(&free, &target, &rows).minimise(found.velocity.clone(), Some(&found.forces));
            assert!(again.converged && again.iterations < 10, "seed {seed}: {}", again.iterations);
        }
        assert!(stick.iter().all(|&count| count > 50), "some turn and some stick: {stick:?}");
    }

    /// Where friction is great, some problems have no solution that the method finds.
    #[test]
    fn most_problems_with_great_friction_have_a_solution() {
        let mut unsolved = 0;
        for seed in 0..300 {
            let random = &mut fastrand::Rng::with_seed(seed);
            let free = bodies(10.0, random);
            let (target, rows) = (velocities(random), contacts(40, 0.8, random));
            let found = problem(&free, &target, &rows).minimise(target.clone(), None);
            unsolved += usize::from(!found.converged);
        }
        assert!(unsolved <= 3, "{unsolved}");
    }

    /// Four cubes of side 0.1 m that slide on the ground, on each other: each on eight points.
    fn stack(random: &mut fastrand::Rng) -> (Vec<FreeBody>, Vec<Vector6<f64>>, Vec<Row>) {
        let inertia = DMat3::from_diagonal(DVec3::splat(1.0 / 600.0));
        let mass = MassProperties { mass: 1.0, center: DVec3::ZERO, inertia };
        let free: Vec<_> = (0..4).map(|k| FreeBody::new(k, &mass, DQuat::IDENTITY)).collect();
        let uneven = random.f64().powi(4);
        let mut number = || random.f64() - 0.5;
        let mut vector = || DVec3::new(number(), number(), number());
        let slow = 0.1 * uneven;
        let target = (0..4)
            .map(|k| pack(DVec3::new(0.3, 0.1, -0.02 * k as f64 - 0.05) + slow * vector(), slow * vector()))
            .collect();
        let mut rows = Vec::new();
        for k in 0..32 {
            let (above, corner) = (
                k / 8,
                DVec3::new([-0.05, 0.05, -0.04, 0.045][k % 2 + k / 4 % 2 * 2], [-0.05, 0.05][k / 2 % 2], 0.0),
            );
            let (normal, gap) = ((DVec3::Z + 1e-3 * uneven * vector()).normalize(), 1e-5 * vector().x);
            let arms = [corner - 0.05 * DVec3::Z, corner + 0.05 * DVec3::Z];
            let row = contact_row(k, [Some(above), above.checked_sub(1)], arms, normal, gap);
            let friction = Friction { normal, coefficient: 0.5, way: DVec3::ZERO, torsional: 0.0, turn: 0.0 };
            rows.push(Row { friction: Some(friction), ..row });
        }
        (free, target, rows)
    }

    /// The last iteration must not bring friction beyond its limit: it would be cut there, and
    /// bodies would have a momentum that nothing gave them.
    #[test]
    fn friction_that_is_cut_is_no_solution() {
        for seed in 0..200 {
            let (free, target, rows) = stack(&mut fastrand::Rng::with_seed(seed));
            let found = problem(&free, &target, &rows).minimise(target.clone(), None);
            assert!(found.converged, "seed {seed}");
            check(&free, &target, &rows, &found).unwrap_or_else(|off| panic!("seed {seed}: {off}"));
        }
    }

    /// Joints, couplings, motors of a limited force, springs and given forces beside contacts.
    #[test]
    fn rows_of_all_kinds_keep_their_laws() {
        for seed in 0..40 {
            let random = &mut fastrand::Rng::with_seed(seed);
            let (free, target) = (bodies(10.0, random), velocities(random));
            let mut rows = contacts(40, 0.1, random);
            for (k, row) in rows.iter_mut().enumerate().take(16) {
                row.friction = None;
                (row.bounds, row.resistance) = match k % 4 {
                    0 => ([f64::NEG_INFINITY, f64::INFINITY], Resistance::Rigid),
                    1 => ([-50.0, 50.0], Resistance::Rigid),
                    2 => (PUSHES, Resistance::Spring),
                    _ => ([f64::NEG_INFINITY, 0.0], Resistance::Rigid),
                };
            }
            rows[15].bounds = [20.0; 2];
            for (row, bodies) in rows.iter_mut().step_by(4).zip([&[0, 1, 3, 4][..], &[1, 2, 4]]) {
                row.sides = [None; 2];
                row.coupled = bodies.iter().map(|body| (*body, velocities(random)[0])).collect();
            }
            let found = problem(&free, &target, &rows).minimise(target.clone(), None);
            assert!(found.converged, "seed {seed}");
            assert_eq!(found.forces[15].along, 20.0);
            check(&free, &target, &rows, &found).unwrap_or_else(|off| panic!("seed {seed}: {off}"));
        }
    }

    /// A solution is found again from itself, and from one of other gaps.
    #[test]
    fn forces_that_are_kept_lead_to_the_same_motion() {
        for seed in 0..20 {
            let random = &mut fastrand::Rng::with_seed(seed);
            let (free, target) = (bodies(10.0, random), velocities(random));
            // With friction and scattered normals there may be several motions.
            let (coefficient, noises) =
                [(0.0, [0.0, 1e-9, 1e-6, 1.0]), (0.2, [0.0, 1e-9, 1e-8, 1e-7])][seed as usize % 2];
            let mut rows = contacts(100, coefficient, random);
            let first = problem(&free, &target, &rows).minimise(target.clone(), None);
            for noise in noises {
                rows.iter_mut().for_each(|row| row.gap += noise * H * (random.f64() - 0.5));
                let problem = problem(&free, &target, &rows);
                let again = problem.minimise(first.velocity.clone(), Some(&first.forces));
                let cold = problem.minimise(target.clone(), None);
                let off = again.velocity.iter().zip(&cold.velocity).map(|(a, b)| H * (a - b).norm());
                let off = off.fold(0.0, f64::max);
                assert!(again.converged && cold.converged && off < 1e-8, "seed {seed}, {noise}: {off:e} m");
                assert!(noise > 1e-9 || again.iterations < 10, "seed {seed}: {}", again.iterations);
            }
        }
    }

    /// Two walls that are too near for a body push it to the middle.
    #[test]
    fn rows_that_contradict_each_other_have_a_solution() {
        let random = &mut fastrand::Rng::with_seed(1);
        let (free, target) = (bodies(1.0, random), vec![Vector6::zeros(); 5]);
        let mut rows = contacts(2, 0.0, random);
        for (row, sign) in rows.iter_mut().zip([1.0, -1.0]) {
            row.sides = [Some((0, sign * Vector6::x())), None];
            row.gap = -1e-3;
        }
        let found = problem(&free, &target, &rows).minimise(target.clone(), None);
        assert!(found.converged);
        assert!(H * found.velocity[0].norm() < 1e-9, "{}", found.velocity[0]);
        assert!((found.forces[0].along / found.forces[1].along - 1.0).abs() < 1e-6);
        // Each is closed by what it asks for.
        let closed = problem(&free, &target, &rows).closed(&found.velocity);
        assert!((closed - 1e-3).abs() < 1e-9, "{closed}");
    }

    #[test]
    fn rows_that_nothing_closes_have_no_force() {
        let random = &mut fastrand::Rng::with_seed(1);
        let (free, target) = (bodies(1.0, random), vec![Vector6::zeros(); 5]);
        let rows = contacts(20, 0.3, random);
        let found = problem(&free, &target, &rows).minimise(target.clone(), None);
        assert_eq!(found.velocity, target);
        assert_eq!(found.forces, [RowForce::default(); 20]);
        let none = problem(&free, &target, &[]).minimise(target.clone(), None);
        assert!(none.converged && none.velocity == target);
    }
}
