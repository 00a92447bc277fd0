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
//! iterates and then stay, a convex problem, and those are corrected a few times (lagged friction:
//! Kaufman et al., *Staggered projections for frictional contact in multibody systems*, 2008).
mod iteration;

use iteration::Run;
use nalgebra::Vector6;

use super::line::{Bodies, Force, Line, Slip};
use super::linear::Pattern;

/// Bodies and the rows between them.
pub struct Interior<'a> {
    pub bodies: &'a Bodies,
    pub pattern: &'a Pattern,
    pub lines: Vec<&'a Line>,
}

/// Velocities and forces that were found.
#[derive(Clone, Debug)]
pub struct Solution {
    pub velocity: Vec<Vector6<f64>>,
    pub forces: Vec<Force>,
    /// Number of factorisations.
    pub iterations: u32,
    pub converged: bool,
    /// The fixed limits of friction; empty where they follow from the pushes.
    limits: Vec<f64>,
}

/// What limits friction.
#[derive(Clone, Debug)]
enum Limits {
    /// The push of the same iterate: Coulomb's law.
    Coulomb,
    /// The push of the iterate before; once the iterates are near, that of then.
    Lagged,
    /// These, in the units of the slips.
    Fixed(Vec<f64>),
}

impl Limits {
    /// That of row `k` with this push.
    fn of(&self, k: usize, slip: &Slip, push: f64) -> f64 {
        match self {
            Self::Fixed(limits) => limits[k].max(f64::EPSILON * f64::EPSILON),
            Self::Coulomb | Self::Lagged => slip.coefficient * push,
        }
    }
}

/// How long a run tries.
#[derive(Clone, Copy, Debug)]
struct Effort {
    /// Most iterations.
    iterations: u32,
    /// It ends after so many short steps in a row.
    short_steps: u32,
    /// The first of [`WIDTHS`].
    width: usize,
}

/// From forces that are nearly right.
const WARM: Effort = Effort { iterations: 14, short_steps: 2, width: 1 };
/// From no forces.
const COLD: Effort = Effort { iterations: 30, short_steps: 3, width: 0 };
/// The same without friction: convex, so short steps pass.
const CONVEX: Effort = Effort { iterations: 100, short_steps: u32::MAX, width: 0 };
/// With lagged limits.
const LAGGED: Effort = Effort { iterations: 50, short_steps: u32::MAX, width: 0 };

/// Most corrections of fixed limits of friction.
const CORRECTIONS: u32 = 4;
/// Fixed limits have settled when they differ from μ × push by less than this share, or their last
/// correction has moved no body by more than [`STILL`].
pub const LAG: f64 = 3e-3;
/// m
const STILL: f64 = 1e-8;
/// The corrections begin with this gap as the root of ν, m.
const CORRECTED_FROM: f64 = 1e-6;

/// From forces that are nearly right, ν begins with this multiple of what they are off.
const FIRST_WARM: f64 = 10.0;
/// The least gap as which they may be off, m.
const LEAST_WARM: f64 = 1e-9;
/// Forces are nearly right when they are off by less, m.
const NEARLY: f64 = 1e-3;

/// The least `a`, m: that with which the method converges, and that of the solution. The way by
/// which a contact creeps in a step before it sticks.
const WIDTHS: [f64; 2] = [1e-10, 1e-12];

impl Interior<'_> {
    /// The solution, from velocities and forces that may be nearly right.
    pub fn solve(&self, guess: Option<(Vec<Vector6<f64>>, Vec<Force>)>) -> Solution {
        if self.lines.iter().all(|line| line.violation(&self.bodies.target) == 0.0) {
            let (velocity, forces) = (self.bodies.target.to_vec(), vec![Force::default(); self.lines.len()]);
            return Solution { velocity, forces, iterations: 0, converged: true, limits: Vec::new() };
        }
        let mut iterations = 0;
        if let Some((velocity, forces)) = guess.filter(|(v, forces)| self.misfit(v, forces) < NEARLY) {
            let centre = self.centre_of(&velocity, &forces);
            let found = Run::from(self, velocity, &forces, centre).descend(Limits::Coulomb, WARM);
            iterations += found.iterations;
            if found.converged {
                return found;
            }
        }
        let has_friction = self.has_friction();
        let mut found = Run::cold(self).descend(Limits::Coulomb, if has_friction { COLD } else { CONVEX });
        iterations += found.iterations;
        if found.converged || !has_friction {
            return Solution { iterations, ..found };
        }
        found = Run::cold(self).descend(Limits::Lagged, LAGGED);
        iterations += found.iterations;
        let mut corrections = 0;
        while self.lag(&found) >= LAG {
            if corrections == CORRECTIONS {
                found.converged = false;
                break;
            }
            corrections += 1;
            let limits = Limits::Fixed(self.limits(&found.forces));
            let centre = self.mean_square(CORRECTED_FROM);
            let before = found.velocity.clone();
            found = Run::from(self, found.velocity, &found.forces, centre).descend(limits, LAGGED);
            iterations += found.iterations;
            let change: Vec<_> = found.velocity.iter().zip(&before).map(|(a, b)| a - b).collect();
            if self.way(&change) < STILL {
                break;
            }
        }
        Solution { iterations, ..found }
    }

    fn has_friction(&self) -> bool {
        self.lines.iter().any(|line| line.slip.is_some())
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
            self.bodies.inverse.iter().zip(momentum).map(|(inverse, p)| inverse * p).collect();
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
    fn limits(&self, forces: &[Force]) -> Vec<f64> {
        let limit = |(line, force): (&&Line, &Force)| {
            line.slip.as_ref().map_or(0.0, |slip| slip.coefficient * force.push)
        };
        self.lines.iter().zip(forces).map(limit).collect()
    }

    /// How far fixed limits of friction, where they matter, are from μ × push, as a share of all.
    fn lag(&self, at: &Solution) -> f64 {
        let (mut excess, mut all) = (0.0, f64::MIN_POSITIVE);
        for (((line, force), due), limit) in
            self.lines.iter().zip(&at.forces).zip(self.limits(&at.forces)).zip(&at.limits)
        {
            if let Some(slip) = &line.slip {
                let size = force.friction[0].hypot(force.friction[1]);
                let slides = size > 0.999 * limit;
                excess += slip.scale * if slides { (due - limit).abs() } else { (size - due).max(0.0) };
                all += slip.scale * due;
            }
        }
        excess / all
    }

    /// The mean square of a gap of `gap` metres over all bounds, in the units of the rows.
    fn mean_square(&self, gap: f64) -> f64 {
        let square = |line: &&Line| line.count_bounds() as f64 * (gap * line.scale).powi(2);
        self.lines.iter().map(square).sum::<f64>() / self.count_bounds().max(1) as f64
    }

    fn count_bounds(&self) -> usize {
        self.lines.iter().map(|line| line.count_bounds()).sum()
    }

    /// How far velocities and forces are from a solution without friction's law, m.
    fn misfit(&self, velocity: &[Vector6<f64>], forces: &[Force]) -> f64 {
        let mut momentum = self.lack(velocity);
        let mut worst = 0.0;
        for (line, force) in self.lines.iter().zip(forces) {
            line.act(force.push, force.friction, &mut momentum);
            // A force is right when a spring that keeps it finds it again.
            let again = (force.push - line.at(velocity)).max(line.bounds[0]).min(line.bounds[1]);
            worst = greater((again - force.push).abs() / line.scale, worst);
        }
        greater(self.way_of_momentum(&momentum), worst)
    }

    /// ν for velocities and forces that are nearly right.
    fn centre_of(&self, velocity: &[Vector6<f64>], forces: &[Force]) -> f64 {
        let bounded = self.lines.iter().zip(forces).filter(|(line, _)| line.count_bounds() > 0);
        let (products, count) = bounded.fold((0.0, 0.0), |(sum, count), (line, force)| {
            (sum + (line.at(velocity) * force.push).abs(), count + 1.0)
        });
        FIRST_WARM * f64::max(products / f64::max(count, 1.0), self.mean_square(LEAST_WARM))
    }
}

/// The greater one, or NaN where one is.
fn greater(a: f64, b: f64) -> f64 {
    if a > b || a.is_nan() { a } else { b }
}
