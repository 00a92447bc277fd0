//! The bodies of a system in Rapier.
use glam::{DQuat, DVec3};
use rapier3d_f64::dynamics::{CoefficientCombineRule, RigidBody, RigidBodyBuilder, RigidBodyHandle};
use rapier3d_f64::geometry::{
    Capsule, Collider, ColliderBuilder, ColliderHandle, Cuboid, Cylinder, HalfSpace, SharedShape, SolverFlags,
};
use rapier3d_f64::parry::mass_properties::MassProperties;
use rapier3d_f64::parry::shape::Ball;
use rapier3d_f64::pipeline::{ActiveHooks, PairFilterContext, PhysicsHooks, PhysicsWorld};
use tesdf::collide::{CollideError, CollideOptions, Instance, Pose, Shape};
use tesdf_sim::{Body, Mass, State, System, Wrench};

use crate::known::{parry_pose, pose};
use crate::record::Record;
use crate::{RapierOptions, TesdfDispatcher, TesdfShape};

/// Rapier's world, and the handles of a system's bodies in it.
pub struct World {
    pub rapier: PhysicsWorld,
    /// The handle of each body, in the order of the system.
    handles: Vec<RigidBodyHandle>,
    /// Prediction distance, m: the contact distance, or more when a body falls farther in a step.
    prediction: f64,
}

impl World {
    /// A world with all bodies in their current states, without impulses of a previous step.
    pub fn new(
        system: &System,
        collide: CollideOptions,
        options: &RapierOptions,
        prediction: f64,
        record: &Record,
    ) -> Result<Self, CollideError> {
        let mut rapier = PhysicsWorld::default();
        let dispatcher = TesdfDispatcher::recording(collide, record.clone());
        rapier.narrow_phase.set_query_dispatcher(dispatcher);
        let mut handles = Vec::with_capacity(system.bodies().len());
        for (number, (body, state)) in system.bodies().iter().zip(system.states()).enumerate() {
            let instance = system.scene().instance(body.instance)?;
            let shape = system.scene().shape(instance.shape)?;
            let (shape, frame) = (parry_shape(shape, instance), frame(shape));
            let handle = rapier.insert_body(rigid_body(number, body, state, options));
            let mut collider = collider(shape, body.friction);
            collider.set_position_wrt_parent(parry_pose(frame));
            rapier.insert_collider(collider, Some(handle));
            handles.push(handle);
        }
        let mut world = Self { rapier, handles, prediction };
        system.wrenches().iter().enumerate().for_each(|(body, &wrench)| world.set_wrench(body, wrench));
        Ok(world)
    }

    pub fn prediction(&self) -> f64 {
        self.prediction
    }

    /// Sets the force and the torque that act on a body from now on.
    pub fn set_wrench(&mut self, body: usize, wrench: Wrench) {
        let Some(body) = self.rapier.bodies.get_mut(self.handles[body]) else { return };
        body.reset_forces(true);
        body.reset_torques(true);
        body.add_force(wrench.force, true);
        body.add_torque(wrench.torque, true);
    }

    pub fn set_state(&mut self, body: usize, state: &State) {
        let Some(body) = self.rapier.bodies.get_mut(self.handles[body]) else { return };
        body.set_position(parry_pose(state.pose), true);
        if !body.is_fixed() {
            body.set_linvel(state.linear, true);
            body.set_angvel(state.angular, true);
        }
    }

    /// The states of all bodies, in order. A fixed body keeps its state of `before`.
    pub fn states(&self, before: &[State]) -> Vec<State> {
        let state = |(handle, before): (&RigidBodyHandle, &State)| match self.rapier.bodies.get(*handle) {
            Some(body) if !body.is_fixed() => {
                State { pose: pose(body.position()), linear: body.linvel(), angular: body.angvel() }
            }
            _ => *before,
        };
        self.handles.iter().zip(before).map(state).collect()
    }

    /// The number of the body that a collider belongs to.
    pub fn body_of(&self, collider: ColliderHandle) -> Option<usize> {
        let parent = self.rapier.colliders.get(collider)?.parent()?;
        number(self.rapier.bodies.get(parent)?)
    }
}

fn number(body: &RigidBody) -> Option<usize> {
    usize::try_from(body.user_data).ok()
}

fn rigid_body(number: usize, body: &Body, state: &State, options: &RapierOptions) -> RigidBody {
    let builder = match body.mass {
        Mass::Fixed => RigidBodyBuilder::fixed(),
        Mass::Kinematic => {
            RigidBodyBuilder::kinematic_velocity_based().linvel(state.linear).angvel(state.angular)
        }
        Mass::Free(mass) => RigidBodyBuilder::dynamic()
            .additional_mass_properties(MassProperties::with_inertia_matrix(
                mass.center,
                mass.mass,
                mass.inertia,
            ))
            .linvel(state.linear)
            .angvel(state.angular)
            .linear_damping(body.linear_damping)
            .angular_damping(body.angular_damping)
            .soft_ccd_prediction(options.speculative_distance)
            .can_sleep(false),
    };
    builder.pose(parry_pose(state.pose)).user_data(number as u128).build()
}

fn collider(shape: SharedShape, friction: f64) -> Collider {
    // The body has the mass, so the collider has none. The product of two roots is the geometric
    // mean, by which a system combines coefficients.
    ColliderBuilder::new(shape)
        .density(0.0)
        .friction(friction.sqrt())
        .friction_combine_rule(CoefficientCombineRule::Multiply)
        .restitution(0.0)
        .active_hooks(ActiveHooks::FILTER_CONTACT_PAIRS)
        .build()
}

/// The pose of parry's shape in the frame of a shape: a cylinder of parry lies along y.
fn frame(shape: &Shape) -> Pose {
    let is_cylinder = matches!(shape, Shape::Cylinder { .. });
    let rotation = if is_cylinder { DQuat::from_rotation_arc(DVec3::Y, DVec3::Z) } else { DQuat::IDENTITY };
    Pose { rotation, ..Pose::IDENTITY }
}

fn parry_shape(shape: &Shape, instance: &Instance) -> SharedShape {
    let scale = instance.scale;
    match *shape {
        Shape::Mesh(ref asset) => match TesdfShape::scaled(asset.clone(), scale) {
            Some(shape) => SharedShape::new(shape),
            // The scene has already checked the scale.
            None => SharedShape::new(TesdfShape::new(asset.clone())),
        },
        Shape::Plane => SharedShape::new(HalfSpace::new(DVec3::Z)),
        Shape::Box { half_extents } => SharedShape::new(Cuboid::new(half_extents * scale)),
        Shape::Sphere { radius } => SharedShape::new(Ball::new(radius * scale)),
        Shape::Capsule { half_height, radius } => {
            let end = DVec3::Z * half_height * scale;
            SharedShape::new(Capsule::new(-end, end, radius * scale))
        }
        Shape::Cylinder { half_height, radius } => {
            SharedShape::new(Cylinder::new(half_height * scale, radius * scale))
        }
    }
}

/// Applies the worlds, groups and excluded pairs of the system's scene.
pub struct MayMeet<'a>(pub &'a System);

impl PhysicsHooks for MayMeet<'_> {
    fn filter_contact_pair(&self, context: &PairFilterContext) -> Option<SolverFlags> {
        let instance = |handle: Option<RigidBodyHandle>| {
            let number = number(context.bodies.get(handle?)?)?;
            let id = self.0.body(number).ok()?.instance;
            Some((id, self.0.scene().instance(id).ok()?))
        };
        let [a, b] = [instance(context.rigid_body1)?, instance(context.rigid_body2)?];
        self.0.scene().may_meet(a, b).then(SolverFlags::default)
    }
}
