//! Finds the instances that can touch: instances of one world whose bounds overlap.
pub mod ahead;
pub mod kept;

use std::collections::BTreeMap;

use crate::collide::pairs::ahead::Ahead;
use crate::collide::scene::error::CollideError;
use crate::collide::scene::ids::InstanceId;
use crate::collide::scene::shape::Shape;
use crate::collide::scene::{Instance, Scene};
use crate::geometry::{Aabb, AabbTree};

/// Two instances whose bounds are within their contact distance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct InstancePair {
    /// The instance with the lower id.
    pub first: InstanceId,
    /// The instance with the higher id.
    pub second: InstanceId,
    /// The pair's contact distance: contacts are reported up to this signed distance at most, in
    /// the world's unit. It is that of the options, plus what the velocities of the two, relative
    /// to each other, can close within the speculative time.
    pub contact_distance: f64,
}

/// An instance in the search for pairs.
#[derive(Clone, Debug)]
pub struct Entry {
    /// The instance.
    pub id: InstanceId,
    /// Its own bounds.
    own: Aabb,
    /// The same, grown by half of the contact distance and by its motion. Those of a pair overlap.
    pub bounds: Aabb,
    /// Its motion within the speculative time.
    ahead: Ahead,
    /// Whether it is a plane, whose bounds are infinite.
    pub is_plane: bool,
}

/// Rounding error of the placement of a box, in ulps of its largest coordinate.
const ULPS: f64 = 8.0;

/// Worlds with more instances than this get a tree.
const FEW: usize = 16;

/// Largest number of pairs in a scene. With the data of the detection, this many pairs need some
/// GB.
pub const MAX_PAIRS: usize = 1 << 22;

/// All pairs that can touch, sorted by world and ids.
///
/// # Errors
/// [`CollideError::Instance`] names an instance whose shape is missing;
/// [`CollideError::TooManyPairs`].
pub fn instance_pairs(
    scene: &Scene,
    contact_distance: f64,
    speculative_time: f64,
) -> Result<Vec<InstancePair>, CollideError> {
    let mut worlds: BTreeMap<u32, Vec<(Entry, &Instance)>> = BTreeMap::new();
    for (id, instance) in scene.instances() {
        let entry = Entry::new(scene, id, instance, contact_distance, speculative_time)?;
        worlds.entry(instance.world).or_default().push((entry, instance));
    }
    let mut pairs = Vec::new();
    for entries in worlds.values() {
        let first = pairs.len();
        let mut offer = |i: usize, j: usize| {
            let ((a, x), (b, y)) = (&entries[i.min(j)], &entries[i.max(j)]);
            if let Some(pair) = Entry::pair(a, b, contact_distance)
                && scene.may_meet((a.id, x), (b.id, y))
            {
                pairs.push(pair);
            }
            pairs.len()
        };
        let within = |found: usize| match found <= MAX_PAIRS {
            true => Ok(()),
            false => Err(CollideError::TooManyPairs { limit: MAX_PAIRS }),
        };
        let planes: Vec<usize> = (0..entries.len()).filter(|&i| entries[i].0.is_plane).collect();
        let bodies: Vec<usize> = (0..entries.len()).filter(|&i| !entries[i].0.is_plane).collect();
        for &i in &planes {
            bodies.iter().try_for_each(|&j| within(offer(i, j)))?;
        }
        // Two still instances are no pair, so they are not offered where that saves the tree.
        let moving: Vec<bool> = entries.iter().map(|(entry, _)| !scene.is_still(entry.id)).collect();
        let few: Vec<usize> = bodies.iter().copied().filter(|&i| moving[i]).take(FEW + 1).collect();
        if few.len() <= FEW {
            for &i in &few {
                let others = bodies.iter().filter(|&&j| j > i || !moving[j]);
                others.into_iter().try_for_each(|&j| within(offer(i, j)))?;
            }
        } else {
            let boxes: Vec<Aabb> = bodies.iter().map(|&i| entries[i].0.bounds).collect();
            let tree = AabbTree::build(&boxes, 4);
            for (k, bounds) in boxes.iter().enumerate() {
                let mut found = 0;
                let later = |items: &[u32]| {
                    items
                        .iter()
                        .filter(|&&l| l as usize > k)
                        .for_each(|&l| found = offer(bodies[k], bodies[l as usize]));
                };
                tree.visit(|node| node.overlaps(*bounds), later);
                within(found)?;
            }
        }
        pairs[first..].sort_unstable_by_key(|p| (p.first, p.second));
    }
    Ok(pairs)
}

impl Entry {
    /// `instance` is that of the id.
    pub fn new(
        scene: &Scene,
        id: InstanceId,
        instance: &Instance,
        contact_distance: f64,
        speculative_time: f64,
    ) -> Result<Self, CollideError> {
        let shape = scene
            .shape(instance.shape)
            .map_err(|e| CollideError::Instance { instance: id.0, reason: e.to_string() })?;
        let ahead = Ahead::new(instance, shape, speculative_time);
        let own = instance.bounds(shape);
        // Without this, rounding could separate bounds that touch.
        let rounding = ULPS * f64::EPSILON * own.min.abs().max(own.max.abs()).max_element();
        let own = own.grown(rounding);
        let bounds = own.grown(0.5 * contact_distance + ahead.motion());
        Ok(Self { id, own, bounds, ahead, is_plane: matches!(shape, Shape::Plane) })
    }

    /// The bounds, grown by a share of their longest edge.
    pub fn wider(&self, share: f64) -> Aabb {
        match self.is_plane {
            true => self.bounds,
            false => self.bounds.grown(share * self.bounds.extent().max_element()),
        }
    }

    /// The pair of two entries, the lower id first, if their own bounds are within the pair's
    /// contact distance. Two planes are no pair.
    pub fn pair(a: &Self, b: &Self, contact_distance: f64) -> Option<InstancePair> {
        if !a.bounds.overlaps(b.bounds) || a.is_plane && b.is_plane {
            return None;
        }
        let contact_distance = contact_distance + a.ahead.closing(&b.ahead);
        let is_near = a.own.grown(contact_distance).overlaps(b.own);
        is_near.then_some(InstancePair { first: a.id, second: b.id, contact_distance })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::collide::scene::Scene;
    use crate::collide::scene::pose::Pose;

    #[test]
    fn more_pairs_than_the_memory_holds_are_refused() {
        let mut scene = Scene::new();
        let shape = scene.add_shape(Shape::Sphere { radius: 1.0 }).unwrap();
        // 2897 · 2896 / 2 pairs are slightly more than 2²².
        let ids: Vec<_> =
            (0..2897).map(|_| scene.add(Instance::new(shape, Pose::IDENTITY)).unwrap()).collect();
        let error = instance_pairs(&scene, 0.0, 0.0).unwrap_err();
        assert_eq!(error, CollideError::TooManyPairs { limit: MAX_PAIRS });
        scene.remove(&ids[..1]).unwrap();
        assert_eq!(instance_pairs(&scene, 0.0, 0.0).unwrap().len(), 2896 * 2895 / 2);
    }
}
