//! Sleep: bodies at rest are not solved, and nothing is detected between them.
//!
//! An island is free bodies that contacts or joints connect. It falls asleep at the end of a step when
//! all of its bodies have stayed where they are for [`NewtonOptions::sleep`] seconds: its velocities
//! become exactly zero, and its poses stay bit for bit. Bodies that are asleep are to the others what
//! fixed bodies are.
//!
//! *Waking.* A step begins with a look. Where it finds a contact between a body that is asleep and one
//! that is not, or that moves, the whole island wakes, and the step begins again before anything has
//! moved. So a push passes through a stack in the step in which it hits. A body also wakes when its
//! motor, its wrench or its state is set to another value, when gravity is, and with what a joint
//! connects it to.
//!
//! *What is kept.* Contacts of bodies that are still (fixed, asleep, or kinematic and without
//! velocity) are detected once, when one of the two has become still, and reported in every step. They also say
//! which bodies wake together.
//!
//! *What it depends on.* The time at rest follows from the states after each step and from what was
//! set between steps, the rest from that and the states of the step. So a run that is continued gives the
//! same bytes after [`Dynamics::recall`](crate::Dynamics::recall).
mod in_step;

use std::collections::BTreeMap;

use tesdf::collide::{Contact, Contacts, HiddenOverlap, InstanceId, Pose};

use crate::{Joint, Mass, State, System};

/// A body is at rest as long as no point of it has left its place by more than this, m, or its
/// velocity would take it that far in a step. The solver moves bodies at rest by 0.1 nm a step at most, and by
/// a few pm in a second where there is no friction.
const STAYS: f64 = 1e-9;

/// The same as part of the body's diagonal, for bodies below a millimetre.
const STAYS_OF_SIZE: f64 = 1e-6;

/// What is known of bodies at rest, of each body by its number.
#[derive(Clone, Debug, Default)]
pub struct Sleep {
    rests: Vec<Rest>,
    /// Whether a pose was set since the last step.
    displaced: Vec<bool>,
    /// Whether a body is fixed, kinematic without velocity, or asleep in the current step.
    still: Vec<bool>,
    /// The bodies whose pairs are in `pairs`.
    kept: Vec<bool>,
    /// What was found between bodies that are still, by world and instances, the lower one first.
    pairs: BTreeMap<(u32, InstanceId, InstanceId), Kept>,
}

/// How long a body has been at rest.
#[derive(Clone, Copy, Debug)]
struct Rest {
    /// Where it came to rest.
    place: Pose,
    /// Since when, s; not counted beyond the time after which it may sleep.
    time: f64,
}

/// What was found between two bodies that are still.
#[derive(Clone, Debug)]
struct Kept {
    bodies: [usize; 2],
    contacts: Vec<Contact>,
    hidden: Option<HiddenOverlap>,
}

impl Sleep {
    /// All bodies have just been let go.
    pub fn new(states: &[State]) -> Self {
        let rests = states.iter().map(|state| Rest { place: state.pose, time: 0.0 }).collect();
        let none = || vec![false; states.len()];
        Self { rests, displaced: none(), still: none(), kept: none(), pairs: BTreeMap::new() }
    }

    /// Whether a body does not move in this step, so that it is solved neither as free nor detected
    /// against others of its kind.
    pub fn is_still(&self, body: usize) -> bool {
        self.still[body]
    }

    fn key(system: &System, a: InstanceId, b: InstanceId) -> (u32, InstanceId, InstanceId) {
        (system.scene().instance(a).map_or(0, |instance| instance.world), a.min(b), a.max(b))
    }

    /// Counts how long bodies have been at rest after a step of `h` seconds.
    fn count(&mut self, states: &[State], sizes: &[f64], h: f64, longest: f64) {
        for ((rest, state), size) in self.rests.iter_mut().zip(states).zip(sizes) {
            let stays = STAYS.min(STAYS_OF_SIZE * size);
            let speed = state.linear.length() + size * state.angular.length();
            match way(rest.place, state.pose, *size) <= stays && h * speed <= stays {
                true => rest.time = (rest.time + h).min(longest),
                false => *rest = Rest { place: state.pose, time: 0.0 },
            }
        }
        self.displaced.fill(false);
    }

    /// Wakes the bodies that contacts or joints connect to `body`, and itself.
    fn disturb(&mut self, body: usize, system: &System) {
        let near = self.links(system).into_iter().filter(|pair| pair.contains(&body));
        for body in near.flatten().chain([body]) {
            self.rests[body].time = 0.0;
        }
    }

    /// The pairs of bodies that kept contacts or joints connect.
    fn links(&self, system: &System) -> Vec<[usize; 2]> {
        let touching = self.pairs.values().filter(|kept| !kept.contacts.is_empty());
        touching.map(|kept| kept.bodies).chain(joined(system)).collect()
    }

    /// Wakes these bodies and all that are connected to them through bodies that are asleep.
    fn wake(&mut self, bodies: Vec<usize>, system: &System) {
        let mut neighbours: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
        for [a, b] in self.links(system) {
            neighbours.entry(a).or_default().push(b);
            neighbours.entry(b).or_default().push(a);
        }
        let mut queue = bodies;
        while let Some(body) = queue.pop() {
            if is_free(system, body) && std::mem::take(&mut self.still[body]) {
                self.kept[body] = false;
                queue.extend(neighbours.get(&body).into_iter().flatten());
            }
        }
    }

    /// Of these pairs of bodies, those that are asleep beside a body that is not still.
    fn touched(&self, pairs: impl Iterator<Item = [usize; 2]>, system: &System) -> Vec<usize> {
        let asleep =
            |a: usize, b: usize| (self.still[a] && !self.still[b] && is_free(system, a)).then_some(a);
        pairs.filter_map(|[a, b]| asleep(a, b).or(asleep(b, a))).collect()
    }

    /// `found`, with what is kept of the pairs of bodies that are still, in the order of a detection.
    fn with_kept(&self, found: Contacts, system: &System) -> Contacts {
        let are_still = |bodies: [usize; 2]| bodies.iter().all(|&body| self.still[body]);
        let mut kept = self.pairs.iter().filter(|(_, kept)| are_still(kept.bodies)).peekable();
        if kept.peek().is_none() {
            return found;
        }
        let (statistics, reductions, mut hidden) =
            (found.statistics, found.reductions.clone(), found.hidden.clone());
        let key = |a: InstanceId, b: InstanceId| Self::key(system, a, b);
        // A detector may ignore the marks of the scene.
        let is_kept = |a: InstanceId, b: InstanceId| {
            let bodies = [system.body_of(a), system.body_of(b)];
            matches!(bodies, [Some(a), Some(b)] if are_still([a, b]))
        };
        hidden.retain(|h| !is_kept(h.instance_a, h.instance_b));
        let mut contacts = Vec::new();
        let ids = |c: &Contact| (c.instance_a.min(c.instance_b), c.instance_a.max(c.instance_b));
        for of_pair in found.as_slice().chunk_by(|x, y| ids(x) == ids(y)) {
            let (a, b) = ids(&of_pair[0]);
            while let Some((_, kept)) = kept.next_if(|(of_kept, _)| **of_kept < key(a, b)) {
                contacts.extend_from_slice(&kept.contacts);
                hidden.extend(kept.hidden);
            }
            if !is_kept(a, b) {
                contacts.extend_from_slice(of_pair);
            }
        }
        for (_, kept) in kept {
            contacts.extend_from_slice(&kept.contacts);
            hidden.extend(kept.hidden);
        }
        hidden.sort_by_key(|h| key(h.instance_a, h.instance_b));
        Contacts::new(contacts, statistics, reductions, hidden)
    }
}

/// A bound of the way of the points of a body of diagonal `size` between two poses, m.
fn way(from: Pose, to: Pose, size: f64) -> f64 {
    // Planes are infinite.
    let turned = match to.rotation == from.rotation {
        true => 0.0,
        false => 2.0 * (to.rotation * from.rotation.inverse()).xyz().length() * size,
    };
    from.translation.distance(to.translation) + turned
}

fn is_free(system: &System, body: usize) -> bool {
    matches!(system.bodies()[body].mass, Mass::Free(_))
}

/// The pairs of bodies that joints and their couplings connect.
pub fn joined(system: &System) -> impl Iterator<Item = [usize; 2]> {
    let of_joints = system.joints().iter().filter_map(|joint| Some([joint.parent?, joint.child]));
    let bodies = |joint: usize| {
        let Joint { child, parent, .. } = &system.joints()[joint];
        [Some(*child), *parent].into_iter().flatten()
    };
    let of_couplings = system.couplings().iter().flat_map(move |coupling| {
        bodies(coupling.joint).flat_map(move |a| bodies(coupling.of).map(move |b| [a, b]))
    });
    of_joints.chain(of_couplings.filter(|[a, b]| a != b))
}

/// The pairs of bodies of contacts.
pub fn pairs_of(contacts: &[Contact], system: &System) -> impl Iterator<Item = [usize; 2]> {
    // The contacts of a pair of instances follow each other.
    let ids = |c: &Contact| (c.instance_a.min(c.instance_b), c.instance_a.max(c.instance_b));
    let pairs = contacts.chunk_by(move |x, y| ids(x) == ids(y));
    pairs.filter_map(|of_pair| {
        let Contact { instance_a, instance_b, .. } = of_pair[0];
        Some([system.body_of(instance_a)?, system.body_of(instance_b)?])
    })
}
