//! Tests of bodies in Rapier with contacts of encoded meshes.

use std::sync::Arc;

use crate::support::{cube, data, steel};
use tesdf::collide::{CollideOptions, Groups, Instance, Mode, Pose, Reduction, Shape};
use tesdf::glam::{DQuat, DVec3};
use tesdf_rapier::{RapierEngine, RapierOptions};
use tesdf_sim::criterion::{ScrewCriterion, ScrewTracker, Tracker};
use tesdf_sim::{Dynamics, DynamicsError, Joint, JointKind, Mass, State, System, Wrench};

const GRAVITY: DVec3 = DVec3::new(0.0, 0.0, -9.81);

fn collide(mode: Mode) -> CollideOptions {
    CollideOptions { contact_distance: 2e-4, ..CollideOptions::with_mode(mode) }
}

fn engine(system: System, collide: CollideOptions) -> RapierEngine {
    RapierEngine::new(system, collide, RapierOptions::default()).expect("options that make sense")
}

fn add(system: &mut System, name: &str, shape: Shape, pose: Pose, mass: Mass) -> usize {
    let shape = system.add_shape(shape).expect("a shape");
    system.add(name, Instance::new(shape, pose), mass).expect("a pose")
}

/// A cube of 2 cm, as a mesh or as a box, above a plane. `turn` rotates the whole scene.
fn over_plane(shape: Shape, turn: DQuat) -> System {
    let mut system = System::new(turn * GRAVITY);
    add(&mut system, "plane", Shape::Plane, Pose { translation: DVec3::X, rotation: turn }, Mass::Fixed);
    let mass = Mass::Free(steel(&shape));
    let pose = Pose { translation: DVec3::X + turn * DVec3::new(0.0, 0.0, 0.0105), rotation: turn };
    add(&mut system, "cube", shape, pose, mass);
    system
}

#[test]
fn a_cube_comes_to_rest_on_a_plane() {
    let turn = DQuat::from_rotation_y(0.7);
    for shape in [Shape::Mesh(Arc::new(cube(0.01))), Shape::Box { half_extents: DVec3::splat(0.01) }] {
        let mut engine = engine(over_plane(shape.clone(), turn), collide(Mode::Node));
        let weight = steel(&shape).mass * 9.81;
        for _ in 0..150 {
            engine.step(1e-3).expect("a step");
        }
        let state = engine.system().states()[1];
        let up = turn.inverse() * (state.pose.translation - DVec3::X);
        assert!((up - DVec3::new(0.0, 0.0, 0.01)).length() < 2e-6, "{up}");
        assert!(state.linear.length() < 1e-3 && state.angular.length() < 1e-1, "{state:?}");
        assert!(!engine.contacts().is_empty());
        assert!(engine.contacts().iter().all(|c| (c.normal.dot(turn * DVec3::Z).abs() - 1.0).abs() < 1e-6));
        // The impulses of the manifolds carry the weight.
        let impulse = impulses(&engine).iter().sum::<f64>();
        let share = impulse / (weight * 1e-3);
        assert!((share - 1.0).abs() < 0.05, "{share} of the weight");
    }
}

/// Impulse of each contact in the last step, N s.
fn impulses(engine: &RapierEngine) -> Vec<f64> {
    let world = engine.rapier().expect("it made a step");
    world
        .contact_pairs()
        .flat_map(|pair| pair.manifolds())
        .flat_map(|m| &m.points)
        .map(|p| p.data.impulse)
        .collect()
}

#[test]
fn a_nut_turns_down_its_bolt() {
    let mut system = System::new(GRAVITY);
    let nut = Shape::Mesh(Arc::new(data("iso_m16_nut_c100")));
    add(
        &mut system,
        "bolt",
        Shape::Mesh(Arc::new(data("iso_m16_bolt_6k"))),
        Pose::at(DVec3::ZERO),
        Mass::Fixed,
    );
    let mass = Mass::Free(steel(&nut));
    add(&mut system, "nut", nut, Pose::at(DVec3::new(0.0, 0.0, 8e-3)), mass);
    let criterion = ScrewCriterion {
        body: "nut".into(),
        axis: [0.0, 0.0, -1.0],
        pitch: 2e-3,
        min_turns: 0.015,
        backlash: 1.5e-4,
        min_acceleration: 0.0,
        max_energy: 1.001,
    };
    let collide = CollideOptions { reduction: Reduction::PerPair(64), ..collide(Mode::Node) };
    let mut engine = engine(system, collide);
    let mut tracker = ScrewTracker::new(&criterion, engine.system()).expect("a free body");
    let mut deepest = 0.0_f64;
    for _ in 0..100 {
        let report = engine.step(1e-3).expect("a step");
        assert!(report.contacts <= 128, "{}", report.contacts);
        deepest = deepest.min(report.deepest.unwrap_or(0.0));
        tracker.observe(engine.system(), 1e-3);
    }
    let report = tracker.report(engine.system());
    assert!(report.failures.is_empty(), "{report:?}");
    assert!(deepest > -2e-5, "{deepest}");
    assert!(report.acceleration < 1.5 * report.analytic_acceleration, "{report:?}");
}

#[test]
fn groups_worlds_and_exclusions_are_respected() {
    let ball = Shape::Sphere { radius: 0.01 };
    let mass = Mass::Free(steel(&ball));
    let mut system = System::new(GRAVITY);
    let plane = add(&mut system, "plane", Shape::Plane, Pose::at(DVec3::ZERO), Mass::Fixed);
    let shape = system.add_shape(ball).expect("a shape");
    // The balls lie side by side, because they also meet each other.
    let at = |x: f64| Instance::new(shape, Pose::at(DVec3::new(x, 0.0, 0.01)));
    let lies = system.add("lies", at(0.0), mass).expect("a pose");
    let other_world = system.add("other world", Instance { world: 1, ..at(0.1) }, mass).expect("a pose");
    let groups = Groups { memberships: 2, filter: 2 };
    let other_plane_only = Instance { groups, ..at(0.2) };
    let meets_own_group = system.add("own group", other_plane_only, mass).expect("a pose");
    let excluded = system.add("excluded", at(0.3), mass).expect("a pose");
    system.exclude(plane, excluded).expect("bodies");
    let mut engine = engine(system, collide(Mode::exact()));
    for _ in 0..50 {
        engine.step(1e-3).expect("a step");
    }
    let height = |body: usize| engine.system().states()[body].pose.translation.z;
    assert!((height(lies) - 0.01).abs() < 1e-5, "{}", height(lies));
    // The plane is in all groups and meets all groups, so it also meets this one.
    assert!((height(meets_own_group) - 0.01).abs() < 1e-5, "{}", height(meets_own_group));
    for body in [other_world, excluded] {
        assert!(height(body) < 0.0, "{} is at {}", engine.system().bodies()[body].name, height(body));
    }
}

#[test]
fn free_motion_keeps_momentum() {
    let shape = Shape::Box { half_extents: DVec3::new(0.01, 0.02, 0.03) };
    let mass = steel(&shape);
    let mut system = System::new(DVec3::ZERO);
    let body = add(&mut system, "box", shape, Pose::at(DVec3::ZERO), Mass::Free(mass));
    let mut engine = engine(system, collide(Mode::exact()));
    let state = State {
        linear: DVec3::X,
        angular: DVec3::new(1.0, 20.0, 2.0),
        ..State::at_rest(Pose::at(DVec3::ZERO))
    };
    engine.set_state(body, state).expect("a state");
    let (linear, angular) = engine.system().momentum();
    let energy = engine.system().kinetic_energy();
    for _ in 0..200 {
        engine.step(1e-3).expect("a step");
    }
    let (linear_after, angular_after) = engine.system().momentum();
    assert!(linear_after.distance(linear) < 1e-12 * linear.length());
    assert!(angular_after.distance(angular) < 1e-2 * angular.length(), "{angular} {angular_after}");
    assert!((engine.system().kinetic_energy() / energy - 1.0).abs() < 1e-2);
    assert!((engine.system().states()[body].pose.translation - DVec3::X * 0.2).length() < 1e-9);
}

#[test]
fn a_state_set_between_steps_starts_the_next_step() {
    let shape = Shape::Mesh(Arc::new(cube(0.01)));
    let mut engine = engine(over_plane(shape, DQuat::IDENTITY), collide(Mode::Node));
    for _ in 0..20 {
        engine.step(1e-3).expect("a step");
    }
    assert!(!engine.contacts().is_empty());
    // The body goes up and comes back, so contacts disappear and appear again.
    for height in [0.05, 0.0101, 0.5, 0.01] {
        let pose = Pose::at(DVec3::new(1.0, 0.0, height));
        engine.set_state(1, State::at_rest(pose)).expect("a state");
        engine.step(1e-3).expect("a step");
        let near = height < 0.011;
        assert_eq!(!engine.contacts().is_empty(), near, "at {height}");
        let least = engine.contacts().iter().map(|c| c.distance).fold(f64::INFINITY, f64::min);
        assert!(!near || (least - (height - 0.01)).abs() < 1e-9, "{least} at {height}");
    }
    // Another time step changes the prediction distance.
    engine.step(5e-3).expect("a step");
    assert!(!engine.contacts().is_empty());
}

#[test]
fn the_same_steps_give_the_same_bits() {
    let run = || {
        let shape = Shape::Mesh(Arc::new(cube(0.01)));
        let mut system = over_plane(shape.clone(), DQuat::IDENTITY);
        let pose =
            Pose { translation: DVec3::new(1.003, 0.002, 0.031), rotation: DQuat::from_rotation_x(0.1) };
        let mass = Mass::Free(steel(&shape));
        add(&mut system, "second", shape, pose, mass);
        let mut engine = engine(system, collide(Mode::Node));
        for _ in 0..100 {
            engine.step(1e-3).expect("a step");
        }
        (engine.system().states().to_vec(), engine.contacts().to_vec())
    };
    assert_eq!(run(), run());
}

#[test]
fn values_out_of_range_are_refused() {
    let system = || over_plane(Shape::Box { half_extents: DVec3::splat(0.01) }, DQuat::IDENTITY);
    let options = RapierOptions { substeps: 0, ..RapierOptions::default() };
    let refused = RapierEngine::new(system(), collide(Mode::Node), options).err();
    assert!(matches!(refused, Some(DynamicsError::Option { option: "substeps", .. })), "{refused:?}");
    let options = CollideOptions { contact_distance: f64::NAN, ..collide(Mode::Node) };
    assert!(RapierEngine::new(system(), options, RapierOptions::default()).is_err());

    let mut engine = engine(system(), collide(Mode::Node));
    for time_step in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        assert!(matches!(engine.step(time_step), Err(DynamicsError::Option { .. })), "{time_step}");
    }
    let before = engine.system().states().to_vec();
    let mut state = before[1];
    state.linear.x = f64::NAN;
    assert!(matches!(engine.set_state(1, state), Err(DynamicsError::NotFinite { body: 1, .. })));
    assert!(matches!(engine.set_state(2, before[1]), Err(DynamicsError::NoBody { .. })));
    // The body is so fast that the step overflows. The states must not change, and the next step
    // must work.
    state.linear = DVec3::splat(f64::MAX);
    engine.set_state(1, state).expect("finite");
    let fast = engine.system().states().to_vec();
    assert!(engine.step(1e3).is_err());
    assert_eq!(engine.system().states(), fast);
    engine.set_state(1, before[1]).expect("a state");
    engine.step(1e-3).expect("a step");
}

#[test]
fn friction_holds_a_box_that_gravity_or_a_wrench_pulls() {
    let half_extents = DVec3::new(0.02, 0.02, 0.01);
    let run = |pull: f64| {
        let shape = Shape::Box { half_extents };
        let mass = steel(&shape);
        let mut system = System::new(GRAVITY);
        let plane = add(&mut system, "plane", Shape::Plane, Pose::at(DVec3::ZERO), Mass::Fixed);
        let body = add(&mut system, "box", shape, Pose::at(0.01 * DVec3::Z), Mass::Free(mass));
        // The geometric mean is 0.4.
        system.set_friction(plane, 0.8).expect("a body");
        system.set_friction(body, 0.2).expect("a body");
        let force = pull * mass.mass * 9.81 * DVec3::X;
        system.set_wrench(body, Wrench { force, torque: DVec3::ZERO }).expect("a body");
        let mut engine = engine(system, collide(Mode::exact()));
        let mut speed_after = |steps: usize| {
            for _ in 0..steps {
                engine.step(1e-3).expect("a step");
            }
            engine.system().states()[body].linear.x
        };
        // The first contacts take some steps to carry the load.
        let first = speed_after(100);
        speed_after(100) - first
    };
    assert!(run(0.35).abs() < 1e-3, "{}", run(0.35));
    // The box slides with the rest of the pull. Rapier's soft contacts give 6 % less friction.
    let friction = 0.5 - run(0.5) / (0.1 * 9.81);
    assert!((friction / 0.4 - 1.0).abs() < 0.1, "{friction} instead of 0.4");
}

#[test]
fn damping_slows_a_motion_and_a_rotation() {
    let shape = Shape::Sphere { radius: 0.02 };
    let mass = Mass::Free(steel(&shape));
    let mut system = System::new(DVec3::ZERO);
    let body = add(&mut system, "ball", shape, Pose::at(DVec3::ZERO), mass);
    system.set_angular_damping(body, 2.0).expect("a rate");
    system.set_linear_damping(body, 3.0).expect("a rate");
    let (way, spin) = (DVec3::new(0.1, 0.2, 0.0), DVec3::new(0.0, 0.0, 5.0));
    let state = State { linear: way, angular: spin, ..system.states()[body] };
    system.set_state(body, state).expect("finite");
    let mut engine = engine(system, collide(Mode::exact()));
    for _ in 0..100 {
        engine.step(1e-3).expect("a step");
    }
    let expected = spin / 1.002f64.powi(100);
    let State { linear, angular: found, .. } = engine.system().states()[body];
    assert!(found.distance(expected) < 1e-9, "{found} instead of {expected}");
    let expected = way / 1.003f64.powi(100);
    assert!(linear.distance(expected) < 1e-9, "{linear} instead of {expected}");
}

#[test]
fn kinematic_bodies_move_and_joints_and_restitution_are_refused() {
    let ball = Shape::Sphere { radius: 0.01 };
    let mut system = System::new(GRAVITY);
    let body = add(&mut system, "wrist", ball.clone(), Pose::at(DVec3::ZERO), Mass::Kinematic);
    let other = add(&mut system, "ball", ball.clone(), Pose::at(DVec3::X), Mass::Free(steel(&ball)));
    let state = State { linear: DVec3::Y, ..State::at_rest(Pose::at(DVec3::ZERO)) };
    system.set_state(body, state).expect("a state");
    let [mut jointed, mut bouncing] = [system.clone(), system.clone()];
    let mut engine = engine(system, collide(Mode::exact()));
    for _ in 0..100 {
        engine.step(1e-3).expect("a step");
    }
    let pose = engine.system().states()[body].pose;
    assert!(pose.translation.distance(0.1 * DVec3::Y) < 1e-9, "{pose:?}");
    let weld = Joint::new("weld", JointKind::Weld, (Some(body), other), [pose; 2], pose);
    jointed.add_joint(weld).expect("a joint");
    bouncing.set_restitution(other, 0.5).expect("a coefficient");
    for (system, what) in [(jointed, "joints"), (bouncing, "restitution")] {
        let error = RapierEngine::new(system, collide(Mode::exact()), RapierOptions::default()).err();
        let message = error.expect("a refusal").to_string();
        assert_eq!(message, format!("Rapier does not simulate {what}; use the built-in engine"));
    }
}
