//! How far the detections at the beginning of a step have looked, pair by pair.
use std::collections::BTreeMap;

use tesdf::collide::{CollideError, CollideOptions, Contacts, InstanceId, Scene, instance_pairs};

/// Two instances, the lower id first.
pub type Pair = (InstanceId, InstanceId);

/// The contacts of one or more detections at the same poses, which looked ahead by different
/// velocities.
pub struct Look {
    /// For each pair, those of the detection that looked farthest.
    pub contacts: Contacts,
    /// The contact distances of all pairs that were tested, m.
    distances: BTreeMap<Pair, f64>,
}

impl Look {
    /// `contacts` are those of a scene with these options.
    pub fn new(contacts: Contacts, scene: &Scene, options: &CollideOptions) -> Result<Self, CollideError> {
        let distances = distances(scene, options.contact_distance, options.speculative_time)?;
        Ok(Self { contacts, distances })
    }

    /// The pairs that the velocities of `scene` bring closer in `time` than was looked. Their
    /// relative velocity has changed: of two bodies that fall together, one has met a third.
    pub fn outrun(&self, scene: &Scene, time: f64) -> Result<Vec<Pair>, CollideError> {
        // The bounds of a pair that was not tested were farther apart than it looked.
        let is_outrun = |&(pair, way): &(Pair, f64)| self.distances.get(&pair).is_none_or(|&d| way > d);
        Ok(distances(scene, 0.0, time)?.into_iter().filter(is_outrun).map(|(pair, _)| pair).collect())
    }

    /// Takes over what another look has found of the pairs at which it looked farther. Returns
    /// whether that is more.
    pub fn extend(&mut self, other: Self, scene: &Scene) -> bool {
        let before = self.contacts.len();
        let mut farther = other.distances;
        farther.retain(|pair, other| self.distances.get(pair).is_none_or(|own| *other > *own));
        let is_farther = |a, b| farther.contains_key(&pair(a, b));
        let world = |id| scene.instance(id).map_or(0, |instance| instance.world);
        let Contacts { statistics, hidden, reductions: theirs, .. } = &other.contacts;
        let (statistics, hidden, theirs) = (*statistics, hidden.clone(), theirs.clone());
        let mut reductions = std::mem::take(&mut self.contacts.reductions);
        reductions.retain(|r| !is_farther(r.instance_a, r.instance_b));
        reductions.extend(theirs.into_iter().filter(|r| is_farther(r.instance_a, r.instance_b)));
        reductions.sort_by_key(|r| (world(r.instance_a), pair(r.instance_a, r.instance_b)));
        let mut contacts = std::mem::take(&mut self.contacts).into_vec();
        contacts.retain(|c| !is_farther(c.instance_a, c.instance_b));
        contacts.extend(other.contacts.into_iter().filter(|c| is_farther(c.instance_a, c.instance_b)));
        // The contacts of a pair stay in their order.
        contacts.sort_by_key(|c| (world(c.instance_a), pair(c.instance_a, c.instance_b)));
        self.contacts = Contacts::new(contacts, statistics, reductions, hidden);
        self.distances.append(&mut farther);
        self.contacts.len() > before
    }
}

fn pair(a: InstanceId, b: InstanceId) -> Pair {
    (a.min(b), a.max(b))
}

fn distances(scene: &Scene, contact_distance: f64, time: f64) -> Result<BTreeMap<Pair, f64>, CollideError> {
    let pairs = instance_pairs(scene, contact_distance, time)?;
    Ok(pairs.into_iter().map(|p| ((p.first, p.second), p.contact_distance)).collect())
}
