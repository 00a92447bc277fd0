//! How near a robot is to its obstacles and to itself.
use rayon::prelude::*;
use serde::Serialize;
use tesdf::collide::{self, LeastClearance, LeastClearanceOptions, Scene, least_clearance};
use tesdf::glam::DVec3;

use super::error::PlanningError;
use super::model::Robot;

/// The clearance of a robot at a configuration: the least signed distance between its links and the
/// obstacles, and between links that may not collide. Lengths are metres, in the world.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct RobotClearance {
    /// Negative where bodies overlap; infinite without a pair to look at. Between parts of bodies it
    /// is that of [`collide::clearance`]. It is never below the true value by more than rounding.
    pub distance: f64,
    /// The true value is between this and `distance`.
    pub lower_bound: f64,
    /// The pair that is nearest; of equally near ones the first that was found.
    pub nearest: Option<NearestPair>,
    /// Whether the error is within the tolerance.
    pub converged: bool,
}

/// The nearest pair of bodies.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct NearestPair {
    /// The numbers of the bodies, lower one first: a link, and a link or an obstacle.
    pub bodies: [usize; 2],
    /// The witness points, on the bodies in this order.
    pub points: [DVec3; 2],
    /// Unit vector from the second body to the first one.
    pub normal: DVec3,
    /// The derivatives of the distance by the configuration, m/rad or 1: those of the witness points,
    /// which move with their links, along the normal. Where other features become the nearest, the
    /// distance has a kink, and these are the derivatives on the side of the features that were found.
    /// Where bodies overlap and several faces are equally near to a witness, they are those of one
    /// face: a way out, and not the derivatives of the depth.
    pub gradient: Vec<f64>,
}

/// Tolerance of clearances that suits arms, m.
pub const TOLERANCE: f64 = 1e-6;

impl Robot {
    /// The clearance at a configuration, up to `tolerance`, m.
    ///
    /// # Errors
    /// A configuration that is not one, a tolerance that is not above 0, or bodies too far out.
    pub fn clearance(&self, q: &[f64], tolerance: f64) -> Result<RobotClearance, PlanningError> {
        self.clearance_in(&mut self.scene.clone(), q, tolerance)
    }

    /// Whether the clearance at a configuration is below `bound`, m. `false` is certain: the clearance
    /// is `bound` or more. `true` says that it is below `bound + tolerance`. Ends with the first pair
    /// that decides, so it takes less time than the clearance.
    ///
    /// # Errors
    /// As [`clearance`](Self::clearance).
    pub fn is_clearance_below(&self, q: &[f64], bound: f64, tolerance: f64) -> Result<bool, PlanningError> {
        self.is_below_in(&mut self.scene.clone(), q, bound, tolerance)
    }

    /// Whether bodies collide at a configuration: whether the clearance is below 0, up to
    /// `tolerance`, m, as [`is_clearance_below`](Self::is_clearance_below). `false` is certain.
    ///
    /// # Errors
    /// As [`clearance`](Self::clearance).
    pub fn in_collision(&self, q: &[f64], tolerance: f64) -> Result<bool, PlanningError> {
        self.is_clearance_below(q, 0.0, tolerance)
    }

    /// The clearances at many configurations, on all threads of the current rayon pool. The results
    /// are those of [`clearance`](Self::clearance), on any number of threads.
    ///
    /// # Errors
    /// That of the first row that has one, with its number.
    pub fn clearances<Q: AsRef<[f64]> + Sync>(
        &self,
        rows: &[Q],
        tolerance: f64,
    ) -> Result<Vec<RobotClearance>, PlanningError> {
        self.of_rows(rows, |scene, q| self.clearance_in(scene, q.as_ref(), tolerance))
    }

    /// As [`is_clearance_below`](Self::is_clearance_below), at many configurations, on all threads.
    ///
    /// # Errors
    /// That of the first row that has one, with its number.
    pub fn are_clearances_below<Q: AsRef<[f64]> + Sync>(
        &self,
        rows: &[Q],
        bound: f64,
        tolerance: f64,
    ) -> Result<Vec<bool>, PlanningError> {
        self.of_rows(rows, |scene, q| self.is_below_in(scene, q.as_ref(), bound, tolerance))
    }

    /// Answers rows on all threads, each in a scene of its own.
    pub(super) fn of_rows<R: Sync, T: Send>(
        &self,
        rows: &[R],
        answer: impl Fn(&mut Scene, &R) -> Result<T, PlanningError> + Sync,
    ) -> Result<Vec<T>, PlanningError> {
        let one = |scene: &mut Scene, (k, row): (usize, &R)| {
            answer(scene, row).map_err(|e| PlanningError::Row { row: k, source: Box::new(e) })
        };
        let found: Vec<_> = rows.par_iter().enumerate().map_init(|| self.scene.clone(), one).collect();
        found.into_iter().collect()
    }

    fn clearance_in(
        &self,
        scene: &mut Scene,
        q: &[f64],
        tolerance: f64,
    ) -> Result<RobotClearance, PlanningError> {
        self.check(q)?;
        let poses = self.chain.poses(q);
        self.place(scene, &poses)?;
        let options = LeastClearanceOptions { below: f64::INFINITY, enough: f64::NEG_INFINITY, tolerance };
        let LeastClearance { nearest, lower_bound, converged } =
            least_clearance(scene, &self.pairs, &options)?;
        let distance = nearest.map_or(f64::INFINITY, |(_, clearance)| clearance.distance);
        let nearest = nearest.map(|(pair, clearance)| {
            let collide::Clearance { point_a, point_b, normal, .. } = clearance;
            let bodies = self.bodies_of_pairs[pair];
            let mut gradient = vec![0.0; self.dof()];
            for (body, p, factor) in [(bodies[0], point_a, 1.0), (bodies[1], point_b, -1.0)] {
                if body < self.link_count() {
                    self.chain.add_derivatives(body, &poses, (p, normal), factor, &mut gradient);
                }
            }
            NearestPair { bodies, points: [point_a, point_b], normal, gradient }
        });
        Ok(RobotClearance { distance, lower_bound, nearest, converged })
    }

    pub(super) fn is_below_in(
        &self,
        scene: &mut Scene,
        q: &[f64],
        bound: f64,
        tolerance: f64,
    ) -> Result<bool, PlanningError> {
        self.check(q)?;
        if !bound.is_finite() {
            return Err(PlanningError::Argument(format!("bound: {bound}; expected a finite length, m")));
        }
        self.place(scene, &self.chain.poses(q))?;
        let below = bound + tolerance;
        let options = LeastClearanceOptions { below, enough: below, tolerance };
        let found = least_clearance(scene, &self.pairs, &options)?;
        Ok(found.nearest.is_some() || found.lower_bound < bound && !found.converged)
    }
}
