//! How far the detections at the beginning of a step have looked, pair by pair.
use std::collections::{BTreeMap, BTreeSet};

use tesdf::collide::internal::Ahead;
use tesdf::collide::{
    CollideError, CollideOptions, Contact, Contacts, InstanceId, InstancePair, Scene, instance_pairs,
};

/// Two instances, the lower id first.
pub type Pair = (InstanceId, InstanceId);

/// The contacts of one or more detections at the same poses, which looked ahead by different
/// velocities.
pub struct Look {
    /// All that one of the detections has found.
    pub contacts: Contacts,
    /// Of each detection; none until they are asked for.
    ways: Vec<Way>,
}

/// How far one detection has looked.
struct Way {
    /// The contact distance of parts that do not move against each other, m.
    contact_distance: f64,
    pairs: BTreeMap<Pair, Between>,
}

/// How far a detection has looked between two instances.
struct Between {
    /// The contact distance of the pair, m.
    distance: f64,
    /// The motions of both.
    ahead: [Ahead; 2],
}

impl Look {
    /// `contacts` are those of one detection.
    pub fn new(contacts: Contacts) -> Self {
        Self { contacts, ways: Vec::new() }
    }

    /// Finds how far the first detection has looked, if that is not known: that of `scene` with
    /// these options.
    pub fn measure(&mut self, scene: &Scene, options: &CollideOptions) -> Result<(), CollideError> {
        if self.ways.is_empty() {
            self.ways.push(Way::new(scene, options.contact_distance, options.speculative_time)?);
        }
        Ok(())
    }

    /// The pairs that the velocities of `scene` bring closer in `time`, at some place, than was
    /// looked there. Their relative velocity has changed: of two bodies that fall together, one has
    /// met a third.
    pub fn outrun(&self, scene: &Scene, time: f64) -> Result<Vec<Pair>, CollideError> {
        let Way { pairs, .. } = Way::new(scene, 0.0, time)?;
        Ok(pairs
            .iter()
            .filter(|(pair, needed)| !self.covers(**pair, needed))
            .map(|(pair, _)| *pair)
            .collect())
    }

    fn covers(&self, pair: Pair, needed: &Between) -> bool {
        self.ways.iter().any(|way| way.covers(pair, needed))
    }

    /// Takes over what another look has found of the pairs at which it looked farther. Returns
    /// whether that is more.
    pub fn extend(&mut self, other: Self, scene: &Scene) -> bool {
        let before = self.contacts.len();
        let farther: BTreeSet<Pair> = other
            .ways
            .iter()
            .flat_map(|way| &way.pairs)
            .filter(|(pair, between)| !self.covers(**pair, between))
            .map(|(pair, _)| *pair)
            .collect();
        let is_farther = |a, b| farther.contains(&pair(a, b));
        let world = |id| scene.instance(id).map_or(0, |instance| instance.world);
        let Contacts { statistics, hidden, reductions: theirs, .. } = &other.contacts;
        let (statistics, hidden, theirs) = (*statistics, hidden.clone(), theirs.clone());
        let mut reductions = std::mem::take(&mut self.contacts.reductions);
        reductions.retain(|r| !is_farther(r.instance_a, r.instance_b));
        reductions.extend(theirs.into_iter().filter(|r| is_farther(r.instance_a, r.instance_b)));
        reductions.sort_by_key(|r| (world(r.instance_a), pair(r.instance_a, r.instance_b)));
        let own = std::mem::take(&mut self.contacts).into_vec();
        let (both, mut contacts): (Vec<_>, Vec<_>) =
            own.into_iter().partition(|c| is_farther(c.instance_a, c.instance_b));
        let theirs = other.contacts.into_iter().filter(|c| is_farther(c.instance_a, c.instance_b));
        contacts.extend(union(both, theirs.collect()));
        // The contacts of a pair stay in their order.
        contacts.sort_by_key(|c| (world(c.instance_a), pair(c.instance_a, c.instance_b)));
        self.contacts = Contacts::new(contacts, statistics, reductions, hidden);
        self.ways.extend(other.ways);
        self.contacts.len() > before
    }
}

impl Way {
    fn new(scene: &Scene, contact_distance: f64, time: f64) -> Result<Self, CollideError> {
        let of_pair = |p: InstancePair| {
            let ahead = Ahead::of_both(scene, [p.first, p.second], time)?;
            Ok(((p.first, p.second), Between { distance: p.contact_distance, ahead }))
        };
        let pairs = instance_pairs(scene, contact_distance, time)?.into_iter().map(of_pair);
        Ok(Self { contact_distance, pairs: pairs.collect::<Result<_, CollideError>>()? })
    }

    /// Whether every part of the two instances has looked as far as needed. The bounds of a pair
    /// that was not tested were farther apart than it looked.
    fn covers(&self, pair: Pair, needed: &Between) -> bool {
        let Some(Between { distance, ahead: [a, b] }) = self.pairs.get(&pair) else { return false };
        let [c, d] = &needed.ahead;
        let each = |a: &Ahead, b: &Ahead, c: &Ahead, d: &Ahead| {
            let (own, its) = (a.approach(b), c.approach(d));
            let slack = self.contact_distance;
            // The parts that matter lie near the other body, too.
            own.covers(&its, a.origin, a.reach, slack)
                || own.covers(&its, b.origin, b.reach + needed.distance, slack)
        };
        needed.distance <= *distance && each(a, b, c, d) && each(b, a, d, c)
    }
}

/// The contacts of two looks at the same pairs. Where both have contacts of a face or a node, those
/// of the look that has more.
fn union(own: Vec<Contact>, other: Vec<Contact>) -> Vec<Contact> {
    let mut parts: BTreeMap<_, [Vec<Contact>; 2]> = BTreeMap::new();
    for (look, contacts) in [own, other].into_iter().enumerate() {
        for contact in contacts {
            let part = (contact.instance_a, contact.instance_b, contact.face_a, contact.feature.a);
            parts.entry(part).or_default()[look].push(contact);
        }
    }
    parts.into_values().flat_map(|[own, other]| if other.len() > own.len() { other } else { own }).collect()
}

fn pair(a: InstanceId, b: InstanceId) -> Pair {
    (a.min(b), a.max(b))
}
