//! The least clearance of many pairs, and whether one is below a bound.
use serde::{Deserialize, Serialize};

use crate::collide::clearance::{Clearance, Pair, Surface};
use crate::collide::scene::Scene;
use crate::collide::scene::error::CollideError;
use crate::collide::scene::ids::InstanceId;
use crate::collide::search::lowest_point::{Below, Order, least_until};

/// Which clearances are of interest. Lengths are in the world's unit.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct LeastClearanceOptions {
    /// Only clearances below this are of interest; infinite for all. The less it is, the less is
    /// searched.
    pub below: f64,
    /// The search ends with the first clearance up to this; minus infinity for the least one. To
    /// know whether any clearance is below a bound, give that bound here and in `below`.
    pub enough: f64,
    /// Bound of the error. Rounding comes in addition: about 1e-15 of the largest coordinate.
    pub tolerance: f64,
}

/// The least clearance of several pairs.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct LeastClearance {
    /// The nearest pair: its number, and its [`clearance`](crate::collide::clearance()). `None` when no
    /// clearance is below the one asked for by more than the tolerance. Its `overlap` does not test
    /// surfaces that coincide.
    pub nearest: Option<(usize, Clearance)>,
    /// No clearance is below this. When `converged`, it is the lesser of the distance found and of
    /// the bound asked for, minus the tolerance.
    pub lower_bound: f64,
    /// Whether the error is within the tolerance. False when the search ended early, or a difficult
    /// one was cut short.
    pub converged: bool,
}

/// The least clearance of several pairs of instances, whatever their worlds, groups and exclusions.
///
/// Pairs are searched in the order of the gaps between their boxes, and those are left out that
/// cannot be nearer than the nearest pair so far. The result is the same for any number of threads.
///
/// ```
/// use tesdf::collide::{Instance, LeastClearanceOptions, Pose, Scene, Shape, least_clearance};
/// use tesdf::glam::DVec3;
///
/// let mut scene = Scene::new();
/// let cube = scene.add_shape(Shape::Box { half_extents: DVec3::ONE })?;
/// let mut at = |x| scene.add(Instance::new(cube, Pose::at(DVec3::new(x, 0.0, 0.0))));
/// let (a, b, c) = (at(0.0)?, at(5.0)?, at(7.5)?);
/// let all = LeastClearanceOptions { below: f64::INFINITY, enough: f64::NEG_INFINITY, tolerance: 1e-6 };
/// let found = least_clearance(&scene, &[[a, b], [b, c]], &all)?;
/// let (pair, clearance) = found.nearest.expect("a clearance");
/// assert_eq!((pair, clearance.distance), (1, 0.5));
/// // No pair is nearer than 0.25.
/// let near = LeastClearanceOptions { below: 0.25, enough: 0.25, ..all };
/// assert_eq!(least_clearance(&scene, &[[a, b], [b, c]], &near)?.nearest, None);
/// # Ok::<(), tesdf::collide::CollideError>(())
/// ```
///
/// # Errors
/// As [`clearance`](crate::collide::clearance()), and [`CollideError::Option`] for a bound that is not a
/// number.
pub fn least_clearance(
    scene: &Scene,
    pairs: &[[InstanceId; 2]],
    options: &LeastClearanceOptions,
) -> Result<LeastClearance, CollideError> {
    let LeastClearanceOptions { below, enough, tolerance } = *options;
    let refused =
        |option, found: f64, expected| CollideError::Option { option, found: found.to_string(), expected };
    if !(tolerance > 0.0 && tolerance.is_finite()) {
        return Err(refused("tolerance", tolerance, "a finite number greater than 0"));
    }
    for (option, bound) in [("below", below), ("enough", enough)] {
        if bound.is_nan() {
            return Err(refused(option, bound, "a number"));
        }
    }
    let mut nearby = Vec::new();
    for (k, &[a, b]) in pairs.iter().enumerate() {
        let pair = Pair::new(scene, a, b)?;
        let gap = pair.gap();
        if gap < below {
            nearby.push((gap, k, pair));
        }
    }
    nearby.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    let mut found = LeastClearance { nearest: None, lower_bound: below, converged: true };
    let mut known = below;
    for (i, (gap, k, pair)) in nearby.iter().enumerate() {
        if *gap >= known - tolerance {
            break;
        }
        let (next, bounds) = pair.least_until(known, enough, tolerance)?;
        found.lower_bound = found.lower_bound.min(bounds.lower_bound);
        found.converged &= bounds.converged;
        if let Some(next) = next {
            known = next.distance;
            found.nearest = Some((*k, next));
            if known <= enough {
                let rest = nearby.get(i + 1).map_or(f64::INFINITY, |(gap, ..)| *gap);
                found.lower_bound = found.lower_bound.min(rest);
                found.converged &= rest >= known - tolerance;
                break;
            }
        }
    }
    found.lower_bound = found.lower_bound.min(known - tolerance);
    Ok(found)
}

impl Pair<'_> {
    /// The clearance, if it is below `below`, or one up to `enough`; and what is known of the least
    /// one.
    fn least_until(
        &self,
        below: f64,
        enough: f64,
        tolerance: f64,
    ) -> Result<(Option<Clearance>, Below), CollideError> {
        self.check_distances()?;
        let (surfaces, orders): (Vec<Surface>, Vec<Order>) = self.surfaces().into_iter().unzip();
        if below.is_finite() && self.rough_bound(below) >= below {
            return Ok((None, Below { least: None, lower_bound: below, converged: true }));
        }
        let found = least_until(&orders, tolerance, below, enough);
        let clearance = found
            .least
            .map(|least| self.witnesses(surfaces[least.order], &orders[least.order], &least, tolerance));
        Ok((clearance, found))
    }
}
