//! The interior point method that finds the velocities and the forces of an island.
//!
//! In the units of the rows (`line.rs`), with the gap `g`, the push `l`, the slack `y` and the
//! friction `λ` of each contact, it solves
//!
//! ```text
//! M (v − v*) = Σ l Jₙᵀ + λ Jₜᵀ
//! y = g + Jₙ v + δ l,   y l = ν                           y, l > 0
//! λ t = −b u,   u = Jₜ v + way,   b = μ l,   t = a + r,   r = √(a² + u²),   a = max(ν / b, least)
//! ```
//!
//! for ν → 0. Then these are rigid contacts with Coulomb's friction: below the limit a contact
//! sticks, and above it slides with the force b against the slip. δ = 1 / κ∞ is tiny. Forces with
//! other bounds have a slack for each bound, and joints, whose forces have none, have `y = 0`.
//!
//! Each iteration is one of Newton's method, condensed to the velocities, with the predictor and
//! corrector of Mehrotra (*On the implementation of a primal-dual interior point method*, SIAM J.
//! Optim. 1992) and a correction of Gondzio (*Multiple centrality corrections*, 1996). With friction
//! the matrix is not symmetric, since b follows the push within the iteration. Without friction the
//! problem is convex, and its solution unique in the velocities. With friction nothing is proved:
//! an iteration that does not come to an end is done again with limits of friction that follow the
//! iterates and then stay, a convex problem, and those are corrected (lagged friction: Kaufman et
//! al., *Staggered projections for frictional contact in multibody systems*, 2008), accelerated, as
//! plain corrections of limits that vanish slow down (`anderson.rs`). From most of these solutions
//! the method of all comes to its end.
mod anderson;
pub mod constants;
mod iteration;
mod state;
mod sum;

use anderson::Anderson;
use constants::{BALANCED, COLD, CONVEX, LAGGED, LEAST_GAP, WARM};
use iteration::Iterate;
use nalgebra::Vector6;
use tesdf::base::elementary;

use super::lanes::Lanes;
use super::line::{Bodies, Bundle, Forces, Lines, Slips};
use super::pattern::Pattern;
use crate::Residual;

/// Bodies and the rows between them.
pub struct Interior<'a> {
    pub bodies: &'a Bodies,
    pub pattern: &'a Pattern,
    pub lines: &'a Lines,
}

/// Velocities of the bodies, and forces of the bundles.
pub type Guess = (Vec<Vector6<f64>>, Vec<Forces>);

/// Velocities and forces that were found.
#[derive(Clone, Debug)]
pub struct Solution {
    pub velocity: Vec<Vector6<f64>>,
    /// Of each bundle.
    pub forces: Vec<Forces>,
    /// Number of factorisations.
    pub iterations: u32,
    pub converged: bool,
    /// What it leaves, where it has not converged.
    pub residual: Residual,
    /// The fixed limits of friction; empty where they follow from the pushes.
    limits: Vec<Lanes>,
}

impl Solution {
    /// One that a device has found.
    pub fn of_device(velocity: Vec<Vector6<f64>>, forces: Vec<Forces>, iterations: u32) -> Self {
        let (residual, limits) = (Residual::default(), Vec::new());
        Self { velocity, forces, iterations, converged: true, residual, limits }
    }
}

/// What limits friction.
#[derive(Clone, Debug)]
enum Limits {
    /// The push of the same iterate: Coulomb's law.
    Coulomb,
    /// The push of the iterate before; once the iterates are near, that of then.
    Lagged,
    /// These, in the units of the slips, of each bundle.
    Fixed(Vec<Lanes>),
}

impl Limits {
    /// Those of bundle `k` with these pushes. They are not zero.
    #[inline(always)]
    fn of(&self, k: usize, slip: &Slips, push: Lanes) -> Lanes {
        let limits = match self {
            Self::Fixed(limits) => limits[k],
            Self::Coulomb | Self::Lagged => slip.coefficient * push,
        };
        limits.max(Lanes::splat(f64::EPSILON * f64::EPSILON))
    }
}

/// Most corrections of fixed limits of friction.
const CORRECTIONS: u32 = 32;
/// Fixed limits have settled when they differ from μ × push by less than this share, or their last
/// correction has moved no body by more than [`STILL`].
pub const LAG: f64 = 3e-3;
/// m
const STILL: f64 = 1e-8;
/// The corrections begin with this gap as the root of ν, m.
const CORRECTED_FROM: f64 = 1e-6;
/// After a correction, the limits follow the pushes again from this gap as the root of ν, m. In a heap
/// of boxes with a friction of 0.9, a quarter of the steps without a solution is left then.
const COULOMB_FROM: f64 = 1e-7;

/// From forces that are nearly right, ν begins with this multiple of what they are off.
const FIRST_WARM: f64 = 10.0;
/// Forces are nearly right when they are off by less, m. Bodies that hit each other may have several
/// solutions with friction: which one they find must not depend on what acted before.
const NEARLY: f64 = 1e-4;
/// The least gap as which they may be off, m.
const LEAST_WARM: f64 = 1e-9;

impl Interior<'_> {
    /// The solution, from velocities and forces that may be nearly right.
    pub fn solve(&self, guess: Option<Guess>) -> Solution {
        if self.greatest_violation() == 0.0 {
            let (velocity, forces) =
                (self.bodies.target.to_vec(), vec![Forces::default(); self.lines.bundles.len()]);
            let (residual, limits) = (Residual::default(), Vec::new());
            return Solution { velocity, forces, iterations: 0, converged: true, residual, limits };
        }
        let mut found = self.iterate(guess);
        if !found.converged {
            found.residual = self.residual(&found);
        }
        found
    }

    fn iterate(&self, guess: Option<Guess>) -> Solution {
        let mut iterations = 0;
        if let Some((velocity, forces)) = guess
            && let Some(centre) = self.centre_of(&velocity, &forces)
        {
            let found = Iterate::from(self, velocity, &forces, centre).descend(Limits::Coulomb, WARM);
            iterations += found.iterations;
            if found.converged {
                return found;
            }
        }
        let has_friction = self.has_friction();
        let mut found =
            Iterate::cold(self).descend(Limits::Coulomb, if has_friction { COLD } else { CONVEX });
        iterations += found.iterations;
        if found.converged || !has_friction {
            return Solution { iterations, ..found };
        }
        found = self.with_lagged_limits();
        Solution { iterations: iterations + found.iterations, ..found }
    }

    /// The solution with limits of friction that are corrected until they follow from the pushes, or
    /// until one that follows them is found from there.
    fn with_lagged_limits(&self) -> Solution {
        let mut found = Iterate::cold(self).descend(Limits::Lagged, LAGGED);
        let (mut iterations, mut corrections) = (found.iterations, 0);
        let mut lag = self.lag(&found);
        // The best one is told where none is good.
        let mut best = (f64::INFINITY, found.clone());
        let mut limits = Anderson::default();
        while lag >= LAG && corrections < CORRECTIONS {
            corrections += 1;
            let fixed = Limits::Fixed(limits.next(&found.limits, self.limits(&found.forces)));
            let centre = self.mean_square(CORRECTED_FROM);
            let before = found.velocity.clone();
            found = Iterate::from(self, found.velocity, &found.forces, centre).descend(fixed, LAGGED);
            iterations += found.iterations;
            let change: Vec<_> = found.velocity.iter().zip(&before).map(|(a, b)| a - b).collect();
            lag = if self.way(&change) < STILL { 0.0 } else { self.lag(&found) };
            if found.converged && lag < best.0 {
                best = (lag, found.clone());
            }
            if lag >= LAG {
                let centre = self.mean_square(COULOMB_FROM);
                let again = Iterate::from(self, found.velocity.clone(), &found.forces, centre)
                    .descend(Limits::Coulomb, WARM);
                iterations += again.iterations;
                if again.converged {
                    return Solution { iterations, ..again };
                }
            }
        }
        if lag >= LAG {
            found = Solution { converged: false, ..best.1 };
        }
        Solution { iterations, ..found }
    }

    /// Whether a row has friction.
    pub fn has_friction(&self) -> bool {
        self.lines.bundles.iter().any(|bundle| bundle.slip.is_some())
    }

    /// Each bundle with its number and the velocity of its group.
    fn bundles<'b>(
        &'b self,
        velocity: &'b [Vector6<f64>],
    ) -> impl Iterator<Item = (usize, &'b Bundle, [f64; 6])> + 'b {
        self.lines.batches.iter().flat_map(move |batch| {
            let relative = self.lines.groups[batch.group].of(velocity);
            batch.bundles.clone().map(move |k| (k, &self.lines.bundles[k], relative))
        })
    }

    /// The greatest gap that is to be closed.
    pub fn greatest_violation(&self) -> f64 {
        let of_bundle = |(_, bundle, relative): (usize, &Bundle, [f64; 6])| bundle.violation(&relative);
        self.bundles(&self.bodies.target).map(of_bundle).fold(0.0, f64::max)
    }

    /// Bound of the way of a point of a body in the step, m.
    fn way(&self, velocity: &[Vector6<f64>]) -> f64 {
        let way = |(v, lever): (&Vector6<f64>, &f64)| {
            v.fixed_rows::<3>(0).norm() + lever * v.fixed_rows::<3>(3).norm()
        };
        self.bodies.time_step * velocity.iter().zip(&self.bodies.levers).map(way).fold(0.0, greater)
    }

    /// The way that this momentum gives, m.
    fn way_of_momentum(&self, momentum: &[Vector6<f64>]) -> f64 {
        let rates: Vec<_> =
            self.bodies.inverse.iter().zip(momentum).map(|(inverse, p)| inverse.times(p)).collect();
        self.way(&rates)
    }

    /// The momentum that the motion without rows has more than `velocity`.
    fn lack(&self, velocity: &[Vector6<f64>]) -> Vec<Vector6<f64>> {
        self.bodies
            .inertia
            .iter()
            .zip(&self.bodies.target)
            .zip(velocity)
            .map(|((m, to), v)| m * (to - v))
            .collect()
    }

    /// The limits of friction that follow from the pushes.
    fn limits(&self, forces: &[Forces]) -> Vec<Lanes> {
        let limit = |(k, bundle): (usize, &Bundle)| {
            let push = forces[self.lines.pushing(k)].push;
            bundle.slip.as_ref().map_or(Lanes::ZERO, |slip| slip.coefficient * push)
        };
        self.lines.bundles.iter().enumerate().map(limit).collect()
    }

    /// How far fixed limits of friction, where they matter, are from μ × push, as a share of all:
    /// the greater one of sliding and torsional friction.
    fn lag(&self, at: &Solution) -> f64 {
        let mut laws = [(0.0, f64::MIN_POSITIVE); 2];
        self.visit_frictions(at, &mut |is_torsion, off, due| {
            let (excess, all) = &mut laws[usize::from(is_torsion)];
            *excess += off;
            *all += due;
        });
        laws.into_iter().map(|(excess, all)| excess / all).fold(0.0, greater)
    }

    /// Visits each friction: whether it is torsional, the impulse by which it differs from its law,
    /// and its limit by the push, N s or N m s.
    fn visit_frictions(&self, at: &Solution, visit: &mut impl FnMut(bool, f64, f64)) {
        let limits = self.limits(&at.forces);
        for (((bundle, forces), due), limit) in
            self.lines.bundles.iter().zip(&at.forces).zip(&limits).zip(&at.limits)
        {
            let Some(slip) = &bundle.slip else { continue };
            for lane in 0..bundle.rows().len() {
                let [due, limit, scale] = [due, limit, &slip.scale].map(|lanes| lanes.0[lane]);
                let size = elementary::hypot(forces.friction[0].0[lane], forces.friction[1].0[lane]);
                let slides = size > 0.999 * limit;
                let off = if slides { (due - limit).abs() } else { (size - due).max(0.0) };
                visit(slip.torsion.is_some(), scale * off, scale * due);
            }
        }
    }

    /// The mean square of a gap of `gap` metres over all bounds, in the units of the rows.
    fn mean_square(&self, gap: f64) -> f64 {
        let square = |bundle: &Bundle| {
            let of_row = |lane: usize| {
                bundle.count_bounds(lane) as f64 * elementary::powi(gap * bundle.scale.0[lane], 2)
            };
            (0..bundle.rows().len()).map(of_row).sum::<f64>()
        };
        self.lines.bundles.iter().map(square).sum::<f64>() / self.count_bounds().max(1) as f64
    }

    /// ν at the end.
    pub fn least(&self) -> f64 {
        self.mean_square(LEAST_GAP)
    }

    /// The way by which forces may be off with friction, m.
    pub fn balanced(&self) -> f64 {
        BALANCED[0] + BALANCED[1] * self.way(&self.bodies.target)
    }

    /// Number of bounds of all forces.
    pub fn count_bounds(&self) -> usize {
        let of_bundle =
            |bundle: &Bundle| (0..bundle.rows().len()).map(|k| bundle.count_bounds(k)).sum::<usize>();
        self.lines.bundles.iter().map(of_bundle).sum()
    }

    /// How far velocities and forces are from a solution.
    fn residual(&self, at: &Solution) -> Residual {
        let Solution { velocity, forces, .. } = at;
        let mut momentum = self.lack(velocity);
        let (mut worst, mut of_friction) = (0.0, 0.0);
        self.visit_frictions(at, &mut |_, off, _| of_friction = greater(off, of_friction));
        for batch in &self.lines.batches {
            let group = &self.lines.groups[batch.group];
            let (relative, mut acting) = (group.of(velocity), [Lanes::ZERO; 6]);
            for k in batch.bundles.clone() {
                let (bundle, forces) = (&self.lines.bundles[k], &forces[k]);
                bundle.act(forces.push, forces.friction, &mut acting);
                let gap = bundle.left(&relative, forces.push);
                for lane in 0..bundle.rows().len() {
                    worst = greater(bundle.off(lane, gap, forces.push), worst);
                }
            }
            group.act(acting.map(Lanes::sum), &mut momentum);
        }
        let force = |p: &Vector6<f64>| p.fixed_rows::<3>(0).norm() / self.bodies.time_step;
        Residual {
            way: greater(self.way_of_momentum(&momentum), worst),
            force: momentum.iter().map(force).fold(of_friction / self.bodies.time_step, greater),
        }
    }

    /// ν for velocities and forces that are nearly right: that of the gaps that are left where a
    /// force is within its bounds, and of the ways by which forces are off. Returns `None` where
    /// these are not nearly right.
    pub fn centre_of(&self, velocity: &[Vector6<f64>], forces: &[Forces]) -> Option<f64> {
        let (mut products, mut count, mut worst) = (0.0, 0.0, LEAST_WARM);
        for (k, bundle, relative) in self.bundles(velocity) {
            let push = forces[k].push;
            let gap = bundle.left(&relative, push);
            for lane in (0..bundle.rows().len()).filter(|&lane| bundle.count_bounds(lane) > 0) {
                worst = f64::max(worst, bundle.off(lane, gap, push));
                let [low, high] = bundle.bounds.map(|bound| bound.0[lane]);
                let (gap, push) = (gap.0[lane], push.0[lane]);
                let is_low = high == f64::INFINITY || gap > 0.0 && low > f64::NEG_INFINITY;
                let room = if is_low { push - low } else { high - push };
                products += (gap * room).abs();
                count += 1.0;
            }
        }
        let centre = FIRST_WARM * (products / f64::max(count, 1.0)).max(self.mean_square(worst));
        (worst < NEARLY).then_some(centre)
    }
}

/// The greater one, or NaN where one is.
fn greater(a: f64, b: f64) -> f64 {
    if a > b || a.is_nan() { a } else { b }
}
