use std::collections::BTreeMap;

use glam::{DMat3, DVec3};
use tesdf::collide::{CollideError, Instance, InstanceId, Pose, Scene, Shape, ShapeId, Velocity};

use crate::coupling::{Coupling, Couplings};
use crate::joint::wrapped;
use crate::{DynamicsError, Joint, JointKind, MassProperties, Motor};

mod surface;

/// Whether a body moves, and its mass properties.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Mass {
    /// The body never moves.
    Fixed,
    /// The body moves with the velocities of its state, whatever it meets.
    Kinematic,
    /// The body moves freely.
    Free(MassProperties),
}

/// A rigid body: an instance in the scene, with a name and a mass.
#[derive(Clone, Debug, PartialEq)]
pub struct Body {
    /// Name, for messages and files.
    pub name: String,
    /// The body's instance in the system's scene.
    pub instance: InstanceId,
    /// Fixed, kinematic, or its mass properties.
    pub mass: Mass,
    /// Coefficient of friction, see [`System::friction`].
    pub friction: f64,
    /// Coefficient of torsional friction, m, see [`System::friction_torsional`].
    pub friction_torsional: f64,
    /// Coefficient of restitution, see [`System::restitution`].
    pub restitution: f64,
    /// Rate at which the velocity of a free body's centre of mass decays, 1/s: in a step of h
    /// seconds, it is divided by 1 + h times this before forces act.
    pub linear_damping: f64,
    /// Likewise of its angular velocity, 1/s.
    pub angular_damping: f64,
}

/// A force and a torque that act on a body from outside, in the world frame.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Wrench {
    /// Force on the centre of mass, N.
    pub force: DVec3,
    /// Torque about the centre of mass, N m.
    pub torque: DVec3,
}

/// Pose and velocities of a body, in the world frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct State {
    /// Pose of the body's frame, which is the frame of its mesh or shape.
    pub pose: Pose,
    /// Velocity of the centre of mass, m/s; of a kinematic body that of its frame's origin; zero
    /// for a fixed body.
    pub linear: DVec3,
    /// Angular velocity, rad/s.
    pub angular: DVec3,
}

impl State {
    /// A state at rest.
    pub fn at_rest(pose: Pose) -> Self {
        Self { pose, linear: DVec3::ZERO, angular: DVec3::ZERO }
    }

    /// Whether it moves.
    pub(crate) fn has_velocity(&self) -> bool {
        self.linear != DVec3::ZERO || self.angular != DVec3::ZERO
    }

    /// Whether all numbers are finite.
    pub fn is_finite(&self) -> bool {
        self.pose.translation.is_finite()
            && self.pose.rotation.is_finite()
            && self.linear.is_finite()
            && self.angular.is_finite()
    }
}

/// Bodies, their states, and gravity.
///
/// The scene holds the geometry and the poses at the last detection. The current poses and
/// velocities are the states of the system; [`scene_at`](Self::scene_at) copies states into the
/// scene.
#[derive(Clone, Debug, Default)]
pub struct System {
    scene: Scene,
    bodies: Vec<Body>,
    states: Vec<State>,
    wrenches: Vec<Wrench>,
    joints: Vec<Joint>,
    couplings: Couplings,
    /// The coordinate of each joint, with its whole turns.
    coordinates: Vec<f64>,
    /// Coefficients of friction of pairs of bodies, the lower number first.
    pair_friction: BTreeMap<(usize, usize), f64>,
    /// Likewise of torsional friction, m.
    pair_friction_torsional: BTreeMap<(usize, usize), f64>,
    /// Acceleration of every free body, m/s².
    pub gravity: DVec3,
}

impl System {
    /// A system without bodies, where `gravity` is an acceleration in m/s².
    pub fn new(gravity: DVec3) -> Self {
        Self { gravity, ..Self::default() }
    }

    /// Adds a shape, which several bodies may share.
    ///
    /// # Errors
    /// The same errors as [`Scene::add_shape`].
    pub fn add_shape(&mut self, shape: impl Into<Shape>) -> Result<ShapeId, CollideError> {
        self.scene.add_shape(shape)
    }

    /// Adds a body and returns its number: 0, 1, 2, … in the order of the calls. A free or
    /// kinematic body starts with the velocity of `instance`. Its coefficients of friction and
    /// restitution and its damping are 0.
    ///
    /// # Errors
    /// The same errors as [`Scene::add`].
    pub fn add(
        &mut self,
        name: impl Into<String>,
        instance: Instance,
        mass: Mass,
    ) -> Result<usize, CollideError> {
        let id = self.scene.add(instance)?;
        let Instance { pose, velocity, .. } = *self.scene.instance(id)?;
        let mut state = State::at_rest(pose);
        match mass {
            Mass::Fixed => {}
            Mass::Kinematic => (state.linear, state.angular) = (velocity.linear, velocity.angular),
            Mass::Free(mass) => {
                let arm = pose.rotation * mass.center;
                (state.linear, state.angular) =
                    (velocity.linear + velocity.angular.cross(arm), velocity.angular);
            }
        }
        self.bodies.push(Body {
            name: name.into(),
            instance: id,
            mass,
            friction: 0.0,
            friction_torsional: 0.0,
            restitution: 0.0,
            linear_damping: 0.0,
            angular_damping: 0.0,
        });
        self.states.push(state);
        self.wrenches.push(Wrench::default());
        Ok(self.bodies.len() - 1)
    }

    /// Excludes contacts between two bodies from now on.
    ///
    /// # Errors
    /// [`DynamicsError::NoBody`].
    pub fn exclude(&mut self, a: usize, b: usize) -> Result<(), DynamicsError> {
        let [a, b] = [self.body(a)?.instance, self.body(b)?.instance];
        Ok(self.scene.exclude(a, b)?)
    }

    /// Adds a joint and returns its number: 0, 1, 2, … in the order of the calls. The two bodies of
    /// a joint have no contacts with each other.
    ///
    /// # Errors
    /// [`DynamicsError::NoBody`], or [`DynamicsError::Joint`] when its values do not fit its kind
    /// or neither of its bodies is free.
    pub fn add_joint(&mut self, joint: Joint) -> Result<usize, DynamicsError> {
        let refuse = |reason| DynamicsError::Joint { name: joint.name.clone(), reason };
        joint.validate().map_err(refuse)?;
        let is_free = |body: usize| Ok::<_, DynamicsError>(matches!(self.body(body)?.mass, Mass::Free(_)));
        let parent_is_free = joint.parent.map_or(Ok(false), is_free)?;
        if !is_free(joint.child)? && !parent_is_free {
            return Err(refuse("neither of its bodies is free; a joint needs one that can move".into()));
        }
        if let Some(parent) = joint.parent {
            self.exclude(parent, joint.child)?;
        }
        self.coordinates.push(joint.coordinate(Self::poses_of(&joint, &self.states)));
        self.joints.push(joint);
        Ok(self.joints.len() - 1)
    }

    /// The joints.
    pub fn joints(&self) -> &[Joint] {
        &self.joints
    }

    /// Adds a coupling of two joints. An engine refuses a system in which couplings do not hold at
    /// the start.
    ///
    /// # Errors
    /// [`DynamicsError::NoJoint`], or [`DynamicsError::Joint`] when a joint is neither a hinge nor
    /// a slider, a number is out of range, or a joint would follow two others or itself.
    pub fn add_coupling(&mut self, coupling: Coupling) -> Result<(), DynamicsError> {
        self.couplings.add(coupling, &self.joints)?;
        self.couplings.count_turns(&self.joints, &mut self.coordinates);
        Ok(())
    }

    /// Checks whether all couplings hold.
    ///
    /// # Errors
    /// [`DynamicsError::Joint`] with a joint that is not where its coupling asks it to be.
    pub(crate) fn check_couplings(&self) -> Result<(), DynamicsError> {
        self.couplings.check(&self.joints, &self.coordinates)
    }

    /// The couplings of joints.
    pub fn couplings(&self) -> &[Coupling] {
        self.couplings.all()
    }

    /// The [coordinate](Joint::coordinate) of each joint now, where the angle of a hinge goes on past
    /// ±π: it counts the turns that steps have made since the joint was added. A state that is set
    /// from outside counts as the shortest turn, or as that which a coupling asks for.
    pub fn coordinates(&self) -> &[f64] {
        &self.coordinates
    }

    /// The rates of the [coordinates](Joint::coordinate) now, rad/s or m/s; 0 for welds and balls.
    pub fn coordinate_rates(&self) -> Vec<f64> {
        self.joints.iter().map(|joint| self.rate_of(joint, &self.states)).collect()
    }

    /// The rate of the coordinate of a joint at `states`.
    pub(crate) fn rate_of(&self, joint: &Joint, states: &[State]) -> f64 {
        if matches!(joint.kind, JointKind::Weld | JointKind::Ball) {
            return 0.0;
        }
        let [parent, child] = joint.frames_in_world(Self::poses_of(joint, states));
        let axis = parent.rotation * DVec3::Z;
        // Of a body's point that is at the origin of the child's frame now.
        let velocity = |body: usize| {
            let state = &states[body];
            let center = match self.bodies[body].mass {
                Mass::Free(mass) => mass.center,
                Mass::Fixed | Mass::Kinematic => DVec3::ZERO,
            };
            let arm = child.translation - state.pose.to_world(center);
            (state.linear + state.angular.cross(arm), state.angular)
        };
        let (linear, angular) = velocity(joint.child);
        let (of_parent, turning) = joint.parent.map_or((DVec3::ZERO, DVec3::ZERO), velocity);
        match joint.kind {
            JointKind::Hinge => axis.dot(angular - turning),
            JointKind::Slider => axis.dot(linear - of_parent),
            JointKind::Weld | JointKind::Ball => 0.0,
        }
    }

    /// Replaces all states by those after a motion of `time` seconds: hinges have turned as their
    /// rates tell.
    ///
    /// # Errors
    /// As [`set_states`](Self::set_states).
    pub(crate) fn follow(&mut self, states: Vec<State>, time: f64) -> Result<(), DynamicsError> {
        let turned = self.joints.iter().zip(&self.coordinates).map(|(joint, before)| {
            let rates = self.rate_of(joint, &self.states) + self.rate_of(joint, &states);
            before + 0.5 * time * rates
        });
        let turned: Vec<f64> = turned.collect();
        self.replace_states(states, turned)
    }

    /// Replaces all states, at which the angles of hinges are near `turned`.
    fn replace_states(&mut self, states: Vec<State>, turned: Vec<f64>) -> Result<(), DynamicsError> {
        if states.len() != self.bodies.len() {
            return Err(DynamicsError::States { found: states.len(), expected: self.bodies.len() });
        }
        states.iter().enumerate().try_for_each(|(body, state)| self.check(body, state))?;
        self.states = states;
        let coordinates = self.joints.iter().zip(turned).map(|(joint, near)| self.coordinate(joint, near));
        self.coordinates = coordinates.collect();
        self.couplings.count_turns(&self.joints, &mut self.coordinates);
        Ok(())
    }

    /// The coordinate of a joint now; of a hinge the one of all turns that is nearest to `near`.
    fn coordinate(&self, joint: &Joint, near: f64) -> f64 {
        let coordinate = joint.coordinate(Self::poses_of(joint, &self.states));
        match joint.kind {
            JointKind::Hinge => near + wrapped(coordinate - near),
            JointKind::Slider | JointKind::Weld | JointKind::Ball => coordinate,
        }
    }

    /// Replaces the motor of a joint.
    ///
    /// # Errors
    /// [`DynamicsError::NoJoint`], or [`DynamicsError::Joint`] when the motor does not fit the
    /// joint.
    pub fn set_motor(&mut self, joint: usize, motor: Option<Motor>) -> Result<(), DynamicsError> {
        let joints = self.joints.len();
        let old = self.joints.get_mut(joint).ok_or(DynamicsError::NoJoint { joint, joints })?;
        let new = Joint { motor, ..old.clone() };
        new.validate().map_err(|reason| DynamicsError::Joint { name: new.name.clone(), reason })?;
        *old = new;
        Ok(())
    }

    /// The poses of the parent and the child of a joint at `states`; a missing parent is at the
    /// origin.
    pub fn poses_of(joint: &Joint, states: &[State]) -> [Pose; 2] {
        [joint.parent.map_or(Pose::IDENTITY, |parent| states[parent].pose), states[joint.child].pose]
    }

    /// Sets the mass properties of a free body. Its points keep their velocities.
    ///
    /// # Errors
    /// [`DynamicsError::NoBody`], or [`DynamicsError::NoMass`] when the body is fixed or kinematic.
    pub fn set_mass(&mut self, body: usize, mass: MassProperties) -> Result<(), DynamicsError> {
        let Body { name, mass: before, .. } = self.body(body)?;
        let center = match before {
            Mass::Free(before) => before.center,
            Mass::Fixed => return Err(DynamicsError::NoMass { body, name: name.clone(), kind: "fixed" }),
            Mass::Kinematic => {
                return Err(DynamicsError::NoMass { body, name: name.clone(), kind: "kinematic" });
            }
        };
        let state = &mut self.states[body];
        state.linear += state.angular.cross(state.pose.rotation * (mass.center - center));
        self.bodies[body].mass = Mass::Free(mass);
        Ok(())
    }

    /// Sets the [linear damping](Body::linear_damping) of a body, 1/s.
    ///
    /// # Errors
    /// The same errors as [`set_friction`](Self::set_friction).
    pub fn set_linear_damping(&mut self, body: usize, damping: f64) -> Result<(), DynamicsError> {
        self.body(body)?;
        self.bodies[body].linear_damping = not_negative("linear_damping", damping)?;
        Ok(())
    }

    /// Sets the [angular damping](Body::angular_damping) of a body, 1/s.
    ///
    /// # Errors
    /// The same errors as [`set_friction`](Self::set_friction).
    pub fn set_angular_damping(&mut self, body: usize, damping: f64) -> Result<(), DynamicsError> {
        self.body(body)?;
        self.bodies[body].angular_damping = not_negative("angular_damping", damping)?;
        Ok(())
    }

    /// Sets the wrench that acts on a body from now on. It has no effect on fixed and kinematic
    /// bodies.
    ///
    /// # Errors
    /// [`DynamicsError::NoBody`], or [`DynamicsError::NotFinite`].
    pub fn set_wrench(&mut self, body: usize, wrench: Wrench) -> Result<(), DynamicsError> {
        let name = &self.body(body)?.name;
        if !wrench.force.is_finite() || !wrench.torque.is_finite() {
            let found = format!("{wrench:?}");
            return Err(DynamicsError::NotFinite { body, name: name.clone(), found });
        }
        self.wrenches[body] = wrench;
        Ok(())
    }

    /// The wrenches on the bodies.
    pub fn wrenches(&self) -> &[Wrench] {
        &self.wrenches
    }

    /// The bodies.
    pub fn bodies(&self) -> &[Body] {
        &self.bodies
    }

    /// The current states of the bodies.
    pub fn states(&self) -> &[State] {
        &self.states
    }

    /// The geometry. Its instances have the poses of the last detection; [`states`](Self::states)
    /// has the current poses.
    pub fn scene(&self) -> &Scene {
        &self.scene
    }

    /// One body, by its number.
    ///
    /// # Errors
    /// [`DynamicsError::NoBody`].
    pub fn body(&self, body: usize) -> Result<&Body, DynamicsError> {
        self.bodies.get(body).ok_or(DynamicsError::NoBody { body, bodies: self.bodies.len() })
    }

    /// Diagonal of the bounding box of a body, m.
    ///
    /// # Errors
    /// The scene lacks its instance or shape.
    pub(crate) fn diagonal(&self, body: &Body) -> Result<f64, CollideError> {
        let instance = self.scene.instance(body.instance)?;
        Ok(self.scene.shape(instance.shape)?.diagonal() * instance.scale)
    }

    /// The number of the body of an instance.
    pub fn body_of(&self, instance: InstanceId) -> Option<usize> {
        // Instances are numbered in the order in which they are added, so the bodies are sorted by
        // them.
        self.bodies.binary_search_by_key(&instance, |body| body.instance).ok()
    }

    /// Replaces the state of a body.
    ///
    /// # Errors
    /// [`DynamicsError::NoBody`], [`DynamicsError::NotFinite`], or [`DynamicsError::Collide`] when
    /// the rotation is not of unit length.
    pub fn set_state(&mut self, body: usize, state: State) -> Result<(), DynamicsError> {
        self.check(body, &state)?;
        let pose = Pose::new(state.pose.translation, state.pose.rotation)?;
        self.states[body] = State { pose, ..state };
        for (k, joint) in self.joints.iter().enumerate() {
            if joint.child == body || joint.parent == Some(body) {
                self.coordinates[k] = self.coordinate(joint, self.coordinates[k]);
            }
        }
        self.couplings.count_turns(&self.joints, &mut self.coordinates);
        Ok(())
    }

    /// Replaces all states bit for bit. Rotations must be of unit length; this is not checked. On
    /// an error no state changes.
    ///
    /// # Errors
    /// [`DynamicsError::NotFinite`], or [`DynamicsError::States`] when the number of states differs
    /// from the number of bodies.
    pub fn set_states(&mut self, states: Vec<State>) -> Result<(), DynamicsError> {
        self.replace_states(states, self.coordinates.clone())
    }

    /// Begins again with these states: coordinates of joints are counted anew, and wrenches are
    /// zero. Rotations of unit length stay bit for bit, up to rounding. On an error nothing
    /// changes.
    ///
    /// # Errors
    /// As [`set_states`](Self::set_states), [`DynamicsError::Collide`] when a rotation is not
    /// of unit length, and [`DynamicsError::Joint`] when a coupling does not hold.
    pub fn reset(&mut self, mut states: Vec<State>) -> Result<(), DynamicsError> {
        for (body, state) in states.iter_mut().enumerate().take(self.bodies.len()) {
            self.check(body, state)?;
            if (state.pose.rotation.length() - 1.0).abs() > 4.0 * f64::EPSILON {
                state.pose = Pose::new(state.pose.translation, state.pose.rotation)?;
            }
        }
        let before = (self.states.clone(), self.coordinates.clone());
        // Of the turns of hinges, none counts.
        self.replace_states(states, vec![0.0; self.joints.len()])?;
        if let Err(e) = self.check_couplings() {
            (self.states, self.coordinates) = before;
            return Err(e);
        }
        self.wrenches.fill(Wrench::default());
        Ok(())
    }

    fn check(&self, body: usize, state: &State) -> Result<(), DynamicsError> {
        let name = &self.body(body)?.name;
        if state.is_finite() {
            return Ok(());
        }
        Err(DynamicsError::NotFinite { body, name: name.clone(), found: format!("{state:?}") })
    }

    /// Moves the instances of the scene to `states` and sets their velocities. Returns the scene.
    ///
    /// # Errors
    /// The same errors as [`Scene::update`].
    pub fn scene_at(&mut self, states: &[State]) -> Result<&Scene, CollideError> {
        self.scene_with(states.iter().copied().enumerate())
    }

    /// The scene with these bodies in these states, and the others as they were in it.
    pub(crate) fn scene_with(
        &mut self,
        states: impl IntoIterator<Item = (usize, State)>,
    ) -> Result<&Scene, CollideError> {
        let mut updates = Vec::with_capacity(self.bodies.len());
        for (body, state) in states {
            let body = &self.bodies[body];
            let before = *self.scene.instance(body.instance)?;
            let velocity = Self::velocity_of_origin(body, &state);
            updates.push((body.instance, Instance { pose: state.pose, velocity, ..before }));
        }
        self.scene.update(&updates)?;
        Ok(&self.scene)
    }

    /// The velocity of the origin of a body, and its angular velocity, in a state.
    pub(crate) fn velocity_of_origin(body: &Body, state: &State) -> Velocity {
        match body.mass {
            Mass::Fixed => Velocity::default(),
            Mass::Kinematic => Velocity { linear: state.linear, angular: state.angular },
            Mass::Free(mass) => {
                let arm = state.pose.rotation * mass.center;
                Velocity { linear: state.linear - state.angular.cross(arm), angular: state.angular }
            }
        }
    }

    /// Marks instances of the scene as still, and no others.
    pub(crate) fn set_still(&mut self, ids: impl IntoIterator<Item = InstanceId>) {
        self.scene.set_still(ids);
    }

    /// Kinetic energy of all free bodies, J.
    pub fn kinetic_energy(&self) -> f64 {
        self.free().map(|(mass, state)| mass.kinetic_energy(state)).sum()
    }

    /// Potential energy of all free bodies, J; it is zero when the centre of mass is at the world's
    /// origin.
    pub fn potential_energy(&self) -> f64 {
        self.free().map(|(mass, state)| -mass.mass * self.gravity.dot(state.pose.to_world(mass.center))).sum()
    }

    /// Linear momentum, kg m/s, and angular momentum about the world's origin, kg m²/s, of all free
    /// bodies.
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
            Mass::Fixed | Mass::Kinematic => None,
        })
    }
}

/// A finite number, 0 or greater, or an error that names the option.
pub fn not_negative(option: &'static str, found: f64) -> Result<f64, DynamicsError> {
    match found >= 0.0 && found.is_finite() {
        true => Ok(found),
        false => Err(DynamicsError::Option { option, found, expected: "a finite number, 0 or greater" }),
    }
}

impl MassProperties {
    /// Inertia about the centre of mass, kg m², along the axes of the world.
    pub fn inertia_in_world(&self, pose: Pose) -> DMat3 {
        let r = DMat3::from_quat(pose.rotation);
        r * self.inertia * r.transpose()
    }

    /// Kinetic energy ½ m v² + ½ ω · I ω, J.
    pub fn kinetic_energy(&self, state: &State) -> f64 {
        let spin = state.pose.rotation.inverse() * state.angular;
        0.5 * (self.mass * state.linear.length_squared() + spin.dot(self.inertia * spin))
    }
}
