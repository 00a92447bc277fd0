//! What earlier detections have found, so that bodies that have not moved since are not looked at
//! again.
//!
//! What is found of a pair depends on the states of its two bodies and on the options alone. Where
//! these are the same bit for bit, so are the contacts of a new detection. So this is no part of
//! the state of a run: nothing changes where it is dropped.
use std::iter::zip;
use std::sync::Arc;

use tesdf::collide::{CollideOptions, Contact, Contacts, Instance, InstanceId};

use crate::{Body, System};

/// What the first detection of a part of a step has found, and those that followed it. A part that
/// is solved again, because bodies close faster than was foreseen, predicts most poses again.
///
/// Each is another one, so they are few.
#[derive(Clone, Debug, Default)]
pub struct Seen(Vec<Arc<Detection>>);

/// A detection.
#[derive(Debug)]
pub struct Detection {
    options: CollideOptions,
    /// Of each body.
    instances: Vec<Instance>,
    /// The bodies between which nothing was detected.
    still: Vec<bool>,
    contacts: Contacts,
}

/// Which bodies of a scene need not be looked at.
pub struct Unmoved {
    /// Of each body, whether an earlier detection saw it as it is now.
    bodies: Vec<bool>,
    /// Of each body, whether the caller has marked it as still.
    still: Vec<bool>,
    /// The earlier detection.
    seen: Arc<Detection>,
}

impl Seen {
    /// The bodies whose pairs an earlier detection with these options has seen as they are now: the
    /// one that saw most of them. `None` where there are none, or where marks cannot tell which they
    /// are.
    pub fn unmoved(&self, system: &System, options: &CollideOptions) -> Option<Unmoved> {
        let same = self.0.iter().filter(|seen| seen.options == *options);
        let unmoved = same.filter_map(|seen| Unmoved::since(seen, system));
        unmoved.max_by_key(|unmoved| unmoved.bodies.iter().filter(|seen| **seen).count())
    }

    /// Keeps the first detection of a part, and forgets those before.
    pub fn begin(&mut self, first: Arc<Detection>) {
        self.0 = vec![first];
    }

    /// Keeps another detection of the part.
    pub fn add(&mut self, detection: Arc<Detection>) {
        self.0.push(detection);
    }

    /// Ends the step: of its detections, the first one of the last part is kept.
    pub fn end(&mut self) {
        self.0.truncate(1);
    }
}

impl Detection {
    /// What was found in the scene as it is now.
    pub fn new(system: &System, options: &CollideOptions, contacts: Contacts) -> Arc<Self> {
        let instances = system.bodies().iter().map(|body| system.scene().instance(body.instance));
        let instances = instances.flatten().copied().collect();
        Arc::new(Self { options: *options, instances, still: still(system), contacts })
    }

    /// What it found.
    pub fn contacts(&self) -> &Contacts {
        &self.contacts
    }
}

impl Unmoved {
    /// `None` as for [`Seen::unmoved`].
    fn since(seen: &Arc<Detection>, system: &System) -> Option<Self> {
        let still = still(system);
        let is_seen = |(k, body): (usize, &Body)| {
            // Nothing was detected between bodies that were still.
            let was_still = seen.still[k] && !still[k];
            let now = system.scene().instance(body.instance);
            !was_still && now.is_ok_and(|now| is_same(now, &seen.instances[k]))
        };
        let bodies: Vec<bool> = system.bodies().iter().enumerate().map(is_seen).collect();
        // Marks say of bodies, not of pairs, that nothing is to be detected.
        let fits = bodies.contains(&true) && zip(&still, &bodies).all(|(still, seen)| *seen || !still);
        fits.then(|| Self { bodies, still, seen: seen.clone() })
    }

    /// Whether nothing has moved.
    pub fn is_all(&self) -> bool {
        !self.bodies.contains(&false)
    }

    /// The earlier detection, where a new one would be the same.
    pub fn whole(&self) -> Option<Arc<Detection>> {
        (self.is_all() && self.still == self.seen.still).then(|| self.seen.clone())
    }

    /// Of each body, whether the earlier detection saw it as it is now.
    pub fn bodies(&self) -> &[bool] {
        &self.bodies
    }

    /// Of each body, whether the caller has marked it as still.
    pub fn still(&self) -> &[bool] {
        &self.still
    }

    /// The contacts of a scene of whose pairs with a body that has moved `found` are those.
    pub fn with(&self, found: Contacts, system: &System) -> Contacts {
        // A detector may ignore marks.
        let is_found = |a: InstanceId, b: InstanceId| !are(&self.bodies, [a, b], system);
        let is_seen = |a: InstanceId, b: InstanceId| !is_found(a, b) && !are(&self.still, [a, b], system);
        let world = |id| system.scene().instance(id).map_or(0, |instance| instance.world);
        let key = |a: InstanceId, b: InstanceId| (world(a), a.min(b), a.max(b));
        let of_pairs = |contacts| pairs(contacts).map(|(run, [a, b])| (key(a, b), run, [a, b]));
        let mut runs: Vec<_> = of_pairs(found.as_slice()).filter(|(.., [a, b])| is_found(*a, *b)).collect();
        runs.extend(of_pairs(self.seen.contacts.as_slice()).filter(|(.., [a, b])| is_seen(*a, *b)));
        runs.sort_by_key(|(key, ..)| *key);
        let mut contacts = Vec::with_capacity(found.len() + self.seen.contacts.len());
        runs.iter().for_each(|(_, run, _)| contacts.extend_from_slice(run));
        let Contacts { statistics, mut hidden, mut reductions, .. } = found;
        hidden.retain(|h| is_found(h.instance_a, h.instance_b));
        hidden.extend(self.seen.contacts.hidden.iter().filter(|h| is_seen(h.instance_a, h.instance_b)));
        hidden.sort_by_key(|h| key(h.instance_a, h.instance_b));
        reductions.retain(|r| is_found(r.instance_a, r.instance_b));
        let of_seen = self.seen.contacts.reductions.iter();
        reductions.extend(of_seen.filter(|r| is_seen(r.instance_a, r.instance_b)).copied());
        reductions.sort_by_key(|r| key(r.instance_a, r.instance_b));
        Contacts::new(contacts, statistics, reductions, hidden)
    }
}

/// Whether both of these instances are marked.
fn are(marked: &[bool], ids: [InstanceId; 2], system: &System) -> bool {
    ids.into_iter().all(|id| system.body_of(id).is_some_and(|body| marked[body]))
}

/// The bodies that are marked as still in the scene.
fn still(system: &System) -> Vec<bool> {
    let scene = system.scene();
    let is_still = |body: &Body| !scene.still().is_empty() && scene.is_still(body.instance);
    system.bodies().iter().map(is_still).collect()
}

/// Whether two states of a body are the same, bit for bit.
fn is_same(now: &Instance, then: &Instance) -> bool {
    let bits = |instance: &Instance| {
        let Instance { pose, velocity, .. } = instance;
        let [a, b, c] = [pose.translation, velocity.linear, velocity.angular].map(|v| v.to_array());
        [a, b, c].map(|v| v.map(f64::to_bits)).map(|v| (v[0], v[1], v[2]))
    };
    let turn = |instance: &Instance| instance.pose.rotation.to_array().map(f64::to_bits);
    // Zeros of both signs are equal.
    now == then && bits(now) == bits(then) && turn(now) == turn(then)
}

/// The contacts of each pair, with its instances.
fn pairs(contacts: &[Contact]) -> impl Iterator<Item = (&[Contact], [InstanceId; 2])> {
    let ids = |c: &Contact| (c.instance_a.min(c.instance_b), c.instance_a.max(c.instance_b));
    let runs = contacts.chunk_by(move |x, y| ids(x) == ids(y));
    runs.map(|run| (run, [run[0].instance_a, run[0].instance_b]))
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;
    use std::sync::atomic::{AtomicUsize, Ordering};

    use tesdf::collide::{CollideError, Scene, detect};

    use super::*;
    use crate::Dynamics;
    use crate::newton::Newton;
    use crate::scene_file::LoadedScene;

    /// Boxes that stand on a plane and on each other, one that leans, and a ball that hits them.
    const BODIES: &str = r#"
        bodies = [
            { name = "floor", shape = "plane", fixed = true, friction = 0.5 },
            { name = "a", shape = { box = { half_extents = [0.05, 0.04, 0.03] } }, mass = 1, friction = 0.5, translation = [0.0, 0.02, 0.03] },
            { name = "b", shape = { box = { half_extents = [0.05, 0.04, 0.03] } }, mass = 1, friction = 0.5, translation = [0.01, 0.02, 0.09] },
            { name = "c", shape = { box = { half_extents = [0.05, 0.04, 0.03] } }, mass = 1, friction = 0.5, translation = [0.3, 0.02, 0.03] },
            { name = "d", shape = { box = { half_extents = [0.05, 0.04, 0.03] } }, mass = 1, friction = 0.5, translation = [0.6, 0.02, 0.07], rotation = [0, 0.3826834323650898, 0, 0.9238795325112867] },
            { name = "e", shape = { sphere = { radius = 0.02 } }, mass = 0.2, friction = 0.5, translation = [-0.6, 0.02, 0.02], velocity = [1, 0, 0] },
        ]
    "#;

    /// Two boxes that are thrown at each other, and one that falls.
    const THROWN: &str = r#"
        bodies = [
            { name = "a", shape = { box = { half_extents = [0.05, 0.04, 0.03] } }, mass = 1, translation = [-0.1, 0, 0], velocity = [8, 0, 0], angular_velocity = [0, 20, 30] },
            { name = "b", shape = { box = { half_extents = [0.05, 0.04, 0.03] } }, mass = 1, translation = [0.1, 0.02, 0], velocity = [-8, 0, 0] },
            { name = "c", shape = { sphere = { radius = 0.02 } }, mass = 1, translation = [0, 0, 0.5] },
        ]
    "#;

    /// Two balls that fall together, the lower one onto a plane, and three that fall far away.
    const STOPPED: &str = r#"
        solver.redetections = 0
        bodies = [
            { name = "floor", shape = "plane", fixed = true },
            { name = "a", shape = { sphere = { radius = 0.02 } }, mass = 1, translation = [0, 0, 0.025], velocity = [0, 0, -2] },
            { name = "b", shape = { sphere = { radius = 0.02 } }, mass = 1, translation = [0, 0, 0.069], velocity = [0, 0, -2] },
            { name = "c", shape = { sphere = { radius = 0.02 } }, mass = 1, translation = [1, 0, 5], velocity = [0, 0, -2] },
            { name = "d", shape = { sphere = { radius = 0.02 } }, mass = 1, translation = [2, 0, 5], velocity = [0, 0, -2] },
            { name = "e", shape = { sphere = { radius = 0.02 } }, mass = 1, translation = [3, 0, 5], velocity = [0, 0, -2] },
        ]
    "#;

    /// An engine, and the numbers of its detections and of the instances that these looked at.
    fn engine(sleep: f64, bodies: &str) -> (Newton, Arc<[AtomicUsize; 2]>) {
        let text = format!("time_step = 5e-3\nduration = 1\nsolver.sleep = {sleep:?}\n{bodies}");
        let loaded = LoadedScene::parse(text, "scene.toml").unwrap();
        let counts = Arc::new([(); 2].map(|()| AtomicUsize::new(0)));
        let count = counts.clone();
        let detector = move |scene: &Scene, options: &CollideOptions| -> Result<Contacts, CollideError> {
            count[0].fetch_add(1, Ordering::Relaxed);
            count[1].fetch_add(scene.instances().len() - scene.still().len(), Ordering::Relaxed);
            detect(scene, options)
        };
        (loaded.newton_with(loaded.system().unwrap(), detector).unwrap(), counts)
    }

    /// The bits of the states and the contacts of an engine.
    fn bits(engine: &Newton) -> Vec<u64> {
        let of_state = |state: &crate::State| {
            let [a, b, c] = [state.pose.translation, state.linear, state.angular].map(|v| v.to_array());
            [a.as_slice(), &b, &c, &state.pose.rotation.to_array()].concat()
        };
        let of_contact = |c: &Contact| {
            let [a, b, n] = [c.point_a, c.point_b, c.normal].map(|v| v.to_array());
            [a.as_slice(), &b, &n, &[c.distance, f64::from(c.instance_a.0), f64::from(c.face_a)]].concat()
        };
        let states = engine.system().states().iter().flat_map(of_state);
        states.chain(engine.contacts().iter().flat_map(of_contact)).map(f64::to_bits).collect()
    }

    /// Also where bodies fall asleep, and wake.
    #[test]
    fn what_has_been_seen_is_what_a_new_detection_finds() {
        for sleep in [0.0, 0.1] {
            let [(mut with, some), (mut without, all)] = [(); 2].map(|()| engine(sleep, BODIES));
            for step in 0..250 {
                without.seen = Seen::default();
                let reports = [&mut with, &mut without].map(|engine| engine.step(5e-3).unwrap());
                assert_eq!(bits(&with), bits(&without), "sleep {sleep}, step {step}");
                assert_eq!(reports[0].contacts, reports[1].contacts);
            }
            let [some, all] = [some, all].map(|counts| counts.each_ref().map(|n| n.load(Ordering::Relaxed)));
            assert!(some[1] < all[1] && 2 * some[0] < 3 * all[0], "sleep {sleep}: {some:?} of {all:?}");
        }
    }

    /// Each body moves, so only what is predicted again is not looked at.
    #[test]
    fn poses_that_are_predicted_again_are_not_looked_at_again() {
        let (mut engine, counts) = engine(0.0, THROWN);
        let detections: u32 = (0..10).map(|_| engine.step(5e-3).unwrap().detections).sum();
        let looks = counts[0].load(Ordering::Relaxed);
        assert!(looks < detections as usize, "{looks} of {detections}");
        assert_eq!(engine.seen.0.len(), 1);
    }

    /// The plane stops the lower ball, into which the upper one then falls. All others fall as was
    /// foreseen, but for gravity, and are not looked at again.
    #[test]
    fn bodies_that_meet_as_was_foreseen_are_not_looked_at_again() {
        let (mut engine, counts) = engine(0.0, STOPPED);
        let report = engine.step(5e-3).unwrap();
        let [looks, instances] = counts.each_ref().map(|n| n.load(Ordering::Relaxed));
        assert_eq!((report.parts, report.detections, looks), (1, 2, 2));
        assert_eq!(instances, 6 + 2, "the second look is at two balls");
        let balls = engine.contacts().iter().filter(|c| c.instance_a.0.min(c.instance_b.0) > 0);
        assert_eq!(balls.count(), 1);
    }
}
