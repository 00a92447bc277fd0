use glam::{DMat3, DVec3};
use tesdf::collide::{CollideError, Instance, InstanceId, Pose, Scene, Shape, ShapeId, Velocity};

use crate::{DynamicsError, MassProperties};

/// What forces do to a body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Mass {
    /// Nothing moves it.
    Fixed,
    /// It moves freely.
    Free(MassProperties),
}

/// A rigid body: an instance of the scene, and its mass.
#[derive(Clone, Debug, PartialEq)]
pub struct Body {
    /// For people.
    pub name: String,
    /// The instance of the system's scene.
    pub instance: InstanceId,
    /// Fixed, or its mass properties.
    pub mass: Mass,
}

/// Where a body is and how it moves, in the world's frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct State {
    /// Of the body's frame, which is that of its mesh or shape.
    pub pose: Pose,
    /// Velocity of the centre of mass, m/s; zero for a fixed body.
    pub linear: DVec3,
    /// Angular velocity, rad/s.
    pub angular: DVec3,
}

impl State {
    /// Not moving.
    pub fn at_rest(pose: Pose) -> Self {
        Self { pose, linear: DVec3::ZERO, angular: DVec3::ZERO }
    }

    /// Whether every number is finite.
    pub fn is_finite(&self) -> bool {
        self.pose.translation.is_finite()
            && self.pose.rotation.is_finite()
            && self.linear.is_finite()
            && self.angular.is_finite()
    }
}

/// Bodies, their states, and gravity.
///
/// The scene holds the geometry; what moves is kept here, and [`scene_at`](Self::scene_at) hands it on.
#[derive(Clone, Debug, Default)]
pub struct System {
    scene: Scene,
    bodies: Vec<Body>,
    states: Vec<State>,
    /// Acceleration of every free body, m/s².
    pub gravity: DVec3,
}

impl System {
    /// No bodies.
    pub fn new(gravity: DVec3) -> Self {
        Self { gravity, ..Self::default() }
    }

    /// Adds a shape that bodies may share.
    ///
    /// # Errors
    /// As [`Scene::add_shape`].
    pub fn add_shape(&mut self, shape: impl Into<Shape>) -> Result<ShapeId, CollideError> {
        self.scene.add_shape(shape)
    }

    /// Adds a body and says its number: 0, 1, 2, … in the order of adding. The velocity of a free body is that of `instance`.
    ///
    /// # Errors
    /// As [`Scene::add`].
    pub fn add(
        &mut self,
        name: impl Into<String>,
        instance: Instance,
        mass: Mass,
    ) -> Result<usize, CollideError> {
        let id = self.scene.add(instance)?;
        let Instance { pose, velocity, .. } = *self.scene.instance(id)?;
        let mut state = State::at_rest(pose);
        if let Mass::Free(mass) = mass {
            let arm = pose.rotation * mass.center;
            (state.linear, state.angular) = (velocity.linear + velocity.angular.cross(arm), velocity.angular);
        }
        self.bodies.push(Body { name: name.into(), instance: id, mass });
        self.states.push(state);
        Ok(self.bodies.len() - 1)
    }

    /// Two bodies never meet from now on.
    ///
    /// # Errors
    /// [`DynamicsError::NoBody`].
    pub fn exclude(&mut self, a: usize, b: usize) -> Result<(), DynamicsError> {
        let [a, b] = [self.body(a)?.instance, self.body(b)?.instance];
        Ok(self.scene.exclude(a, b)?)
    }

    /// The bodies.
    pub fn bodies(&self) -> &[Body] {
        &self.bodies
    }

    /// Their states.
    pub fn states(&self) -> &[State] {
        &self.states
    }

    /// The geometry. Its instances are where the last detection saw them; the bodies are where [`states`](Self::states) says.
    pub fn scene(&self) -> &Scene {
        &self.scene
    }

    /// One body.
    ///
    /// # Errors
    /// [`DynamicsError::NoBody`].
    pub fn body(&self, body: usize) -> Result<&Body, DynamicsError> {
        self.bodies.get(body).ok_or(DynamicsError::NoBody { body, bodies: self.bodies.len() })
    }

    /// The body of an instance.
    pub fn body_of(&self, instance: InstanceId) -> Option<usize> {
        // Instances are numbered in the order of adding, so the bodies are sorted by them.
        self.bodies.binary_search_by_key(&instance, |body| body.instance).ok()
    }

    /// Replaces a body's state.
    ///
    /// # Errors
    /// [`DynamicsError::NoBody`]; [`DynamicsError::NotFinite`]; a rotation that is not of unit length.
    pub fn set_state(&mut self, body: usize, state: State) -> Result<(), DynamicsError> {
        self.check(body, &state)?;
        let pose = Pose::new(state.pose.translation, state.pose.rotation)?;
        self.states[body] = State { pose, ..state };
        Ok(())
    }

    /// Replaces all states bit for bit, or none: rotations are taken as they are, of unit length.
    ///
    /// # Errors
    /// [`DynamicsError::NotFinite`]; [`DynamicsError::States`] when there are not as many states as bodies.
    pub fn set_states(&mut self, states: Vec<State>) -> Result<(), DynamicsError> {
        if states.len() != self.bodies.len() {
            return Err(DynamicsError::States { found: states.len(), expected: self.bodies.len() });
        }
        states.iter().enumerate().try_for_each(|(body, state)| self.check(body, state))?;
        self.states = states;
        Ok(())
    }

    fn check(&self, body: usize, state: &State) -> Result<(), DynamicsError> {
        let name = &self.body(body)?.name;
        if state.is_finite() {
            return Ok(());
        }
        Err(DynamicsError::NotFinite { body, name: name.clone(), found: format!("{state:?}") })
    }

    /// The scene with every instance where `states` says, moving as they say.
    ///
    /// # Errors
    /// As [`Scene::update`].
    pub fn scene_at(&mut self, states: &[State]) -> Result<&Scene, CollideError> {
        let mut updates = Vec::with_capacity(states.len());
        for (body, state) in self.bodies.iter().zip(states) {
            let before = *self.scene.instance(body.instance)?;
            let velocity = match body.mass {
                Mass::Fixed => Velocity::default(),
                Mass::Free(mass) => {
                    let arm = state.pose.rotation * mass.center;
                    Velocity { linear: state.linear - state.angular.cross(arm), angular: state.angular }
                }
            };
            updates.push((body.instance, Instance { pose: state.pose, velocity, ..before }));
        }
        self.scene.update(&updates)?;
        Ok(&self.scene)
    }

    /// Kinetic energy of all free bodies, J.
    pub fn kinetic_energy(&self) -> f64 {
        self.free().map(|(mass, state)| mass.kinetic_energy(state)).sum()
    }

    /// Potential energy of all free bodies, J; 0 with the centre of mass at the world's origin.
    pub fn potential_energy(&self) -> f64 {
        self.free().map(|(mass, state)| -mass.mass * self.gravity.dot(state.pose.to_world(mass.center))).sum()
    }

    /// Linear momentum, and angular momentum about the world's origin.
    pub fn momentum(&self) -> (DVec3, DVec3) {
        self.free().fold((DVec3::ZERO, DVec3::ZERO), |(linear, angular), (mass, state)| {
            let p = mass.mass * state.linear;
            let spin = mass.inertia_in_world(state.pose) * state.angular;
            (linear + p, angular + state.pose.to_world(mass.center).cross(p) + spin)
        })
    }

    fn free(&self) -> impl Iterator<Item = (MassProperties, &State)> {
        self.bodies.iter().zip(&self.states).filter_map(|(body, state)| match body.mass {
            Mass::Free(mass) => Some((mass, state)),
            Mass::Fixed => None,
        })
    }
}

impl MassProperties {
    /// Inertia about the centre of mass, axes of the world.
    pub fn inertia_in_world(&self, pose: Pose) -> DMat3 {
        let r = DMat3::from_quat(pose.rotation);
        r * self.inertia * r.transpose()
    }

    /// ½ m v² + ½ ω · I ω, J.
    pub fn kinetic_energy(&self, state: &State) -> f64 {
        let spin = state.pose.rotation.inverse() * state.angular;
        0.5 * (self.mass * state.linear.length_squared() + spin.dot(self.inertia * spin))
    }
}
