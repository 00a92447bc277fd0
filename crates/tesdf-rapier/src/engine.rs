use std::time::Instant;

use rapier3d_f64::geometry::PairContacts;
use tesdf::collide::{CollideOptions, Contact, HiddenOverlap, Pose, hidden_overlaps};
use tesdf_sim::{Dynamics, DynamicsError, Motor, State, StepReport, System, Wrench};

use crate::RapierOptions;
use crate::manifolds::FIRST;
use crate::record::{Found, Record};
use crate::world::{MayMeet, World};

/// Contacts reach at least this factor times the distance that a body at rest falls in a step.
const MARGIN: f64 = 1.2;

/// Rapier as the physics engine of a system, with contacts of [`tesdf::collide`].
///
/// Sleeping and continuous collision detection are off. Rapier has a number of iterations instead
/// of a tolerance, so a step always reports that it converged. It also reports one island and one
/// detection.
pub struct RapierEngine {
    system: System,
    collide: CollideOptions,
    options: RapierOptions,
    record: Record,
    /// Built by the first step, and again when the prediction distance changes, because Rapier
    /// keeps bounding boxes that depend on it.
    world: Option<World>,
    contacts: Vec<Contact>,
    hidden: Vec<HiddenOverlap>,
}

impl RapierEngine {
    /// An engine for `system`.
    ///
    /// All values of `collide` are used except the speculative time. Contacts reach as far as the
    /// largest of the contact distance, the distance that a body at rest falls in a step, and
    /// [`RapierOptions::speculative_distance`]. Each contact becomes a manifold, which costs Rapier
    /// some 5 µs per step. `docs/dynamics.md` shows the effect of a reduction to 64 contacts per
    /// pair.
    ///
    /// # Errors
    /// An option of `options` or `collide` is out of range, or [`DynamicsError::Unsupported`] when
    /// the system has joints, friction of single pairs, torsional friction or restitution.
    pub fn new(
        system: System,
        collide: CollideOptions,
        options: RapierOptions,
    ) -> Result<Self, DynamicsError> {
        options.validate()?;
        collide.validate()?;
        let unsupported = |what| Err(DynamicsError::Unsupported { engine: "Rapier", what });
        if !system.joints().is_empty() {
            return unsupported("joints");
        }
        if system.has_pair_friction() {
            return unsupported("friction of single pairs");
        }
        if system.has_friction_torsional() {
            return unsupported("torsional friction");
        }
        if system.bodies().iter().any(|body| body.restitution > 0.0) {
            return unsupported("restitution");
        }
        let (record, contacts, hidden) = (Record::default(), Vec::new(), Vec::new());
        Ok(Self { system, collide, options, record, world: None, contacts, hidden })
    }

    /// Rapier's world with its bodies and colliders, in the order of the system's bodies. `None`
    /// before the first step.
    pub fn rapier(&self) -> Option<&rapier3d_f64::pipeline::PhysicsWorld> {
        self.world.as_ref().map(|world| &world.rapier)
    }

    /// The world in the current state, with parameters for steps of `h` seconds.
    fn world(&mut self, h: f64) -> Result<World, DynamicsError> {
        let fall = MARGIN * self.system.gravity.length() * h * h;
        let prediction = self.collide.contact_distance.max(fall);
        let mut world = match self.world.take() {
            Some(world) if world.prediction() == prediction => world,
            _ => World::new(&self.system, self.collide, &self.options, prediction, &self.record)?,
        };
        world.rapier.gravity = self.system.gravity;
        let mut parameters = self.options.parameters(h, prediction);
        // The dispatcher does not answer sweeps.
        parameters.max_ccd_substeps = 0;
        world.rapier.integration_parameters = parameters;
        Ok(world)
    }

    /// The contacts of the last detection, in the world frame, at the current states of
    /// `self.system`.
    fn contacts_of(&self, world: &World, found: &Found) -> Vec<Contact> {
        let mut contacts = Vec::with_capacity(found.contacts.len());
        for pair in world.rapier.narrow_phase.contact_pairs() {
            let bodies = [pair.collider1, pair.collider2].map(|collider| world.body_of(collider));
            let (PairContacts::Rigid(rigid), [Some(first), Some(second)]) = (&pair.contacts, bodies) else {
                continue;
            };
            let pose = self.system.states()[first].pose;
            let ids = [first, second].map(|body| self.system.bodies()[body].instance);
            for manifold in rigid.manifolds.iter().filter(|m| !m.points.is_empty()) {
                let Some(contact) = found.contacts.get(manifold.data.user_data as usize) else { continue };
                let flipped = contact.instance_a != FIRST;
                let [instance_a, instance_b] = if flipped { [ids[1], ids[0]] } else { ids };
                contacts.push(Contact { instance_a, instance_b, ..in_world(contact, pose) });
            }
        }
        let order = |c: &Contact| {
            let world = self.system.scene().instance(c.instance_a).map_or(0, |instance| instance.world);
            (world, c.instance_a.min(c.instance_b), c.instance_a.max(c.instance_b), c.instance_a)
        };
        // The sort is stable, so the contacts of a pair stay in the detector's order.
        contacts.sort_by_key(order);
        contacts
    }

    /// Replaces all states, or none on an error.
    fn set_states(&mut self, states: &[State]) -> Result<(), DynamicsError> {
        let before = self.system.states().to_vec();
        for (body, state) in states.iter().enumerate() {
            if let Err(error) = self.system.set_state(body, *state) {
                before
                    .iter()
                    .enumerate()
                    .try_for_each(|(body, state)| self.system.set_state(body, *state))?;
                return Err(error);
            }
        }
        Ok(())
    }
}

fn in_world(contact: &Contact, pose: Pose) -> Contact {
    Contact {
        point_a: pose.to_world(contact.point_a),
        point_b: pose.to_world(contact.point_b),
        normal: pose.rotation * contact.normal,
        ..*contact
    }
}

impl Dynamics for RapierEngine {
    fn system(&self) -> &System {
        &self.system
    }

    fn set_state(&mut self, body: usize, state: State) -> Result<(), DynamicsError> {
        self.system.set_state(body, state)?;
        if let Some(world) = &mut self.world {
            world.set_state(body, &self.system.states()[body]);
        }
        Ok(())
    }

    fn set_motor(&mut self, joint: usize, motor: Option<Motor>) -> Result<(), DynamicsError> {
        self.system.set_motor(joint, motor)
    }

    fn set_wrench(&mut self, body: usize, wrench: Wrench) -> Result<(), DynamicsError> {
        self.system.set_wrench(body, wrench)?;
        if let Some(world) = &mut self.world {
            world.set_wrench(body, wrench);
        }
        Ok(())
    }

    fn step(&mut self, time_step: f64) -> Result<StepReport, DynamicsError> {
        let begin = Instant::now();
        if !(time_step > 0.0 && time_step.is_finite()) {
            let expected = "a finite number of seconds, greater than 0";
            return Err(DynamicsError::Option { option: "time step", found: time_step, expected });
        }
        // After an error there is no world, and the next step builds one from the system's states.
        let mut world = self.world(time_step)?;
        *self.record.lock() = Found::default();
        world.rapier.step_with_events(&MayMeet(&self.system), &());
        let found = std::mem::take(&mut *self.record.lock());
        if let Some(error) = found.error {
            return Err(error.into());
        }
        // Rapier puts a body into quarantine when its state stops being finite.
        if let Some(&body) = world.rapier.quarantine().bodies().first() {
            let body =
                world.rapier.bodies.get(body).and_then(|b| usize::try_from(b.user_data).ok()).unwrap_or(0);
            let name = self.system.body(body)?.name.clone();
            return Err(DynamicsError::NotFinite {
                body,
                name,
                found: "put into Rapier's quarantine".into(),
            });
        }
        let contacts = self.contacts_of(&world, &found);
        // Rapier detects pair by pair and only knows contacts, so hidden overlaps are searched
        // here.
        let before = self.system.states().to_vec();
        let hidden = hidden_overlaps(self.system.scene_at(&before)?, &self.collide, &contacts)?;
        let states = world.states(self.system.states());
        self.set_states(&states)?;
        (self.contacts, self.hidden) = (contacts, hidden);
        let report = StepReport {
            contacts: self.contacts.len(),
            deepest: self.contacts.iter().map(|c| c.distance).reduce(f64::min),
            detections: 1,
            parts: 1,
            islands: 1,
            iterations: self.options.substeps as u32,
            converged: true,
            detection: found.time,
            solution: begin.elapsed().saturating_sub(found.time),
            ..StepReport::default()
        };
        self.world = Some(world);
        Ok(report)
    }

    fn contacts(&self) -> &[Contact] {
        &self.contacts
    }

    fn hidden(&self) -> &[HiddenOverlap] {
        &self.hidden
    }
}
