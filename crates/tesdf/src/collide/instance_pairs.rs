//! Which instances can touch: those of one world whose bounds meet.
use std::collections::BTreeMap;

use super::{CollideError, Instance, InstanceId, Scene, Shape, Velocity};
use crate::geometry::{Aabb, AabbTree};

/// Two instances whose bounds come within their contact distance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct InstancePair {
    /// The lower id.
    pub first: InstanceId,
    /// The higher id.
    pub second: InstanceId,
    /// Contacts count up to this signed distance, in the world's unit.
    pub contact_distance: f64,
}

struct Entry {
    id: InstanceId,
    bounds: Aabb,
    /// What it can move in the time ahead.
    motion: f64,
    is_plane: bool,
}

/// What placing a box may round, in ulps of its largest coordinate.
const ULPS: f64 = 8.0;

/// Worlds of more instances than this get a tree.
const FEW: usize = 16;

/// All pairs that can touch, sorted by world and ids.
///
/// # Errors
/// Names an instance whose shape is gone.
pub fn instance_pairs(
    scene: &Scene,
    contact_distance: f64,
    speculative_time: f64,
) -> Result<Vec<InstancePair>, CollideError> {
    let mut worlds: BTreeMap<u32, Vec<Entry>> = BTreeMap::new();
    for (id, instance) in scene.instances() {
        let shape = scene
            .shape(instance.shape)
            .map_err(|e| CollideError::Instance { instance: id.0, reason: e.to_string() })?;
        let is_plane = matches!(shape, Shape::Plane);
        let motion = instance.motion_ahead(shape, speculative_time);
        let bounds = scene.bounds(id)?;
        // Bounds that touch would lose each other by rounding.
        let rounding = ULPS * f64::EPSILON * bounds.min.abs().max(bounds.max.abs()).max_element();
        let bounds = bounds.grown(0.5 * contact_distance + motion + rounding);
        worlds.entry(instance.world).or_default().push(Entry { id, bounds, motion, is_plane });
    }
    let mut pairs = Vec::new();
    for entries in worlds.values() {
        let first = pairs.len();
        let mut offer = |i: usize, j: usize| {
            let (a, b) = (&entries[i.min(j)], &entries[i.max(j)]);
            let meet = |id| scene.instance(id).map(|instance| (id, instance));
            let (Ok(x), Ok(y)) = (meet(a.id), meet(b.id)) else { return };
            if a.bounds.overlaps(b.bounds) && !(a.is_plane && b.is_plane) && scene.may_meet(x, y) {
                let contact_distance = contact_distance + a.motion + b.motion;
                pairs.push(InstancePair { first: a.id, second: b.id, contact_distance });
            }
        };
        let planes: Vec<usize> = (0..entries.len()).filter(|&i| entries[i].is_plane).collect();
        let bodies: Vec<usize> = (0..entries.len()).filter(|&i| !entries[i].is_plane).collect();
        planes.iter().for_each(|&i| bodies.iter().for_each(|&j| offer(i, j)));
        if bodies.len() <= FEW {
            for (k, &i) in bodies.iter().enumerate() {
                bodies[k + 1..].iter().for_each(|&j| offer(i, j));
            }
        } else {
            let boxes: Vec<Aabb> = bodies.iter().map(|&i| entries[i].bounds).collect();
            let tree = AabbTree::build(&boxes, 4);
            for (k, bounds) in boxes.iter().enumerate() {
                let later = |items: &[u32]| {
                    items
                        .iter()
                        .filter(|&&l| l as usize > k)
                        .for_each(|&l| offer(bodies[k], bodies[l as usize]));
                };
                tree.visit(|node| node.overlaps(*bounds), later);
            }
        }
        pairs[first..].sort_unstable_by_key(|p| (p.first, p.second));
    }
    Ok(pairs)
}

impl Instance {
    /// How far the velocity can take a point of the instance in a time; `shape` is its shape.
    pub fn motion_ahead(&self, shape: &Shape, time: f64) -> f64 {
        if time > 0.0 {
            let arm = if matches!(shape, Shape::Plane) { 0.0 } else { reach(shape.bounds()) * self.scale };
            let Velocity { linear, angular } = self.velocity;
            time * (linear.length() + angular.length() * arm)
        } else {
            0.0
        }
    }
}

/// Greatest distance from the origin to a point of a box.
fn reach(bounds: Aabb) -> f64 {
    bounds.min.abs().max(bounds.max.abs()).length()
}
