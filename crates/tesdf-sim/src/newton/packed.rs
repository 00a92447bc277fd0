//! The problems of islands as plain numbers, for a device that solves them.
use nalgebra::Vector6;
use tesdf::collide::CollideError;

use super::group::Group;
use super::interior::{Guess, Interior, Solution};
use super::lanes::{Lanes, WIDTH};
use super::line::{Bundle, Forces};

/// Solves problems of islands on a device.
pub trait SolveIslands: Send + Sync {
    /// The processor solves problems that have fewer rows together.
    fn least_rows(&self) -> usize;

    /// The results of all problems, laid out as [`Packed`] says.
    ///
    /// # Errors
    /// [`CollideError::Device`] when the device fails.
    fn solve(&self, problems: &Packed) -> Result<Vec<f64>, CollideError>;
}

/// Most bodies of an island.
pub const BODIES: usize = 16;
/// Words of a header.
pub const HEADER: usize = 12;
/// A body that is none: the world.
pub const NONE: u32 = u32::MAX;
/// Numbers of all of an island: duration of the step, number of bounds, ν at the end, greatest
/// violation, ν of the guess, and the way by which forces may be off, m.
pub const SCALARS: usize = 6;
/// Numbers of a body: mass; inertia and inverse inertia, each xx, yy, zz, xy, xz, yz; inverse mass;
/// velocity without rows; velocity of the guess; lever.
pub const BODY: usize = 27;
/// Words of a group: its body, the other one or [`NONE`], its first run, and the number of its
/// runs.
pub const GROUP: usize = 4;
/// Words of a run: its first row, the row after its last one, whether its rows have friction, and
/// its group.
pub const RUN: usize = 4;

/// Numbers of a row, each in an array over all rows of the island. Infinite bounds are
/// [`UNBOUNDED`].
pub mod field {
    /// Six derivatives of the gap.
    pub const NORMAL: usize = 0;
    /// The gap where nothing moves.
    pub const GAP: usize = 6;
    /// The gap that a force leaves.
    pub const COMPLIANCE: usize = 7;
    /// The least and the greatest force.
    pub const BOUNDS: usize = 8;
    /// The number by which metres are multiplied.
    pub const SCALE: usize = 10;
    /// Twice six derivatives of the ways.
    pub const TANGENTS: usize = 11;
    /// Two ways where nothing moves.
    pub const WAY: usize = 23;
    /// The coefficient of friction.
    pub const COEFFICIENT: usize = 25;
    /// The number by which ways are multiplied.
    pub const SLIP_SCALE: usize = 26;
    /// Push and friction of the guess.
    pub const GUESS: usize = 27;
    /// Number of all.
    pub const COUNT: usize = 30;
}

/// A bound that is none; beyond half of it, bounds are infinite.
pub const UNBOUNDED: f64 = 1e300;

/// Numbers of an island before those of its bodies and rows in the results: iterations, and whether
/// they have converged.
pub const REPORT: usize = 2;
/// Numbers of a row in the results: push, and two of friction.
pub const FORCES: usize = 3;

/// Problems in the arrays that a device reads.
///
/// A header has the places of its island in `words`, `numbers` and `results`, the numbers of its
/// bodies, groups, runs and rows, whether it has a guess, whether it has friction, and the numbers
/// of runs, rows and entries of matrices before it.
///
/// `words`: for each body and the end, the place of its groups in the last list; [`GROUP`] for each
/// group; [`RUN`] for each run; for each row, the row whose push limits its friction; the groups of
/// bodies, with one bit for the side of the body. `numbers`: [`SCALARS`]; [`BODY`] for each body;
/// the offset of each group; the [`field`]s of all rows. `results`: [`REPORT`]; six for each body;
/// [`FORCES`] arrays over the rows.
#[derive(Clone, Debug, Default)]
pub struct Packed {
    /// [`HEADER`] words for each problem.
    pub headers: Vec<[u32; HEADER]>,
    /// Of all problems.
    pub words: Vec<u32>,
    /// Of all problems.
    pub numbers: Vec<f64>,
    /// How many results there are.
    pub results: usize,
    /// How many rows there are.
    pub rows: usize,
    /// How many runs there are.
    pub runs: usize,
    /// How many entries the matrices of all have.
    pub entries: usize,
}

/// Rows that a thread sums up: whole bundles.
const ROWS_PER_RUN: usize = 8;

fn finite(bounds: Lanes) -> Lanes {
    bounds.map(|bound| bound.clamp(-UNBOUNDED, UNBOUNDED))
}

impl Packed {
    /// Adds a problem. Returns its number, or `None` where a device cannot solve it: it has nothing
    /// to solve, couplings, or too many bodies.
    pub fn add(&mut self, interior: &Interior<'_>, guess: Option<&Guess>) -> Option<usize> {
        let Interior { bodies, lines, .. } = interior;
        let count = bodies.target.len();
        let mut groups = Vec::with_capacity(lines.groups.len());
        for group in &lines.groups {
            let Group::Relative(relative) = group else { return None };
            groups.push(relative);
        }
        let violation = interior.greatest_violation();
        if count > BODIES || violation == 0.0 {
            return None;
        }
        let centre = guess.and_then(|(velocity, forces)| interior.centre_of(velocity, forces));
        let guess = guess.filter(|_| centre.is_some());
        let rows = WIDTH * lines.bundles.len();
        let [words_at, numbers_at, results_at] = [self.words.len(), self.numbers.len(), self.results];
        // The runs of a group follow each other.
        let mut batches: Vec<_> = lines.batches.iter().collect();
        batches.sort_by_key(|batch| batch.group);
        let (mut runs, mut ends) = (Vec::new(), vec![0; groups.len()]);
        for batch in batches {
            let (first, end) = (WIDTH * batch.bundles.start, WIDTH * batch.bundles.end);
            for at in (first..end).step_by(ROWS_PER_RUN) {
                let last = end.min(at + ROWS_PER_RUN);
                runs.push([at as u32, last as u32, u32::from(batch.slips), batch.group as u32]);
            }
            ends[batch.group] = runs.len() as u32;
        }
        let mut of_bodies = vec![Vec::new(); count];
        for (k, group) in (0..).zip(&groups) {
            of_bodies[group.body].push(2 * k);
            group.other.iter().for_each(|other| of_bodies[other.body].push(2 * k + 1));
        }
        let mut place = 0;
        self.words.push(place);
        for groups in &of_bodies {
            place += groups.len() as u32;
            self.words.push(place);
        }
        let mut first = 0;
        for (group, end) in groups.iter().zip(ends) {
            let other = group.other.map_or(NONE, |other| other.body as u32);
            // Each group has rows.
            self.words.extend([group.body as u32, other, first, end - first]);
            first = end;
        }
        self.words.extend(runs.iter().flatten());
        let pushing = |k: usize| (0..WIDTH).map(move |lane| (WIDTH * lines.pushing(k) + lane) as u32);
        self.words.extend((0..lines.bundles.len()).flat_map(pushing));
        self.words.extend(of_bodies.iter().flatten());

        let [bounds, least] = [interior.count_bounds() as f64, interior.least()];
        let balanced = interior.balanced();
        self.numbers.extend([bodies.time_step, bounds, least, violation, centre.unwrap_or(0.0), balanced]);
        for k in 0..count {
            let (m, inverse) = (&bodies.inertia[k], bodies.inverse[k].parts());
            let six = |m: &dyn Fn(usize, usize) -> f64| {
                [(0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)].map(|(i, j)| m(i, j))
            };
            self.numbers.push(m[(0, 0)]);
            self.numbers.extend(six(&|i, j| m[(3 + i, 3 + j)]));
            self.numbers.extend(six(&|i, j| inverse.1[(i, j)]));
            self.numbers.push(inverse.0);
            let target = &bodies.target[k];
            let begins = guess.map_or(target, |(velocity, _)| &velocity[k]);
            self.numbers.extend(target.iter().chain(begins));
            self.numbers.push(bodies.levers[k]);
        }
        self.numbers.extend(groups.iter().flat_map(|group| group.offset.to_array()));
        self.add_rows(&lines.bundles, guess.map(|(_, forces)| forces.as_slice()));

        let sizes = [words_at, numbers_at, results_at, count, groups.len(), runs.len(), rows];
        let mut header = [0; HEADER];
        for (to, size) in header.iter_mut().zip(sizes) {
            *to = u32::try_from(size).ok()?;
        }
        header[7] = u32::from(guess.is_some());
        header[8] = u32::from(interior.has_friction());
        for (to, size) in header[9..].iter_mut().zip([self.runs, self.rows, self.entries]) {
            *to = u32::try_from(size).ok()?;
        }
        self.headers.push(header);
        self.results += REPORT + 6 * count + FORCES * rows;
        self.rows += rows;
        self.runs += runs.len();
        self.entries += 36 * count * count;
        Some(self.headers.len() - 1)
    }

    fn add_rows(&mut self, bundles: &[Bundle], guess: Option<&[Forces]>) {
        let mut add = |of: &dyn Fn(usize, &Bundle) -> Lanes| {
            for (k, bundle) in bundles.iter().enumerate() {
                self.numbers.extend(of(k, bundle).0);
            }
        };
        (0..6).for_each(|i| add(&|_, bundle| bundle.normal[i]));
        add(&|_, bundle| bundle.gap);
        add(&|_, bundle| bundle.compliance);
        (0..2).for_each(|i| add(&|_, bundle| finite(bundle.bounds[i])));
        add(&|_, bundle| bundle.scale);
        for t in 0..2 {
            (0..6).for_each(|i| {
                add(&|_, bundle| bundle.slip.as_ref().map_or(Lanes::ZERO, |slip| slip.tangents[t][i]));
            });
        }
        (0..2).for_each(|t| add(&|_, bundle| bundle.slip.as_ref().map_or(Lanes::ZERO, |slip| slip.way[t])));
        add(&|_, bundle| bundle.slip.as_ref().map_or(Lanes::ZERO, |slip| slip.coefficient));
        add(&|_, bundle| bundle.slip.as_ref().map_or(Lanes::splat(1.0), |slip| slip.scale));
        let kept = |k: usize| guess.map_or(Forces::default(), |forces| forces[k]);
        add(&|k, _| kept(k).push);
        (0..2).for_each(|t| add(&|k, _| kept(k).friction[t]));
    }

    /// The solution of a problem in the results; `None` where it has not converged.
    pub fn solution(&self, problem: usize, results: &[f64]) -> Option<Solution> {
        let [_, _, at, bodies, _, _, rows, ..] = self.headers[problem].map(|word| word as usize);
        let results = &results[at..at + REPORT + 6 * bodies + FORCES * rows];
        if results[1] != 1.0 {
            return None;
        }
        let (velocity, of_rows) = results[REPORT..].split_at(6 * bodies);
        let velocity = velocity.chunks_exact(6).map(Vector6::from_column_slice).collect();
        let lanes = |array: usize, bundle: usize| {
            let mut lanes = Lanes::ZERO;
            let at = array * rows + WIDTH * bundle;
            lanes.0.copy_from_slice(&of_rows[at..at + WIDTH]);
            lanes
        };
        let forces = |k| Forces { push: lanes(0, k), friction: [lanes(1, k), lanes(2, k)] };
        let forces = (0..rows / WIDTH).map(forces).collect();
        Some(Solution::of_device(velocity, forces, results[0] as u32))
    }
}
