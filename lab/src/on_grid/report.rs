use std::collections::BTreeSet;

use serde::Serialize;
use tesdf::glam::DVec3;

use super::Grid;

/// How exact an asset is at those points of a grid that lie in its domain.
///
/// Lengths are in the mesh's unit. Points in no cell are only counted. Points of cells without a
/// list are answered by the asset's own face tree and count like all others.
///
/// A *band* is a fraction of [`max_inside`](Self::max_inside), at most 1. It is the largest
/// fraction such that the error stays within a bound at all points nearer to the surface than that,
/// on both sides.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct BandReport {
    /// Side length of a voxel.
    pub voxel: f64,
    /// Grid points in the domain; these are compared.
    pub points: u64,
    /// Compared points inside the solid.
    pub points_inside: u64,
    /// Compared points that the asset's face tree answers.
    pub points_by_tree: u64,
    /// Grid points in no cell of the domain.
    pub points_outside: u64,
    /// Points with an error above [`exact`](Self::exact).
    pub points_inexact: u64,
    /// Cells that contain such a point.
    pub cells_inexact: usize,
    /// Errors up to this value count as zero.
    pub exact: f64,
    /// Largest exact |φ| of the compared points inside.
    pub max_inside: f64,
    /// Largest exact |φ| of all compared points.
    pub max_domain: f64,
    /// Largest |φ of the asset − exact φ|.
    pub max_error: f64,
    /// The first point with the largest error.
    pub max_error_at: Option<DVec3>,
    /// `max_error` in percent of `max_inside`; `None` when the grid is so coarse that no point is
    /// inside.
    pub max_error_percent: Option<f64>,
    /// `max_error` in percent of `max_domain`.
    pub max_error_percent_of_domain: Option<f64>,
    /// Band in which no error is above [`exact`](Self::exact).
    pub exactness_band: Option<f64>,
    /// Width of the exactness band on each side of the surface.
    pub exactness_width: f64,
    /// Band in which no error is above 1 % of `max_inside`.
    pub one_percent_band: Option<f64>,
    /// Width of the 1 % band on each side of the surface.
    pub one_percent_width: f64,
}

impl BandReport {
    pub(super) fn new(tally: Tally, grid: &Grid, exact: f64) -> Self {
        let Tally { points, points_inside, points_by_tree, points_outside, points_inexact, .. } = tally;
        let share = |of: f64, whole: f64| (whole > 0.0).then_some(of / whole);
        let percent = |whole| share(tally.max_error, whole).map(|s| 100.0 * s);
        let width = |bound| tally.front.least_distance(bound).min(tally.max_inside);
        let (exactness_width, one_percent_width) = (width(exact), width(0.01 * tally.max_inside));
        Self {
            voxel: grid.voxel,
            points,
            points_inside,
            points_by_tree,
            points_outside,
            points_inexact,
            cells_inexact: tally.cells_inexact.len(),
            exact,
            max_inside: tally.max_inside,
            max_domain: tally.max_domain,
            max_error: tally.max_error,
            max_error_at: tally.max_error_at,
            max_error_percent: percent(tally.max_inside),
            max_error_percent_of_domain: percent(tally.max_domain),
            exactness_band: share(exactness_width, tally.max_inside),
            exactness_width,
            one_percent_band: share(one_percent_width, tally.max_inside),
            one_percent_width,
        }
    }
}

/// Sums and maxima over a part of the grid. Parts are joined in the order of the grid.
#[derive(Clone, Debug, Default)]
pub(super) struct Tally {
    points: u64,
    points_inside: u64,
    points_by_tree: u64,
    points_outside: u64,
    points_inexact: u64,
    cells_inexact: BTreeSet<u32>,
    max_inside: f64,
    max_domain: f64,
    max_error: f64,
    max_error_at: Option<DVec3>,
    front: Front,
}

impl Tally {
    /// Counts a point in no cell.
    pub fn outside(&mut self) {
        self.points_outside += 1;
    }

    /// Adds a point of the domain with its exact signed distance.
    pub fn add(&mut self, p: DVec3, exact: f64, error: f64, by_tree: bool) {
        self.points += 1;
        self.points_by_tree += u64::from(by_tree);
        self.max_domain = self.max_domain.max(exact.abs());
        if exact < 0.0 {
            self.points_inside += 1;
            self.max_inside = self.max_inside.max(-exact);
        }
        if error > self.max_error {
            (self.max_error, self.max_error_at) = (error, Some(p));
        }
    }

    /// Adds the same point, of this cell, to the inexact points.
    pub fn add_inexact(&mut self, cell: u32, exact: f64, error: f64) {
        self.points_inexact += 1;
        self.cells_inexact.insert(cell);
        self.front.insert(exact.abs(), error);
    }

    pub fn join(mut self, other: Self) -> Self {
        if other.max_error > self.max_error {
            (self.max_error, self.max_error_at) = (other.max_error, other.max_error_at);
        }
        self.points += other.points;
        self.points_inside += other.points_inside;
        self.points_by_tree += other.points_by_tree;
        self.points_outside += other.points_outside;
        self.points_inexact += other.points_inexact;
        self.cells_inexact.extend(other.cells_inexact);
        self.max_inside = self.max_inside.max(other.max_inside);
        self.max_domain = self.max_domain.max(other.max_domain);
        other.front.0.into_iter().for_each(|(distance, error)| self.front.insert(distance, error));
        self
    }
}

/// Pareto front of (distance from the surface, error): a point is kept when no nearer point has an
/// error at least as large. Both values ascend.
///
/// The 1 % bound is known only at the end, so the front gives the least distance for every error
/// bound.
#[derive(Clone, Debug, Default, PartialEq)]
struct Front(Vec<(f64, f64)>);

impl Front {
    fn insert(&mut self, distance: f64, error: f64) {
        let nearer = self.0.partition_point(|&(d, _)| d <= distance);
        if nearer > 0 && self.0[nearer - 1].1 >= error {
            return;
        }
        let from = self.0.partition_point(|&(d, _)| d < distance);
        let beaten = self.0[from..].iter().take_while(|&&(_, e)| e <= error).count();
        self.0.splice(from..from + beaten, [(distance, error)]);
    }

    /// The least distance from the surface with an error above `bound`; infinite when there is
    /// none.
    fn least_distance(&self, bound: f64) -> f64 {
        let at = self.0.partition_point(|&(_, e)| e <= bound);
        self.0.get(at).map_or(f64::INFINITY, |&(d, _)| d)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn the_front_has_the_least_distance_for_every_error_bound(
            points in proptest::collection::vec((0u8..20, 0u8..20), 0..60),
            split in 0usize..60,
        ) {
            let points: Vec<(f64, f64)> = points.into_iter().map(|(d, e)| (d.into(), e.into())).collect();
            let tally = |points: &[(f64, f64)]| {
                let mut tally = Tally::default();
                points.iter().for_each(|&(d, e)| tally.add_inexact(0, d, e));
                tally
            };
            let (left, right) = points.split_at(split.min(points.len()));
            let front = tally(left).join(tally(right)).front;
            prop_assert_eq!(&front, &tally(&points).front);
            for bound in (0..41).map(|b| f64::from(b) / 2.0 - 0.25) {
                let least = points.iter().filter(|p| p.1 > bound).map(|p| p.0).fold(f64::INFINITY, f64::min);
                prop_assert_eq!(front.least_distance(bound), least);
            }
        }
    }
}
