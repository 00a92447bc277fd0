//! The deepest penetration of many pairs, without the clearance of each.
use serde::{Deserialize, Serialize};

use crate::collide::clearance::Clearance;
use crate::collide::clearance::{Pair, Surface};
use crate::collide::scene::Scene;
use crate::collide::scene::error::CollideError;
use crate::collide::scene::ids::InstanceId;
use crate::collide::search::lowest_point::{Below, Order, least_below};

/// Which penetrations are of interest. Lengths are in the world's unit.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct PenetrationOptions {
    /// Only pairs deeper than this are of interest: a depth that is already known, or 0. The less
    /// remains above it, the less is searched.
    pub above: f64,
    /// Bound of the error of a depth. Rounding comes in addition: about 1e-15 of the largest
    /// coordinate.
    pub tolerance: f64,
}

/// The deepest penetration of several pairs.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct DeepestPenetration {
    /// The deepest pair: its number, and its [`clearance`](crate::collide::clearance()), whose distance is
    /// minus the depth. The depth is never above the true one by more than rounding. `None` when no
    /// pair is deeper than asked for by more than the tolerance.
    pub deepest: Option<(usize, Clearance)>,
    /// No pair is deeper than this, m. When `converged`, it is the greater of the depth and of that
    /// asked for, plus the tolerance.
    pub upper_bound: f64,
    /// Whether the error is within the tolerance. False when a difficult search was cut short.
    pub converged: bool,
}

/// Pairs that are searched together, so that memory does not grow with their number.
const TOGETHER: usize = 1 << 10;

/// The deepest of several pairs of instances, whatever their worlds, groups and exclusions. Each
/// depth is that of the [`clearance`](crate::collide::clearance()).
///
/// One best-first search goes over the face trees of all pairs together, and leaves out all that
/// cannot be deeper than the deepest point so far. So it takes a small part of the time that the
/// clearances of all pairs take. The result is the same for any number of threads.
///
/// ```
/// use tesdf::collide::{Instance, PenetrationOptions, Pose, Scene, Shape, deepest_penetration};
/// use tesdf::glam::DVec3;
///
/// let mut scene = Scene::new();
/// let cube = scene.add_shape(Shape::Box { half_extents: DVec3::ONE })?;
/// let mut at = |x| scene.add(Instance::new(cube, Pose::at(DVec3::new(x, 0.0, 0.0))));
/// let (a, b, c) = (at(0.0)?, at(1.875)?, at(3.5)?);
/// let options = PenetrationOptions { above: 0.0, tolerance: 1e-6 };
/// let found = deepest_penetration(&scene, &[[a, b], [b, c], [a, c]], &options)?;
/// let (pair, clearance) = found.deepest.expect("a pair that overlaps");
/// assert_eq!((pair, clearance.distance), (1, -0.375));
/// # Ok::<(), tesdf::collide::CollideError>(())
/// ```
///
/// # Errors
/// As [`clearance`](crate::collide::clearance()), and [`CollideError::Option`] for a depth below 0.
pub fn deepest_penetration(
    scene: &Scene,
    pairs: &[[InstanceId; 2]],
    options: &PenetrationOptions,
) -> Result<DeepestPenetration, CollideError> {
    let PenetrationOptions { above, tolerance } = *options;
    let refused =
        |option, found: f64, expected| CollideError::Option { option, found: found.to_string(), expected };
    if !(tolerance > 0.0 && tolerance.is_finite()) {
        return Err(refused("tolerance", tolerance, "a finite number greater than 0"));
    }
    if !(above >= 0.0 && above.is_finite()) {
        return Err(refused("above", above, "a finite number, 0 or greater"));
    }
    let mut found = DeepestPenetration { deepest: None, upper_bound: above + tolerance, converged: true };
    for (k, together) in pairs.chunks(TOGETHER).enumerate() {
        let known = found.deepest.map_or(above, |(_, clearance)| -clearance.distance);
        let next = of_pairs(scene, together, known, tolerance)?;
        found.upper_bound = found.upper_bound.max(next.upper_bound);
        found.converged &= next.converged;
        if let Some((pair, clearance)) = next.deepest {
            found.deepest = Some((k * TOGETHER + pair, clearance));
        }
    }
    Ok(found)
}

/// The deepest pair, where a depth `known` has been found elsewhere.
fn of_pairs(
    scene: &Scene,
    pairs: &[[InstanceId; 2]],
    known: f64,
    tolerance: f64,
) -> Result<DeepestPenetration, CollideError> {
    let pairs: Vec<Pair> =
        pairs.iter().map(|&[a, b]| Pair::new(scene, a, b)).collect::<Result<_, CollideError>>()?;
    let (mut places, mut orders): (Vec<(usize, Surface)>, Vec<Order>) = Default::default();
    for (k, pair) in pairs.iter().enumerate() {
        for (of, order) in pair.surfaces() {
            if !order.has_distances() {
                return Err(pair.too_far());
            }
            places.push((k, of));
            orders.push(order);
        }
    }
    // A point that is known to be inside needs no distance outside. So half of the tolerance is
    // for those that are as good as outside.
    let start = known.max(0.5 * tolerance);
    let rest = known + tolerance - start;
    let Below { least, lower_bound, converged } = least_below(&orders, rest, -start);
    let deepest = least.map(|least| {
        let (pair, of) = places[least.order];
        (pair, pairs[pair].witnesses(of, &orders[least.order], &least, rest))
    });
    Ok(DeepestPenetration { deepest, upper_bound: -lower_bound, converged })
}
