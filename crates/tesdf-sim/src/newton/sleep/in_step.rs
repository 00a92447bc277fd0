//! Which bodies of a step are asleep, and what wakes them.

use tesdf::collide::{CollideOptions, Contact, Contacts, HiddenSearch, InstanceId, instance_pairs};

use super::{Kept, Rest, STAYS, Sleep, is_free, joined, pairs_of, way};
use crate::newton::islands::{join, root};
use crate::newton::stopwatch::Stopwatch;
use crate::newton::{Newton, NewtonOptions};
use crate::{DynamicsError, Mass, Motor, State, StepReport, Wrench};

impl Newton {
    fn sleeps(&self) -> bool {
        self.options.sleep > 0.0
    }

    /// Before a step: which bodies are still in it, and their contacts with each other.
    pub(in crate::newton) fn begin_sleep(&mut self, whole: f64) -> Result<StepReport, DynamicsError> {
        let mut report = StepReport::begun();
        if !self.sleeps() {
            return Ok(report);
        }
        let NewtonOptions { sleep: longest, .. } = self.options;
        let (system, asleep) = (&self.system, &mut self.sleep);
        for (k, (body, state)) in system.bodies().iter().zip(system.states()).enumerate() {
            asleep.still[k] = match body.mass {
                Mass::Fixed => !asleep.displaced[k],
                Mass::Kinematic => !asleep.displaced[k] && !state.has_velocity(),
                Mass::Free(_) => asleep.rests[k].time >= longest && !state.has_velocity(),
            };
        }
        let pulled = asleep.touched(joined(system), system);
        if !pulled.is_empty() {
            asleep.wake(pulled, system);
        }
        let (still, kept) = (asleep.still.clone(), asleep.kept.clone());
        asleep.pairs.retain(|_, pair| pair.bodies.iter().all(|&body| still[body] && kept[body]));
        let new: Vec<bool> = still.iter().zip(&kept).map(|(still, kept)| *still && !kept).collect();
        if new.contains(&true) {
            let start = Stopwatch::start();
            self.find_kept(&new, whole)?;
            report.detection += start.elapsed();
        }
        self.sleep.kept = still;
        self.mark_still();
        Ok(report)
    }

    /// Finds what is kept of the pairs of a body that is `new` among those that are still.
    fn find_kept(&mut self, new: &[bool], whole: f64) -> Result<(), DynamicsError> {
        // Only pairs with such a body are looked at.
        self.mark(&new.iter().map(|new| !new).collect::<Vec<_>>());
        let states = self.system.states().to_vec();
        let options = CollideOptions { hidden: HiddenSearch::On, ..self.options_of(whole) };
        let CollideOptions { contact_distance, speculative_time, .. } = options;
        let pairs = instance_pairs(self.system.scene_at(&states)?, contact_distance, speculative_time)?;
        let is_still = |id| self.system.body_of(id).is_some_and(|body| self.sleep.still[body]);
        if pairs.iter().any(|pair| is_still(pair.first) && is_still(pair.second)) {
            let found = self.detector.detect(self.system.scene(), &options)?;
            self.keep(&found, new);
        }
        Ok(())
    }

    /// Keeps what was found between bodies that are still, of which one is `new`.
    fn keep(&mut self, found: &Contacts, new: &[bool]) {
        let Self { system, sleep, .. } = self;
        let Sleep { still, pairs, .. } = sleep;
        let mut keep = |a: InstanceId, b: InstanceId, contact: Option<Contact>, hidden| {
            let (Some(x), Some(y)) = (system.body_of(a), system.body_of(b)) else { return };
            if still[x] && still[y] && (new[x] || new[y]) {
                let none = || Kept { bodies: [x, y], contacts: Vec::new(), hidden: None };
                let kept = pairs.entry(Sleep::key(system, a, b)).or_insert_with(none);
                kept.contacts.extend(contact);
                kept.hidden = kept.hidden.or(hidden);
            }
        };
        found.iter().for_each(|c| keep(c.instance_a, c.instance_b, Some(*c), None));
        found.hidden.iter().for_each(|h| keep(h.instance_a, h.instance_b, None, Some(*h)));
    }

    /// Marks those that are still in the step, and no others.
    pub(in crate::newton) fn mark_still(&mut self) {
        let still = self.sleep.still.clone();
        self.mark(&still);
    }

    /// Marks bodies as still in the scene.
    pub(in crate::newton) fn mark(&mut self, still: &[bool]) {
        let ids = self.system.bodies().iter().zip(still).filter(|(_, still)| **still);
        let ids: Vec<_> = ids.map(|(body, _)| body.instance).collect();
        self.system.set_still(ids);
    }

    /// Whether nothing moves in this step: all bodies are still.
    pub(in crate::newton) fn is_all_still(&self) -> bool {
        self.sleeps() && self.sleep.still.iter().all(|still| *still)
    }

    /// Wakes what the contacts of a look touch. Returns whether there was something: the part is then
    /// to be solved anew.
    pub(in crate::newton) fn wakes(&mut self, contacts: &[Contact]) -> bool {
        if !self.sleeps() {
            return false;
        }
        let (system, sleep) = (&self.system, &mut self.sleep);
        let touched = sleep.touched(pairs_of(contacts, system), system);
        if touched.is_empty() {
            return false;
        }
        sleep.wake(touched, system);
        self.mark_still();
        true
    }

    /// The contacts of a step, which has found these.
    pub(in crate::newton) fn with_kept(&self, found: Contacts) -> Contacts {
        if self.sleeps() { self.sleep.with_kept(found, &self.system) } else { found }
    }

    /// The pairs of free or kinematic bodies that contacts connect.
    pub(in crate::newton) fn touching(&self, contacts: &[Contact]) -> Vec<[usize; 2]> {
        if !self.sleeps() {
            return Vec::new();
        }
        let moves = |body: &usize| self.system.bodies()[*body].mass != Mass::Fixed;
        let mut pairs: Vec<_> =
            pairs_of(contacts, &self.system).filter(|pair| pair.iter().all(moves)).collect();
        pairs.dedup();
        pairs
    }

    /// After a step: lets islands fall asleep that have been at rest for long. `touching` are the
    /// pairs of bodies that contacts connect. Returns the number of bodies that are asleep.
    pub(in crate::newton) fn end_sleep(
        &mut self,
        h: f64,
        touching: &[[usize; 2]],
    ) -> Result<usize, DynamicsError> {
        if !self.sleeps() {
            return Ok(0);
        }
        let NewtonOptions { sleep: longest, .. } = self.options;
        self.sleep.count(self.system.states(), &self.sizes, h, longest);
        let (system, sleep) = (&self.system, &self.sleep);
        let mut rests: Vec<bool> = sleep.rests.iter().map(|rest| rest.time >= longest).collect();
        let mut parent: Vec<usize> = (0..rests.len()).collect();
        for [a, b] in touching.iter().copied().chain(joined(system)) {
            match [a, b].map(|body| is_free(system, body)) {
                [true, true] => join(&mut parent, a, b),
                // What a kinematic body moves is not at rest, although it may stay where it is.
                [true, false] => rests[a] &= sleep.still[b],
                [false, true] => rests[b] &= sleep.still[a],
                [false, false] => {}
            }
        }
        let mut of_island = vec![true; rests.len()];
        for (body, rests) in rests.iter().enumerate() {
            of_island[root(&mut parent, body)] &= rests;
        }
        let mut states = system.states().to_vec();
        let mut asleep = 0;
        for (body, state) in states.iter_mut().enumerate().filter(|(body, _)| is_free(system, *body)) {
            if of_island[root(&mut parent, body)] {
                *state = State::at_rest(state.pose);
                asleep += 1;
            }
        }
        self.system.set_states(states)?;
        Ok(asleep)
    }

    /// After a step, also one that failed: whoever uses the scene finds all pairs.
    pub(in crate::newton) fn unmark(&mut self) {
        if self.sleeps() {
            self.system.set_still([]);
        }
    }

    pub(in crate::newton) fn set_state_awake(
        &mut self,
        body: usize,
        state: State,
    ) -> Result<(), DynamicsError> {
        let before = self.system.states().get(body).copied();
        if before == Some(state) {
            return Ok(());
        }
        self.system.set_state(body, state)?;
        let Some(before) = before else { return Ok(()) };
        let pose = self.system.states()[body].pose;
        self.sleep.displaced[body] |= pose != before.pose;
        // Setting a velocity may round the pose.
        if way(before.pose, pose, self.sizes[body]) > STAYS {
            self.sleep.disturb(body, &self.system);
        }
        self.sleep.rests[body] = Rest { place: pose, time: 0.0 };
        Ok(())
    }

    pub(in crate::newton) fn set_motor_awake(
        &mut self,
        joint: usize,
        motor: Option<Motor>,
    ) -> Result<(), DynamicsError> {
        let before = self.system.joints().get(joint).map(|joint| joint.motor);
        self.system.set_motor(joint, motor)?;
        if before != Some(motor) {
            let joint = &self.system.joints()[joint];
            [Some(joint.child), joint.parent]
                .into_iter()
                .flatten()
                .for_each(|b| self.sleep.rests[b].time = 0.0);
        }
        Ok(())
    }

    pub(in crate::newton) fn set_wrench_awake(
        &mut self,
        body: usize,
        wrench: Wrench,
    ) -> Result<(), DynamicsError> {
        let before = self.system.wrenches().get(body).copied();
        self.system.set_wrench(body, wrench)?;
        if before != Some(wrench) {
            self.sleep.rests[body].time = 0.0;
        }
        Ok(())
    }

    /// Wakes a body, and those that it touches.
    pub(in crate::newton) fn wake(&mut self, body: usize) {
        self.sleep.disturb(body, &self.system);
    }

    /// Wakes all bodies.
    pub(in crate::newton) fn wake_all(&mut self) {
        self.sleep.rests.iter_mut().for_each(|rest| rest.time = 0.0);
    }

    /// Takes over the states after a step of `time_step` seconds, or those at the beginning of a run.
    pub(in crate::newton) fn recall_states(
        &mut self,
        states: Vec<State>,
        time_step: Option<f64>,
    ) -> Result<(), DynamicsError> {
        self.system.set_states(states)?;
        match time_step {
            Some(h) => self.sleep.count(self.system.states(), &self.sizes, h, self.options.sleep),
            None => self.sleep = Sleep::new(self.system.states()),
        }
        Ok(())
    }
}
