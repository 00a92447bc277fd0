//! Worlds that are set, begun again and gone back to make the same steps as single runs.
use std::ops::ControlFlow;

use rayon::ThreadPoolBuilder;
use tesdf::collide::Pose;
use tesdf::glam::{DQuat, DVec3};
use tesdf_sim::newton::Newton;
use tesdf_sim::scene_file::LoadedScene;
use tesdf_sim::{
    Drive, Dynamics, DynamicsError, Mass, MassProperties, Motor, PartialRun, Run, State, World, Worlds,
    Wrench, simulate,
};

/// A stack that falls asleep, a door with a motor, a pendulum of two links, two balls with
/// restitution, two boxes that overlap deeply, and a plate that a script moves.
const ALL: &str = r#"
time_step = 5e-3
duration = 1
[solver]
sleep = 0.1
[[bodies]]
name = "floor"
shape = "plane"
fixed = true
friction = 0.4
[[bodies]]
name = "low"
shape = { box = { half_extents = [0.05, 0.05, 0.05] } }
mass = 1
friction = 0.4
translation = [0, 0, 0.05]
[[bodies]]
name = "high"
shape = { box = { half_extents = [0.05, 0.05, 0.05] } }
mass = 1
friction = 0.4
translation = [0, 0, 0.15]
[[bodies]]
name = "door"
shape = { box = { half_extents = [0.2, 0.02, 0.3] } }
mass = 2
translation = [1.2, 0, 1]
[[bodies]]
name = "upper"
shape = { capsule = { half_height = 0.1, radius = 0.01 } }
mass = 0.2
translation = [3, 0, 1]
[[bodies]]
name = "lower"
shape = { capsule = { half_height = 0.1, radius = 0.01 } }
mass = 0.2
translation = [3.24, 0, 1]
rotation = [0, 0.7071067811865476, 0, 0.7071067811865476]
[[bodies]]
name = "ball"
shape = { sphere = { radius = 0.03 } }
mass = 0.1
restitution = 0.8
friction = 0.4
translation = [5, 0, 0.1]
[[bodies]]
name = "other ball"
shape = { sphere = { radius = 0.03 } }
mass = 0.1
restitution = 0.8
translation = [5, 0.01, 0.3]
[[bodies]]
name = "deep"
shape = { box = { half_extents = [0.05, 0.05, 0.05] } }
mass = 1
friction = 0.4
translation = [7, 0, 0.05]
[[bodies]]
name = "deep too"
shape = { box = { half_extents = [0.05, 0.05, 0.05] } }
mass = 1
friction = 0.4
translation = [7.03, 0.02, 0.1]
[[bodies]]
name = "plate"
shape = { box = { half_extents = [0.1, 0.1, 0.01] } }
kinematic = true
friction = 0.4
translation = [9, 0, 0.5]
[[bodies]]
name = "load"
shape = { box = { half_extents = [0.02, 0.02, 0.02] } }
mass = 0.5
friction = 0.4
translation = [9, 0, 0.531]
[[joints]]
name = "hinge"
kind = "hinge"
child = "door"
anchor = [1, 0, 1]
axis = [0, 0, 1]
motor = { drive = { velocity = 9 }, limit = 5 }
[[joints]]
name = "shoulder"
kind = "ball"
child = "upper"
anchor = [3, 0, 1.12]
[[joints]]
name = "elbow"
kind = "hinge"
parent = "upper"
child = "lower"
anchor = [3.12, 0, 1]
axis = [0, 1, 0]
[[scripts]]
body = "plate"
keyframes = [{ time = 0 }, { time = 0.6, translation = [9.2, 0, 0.6] }]
"#;

fn loaded(text: &str) -> LoadedScene {
    LoadedScene::parse(text.to_string(), "scene.toml").unwrap()
}

fn world(text: &str) -> World {
    let loaded = loaded(text);
    World::new(&loaded.scene, loaded.newton(loaded.system().unwrap()).unwrap()).unwrap()
}

/// Everything that shows of a world, as bytes.
fn bytes(world: &World) -> String {
    let engine = world.engine();
    let (system, forces, contacts) = (engine.system(), engine.forces(), engine.contacts());
    format!("{:?} {:?} {forces:?} {contacts:?} {}", system.states(), system.coordinates(), world.time())
}

/// What shows after each of some steps.
fn course(world: &mut World, steps: usize) -> Vec<String> {
    let step = |_| {
        world.step().unwrap();
        bytes(world)
    };
    (0..steps).map(step).collect()
}

fn body(world: &World, name: &str) -> usize {
    world.engine().system().bodies().iter().position(|body| body.name == name).unwrap()
}

#[test]
fn steps_after_a_snapshot_are_made_again() {
    // At the beginning with its deep bodies, while forces are kept, and after bodies fell asleep.
    let mut world = world(ALL);
    let [low, door] = ["low", "door"].map(|name| body(&world, name));
    for (after, asleep) in [(0, false), (1, false), (7, false), (45, true)] {
        while world.steps() < after {
            world.step().unwrap();
        }
        let snapshot = world.snapshot();
        let mut copy = world.clone();
        let expected = course(&mut world, 25);
        assert_eq!(course(&mut copy, 25), expected, "clone after {after} steps");
        // A push, a motor, a mass and friction are gone as well.
        let engine = world.engine_mut();
        let state = State { linear: DVec3::new(2.0, 0.0, 1.0), ..engine.system().states()[low] };
        engine.set_state(low, state).unwrap();
        engine.set_wrench(door, Wrench { force: DVec3::X, torque: DVec3::Z }).unwrap();
        engine.set_motor(0, None).unwrap();
        engine.set_friction(0, 0.9).unwrap();
        engine.set_gravity(DVec3::new(1.0, 0.0, -3.0)).unwrap();
        let Mass::Free(mass) = engine.system().bodies()[door].mass else { panic!() };
        engine.set_mass(door, mass.with_mass(7.0).unwrap()).unwrap();
        let other = course(&mut world, 25);
        assert_ne!(other, expected);
        for _ in 0..2 {
            world.restore(&snapshot).unwrap();
            assert_eq!(course(&mut world, 25), expected, "restored after {after} steps");
        }
        world.restore(&snapshot).unwrap();
        assert_eq!(world.step().unwrap().asleep > 0, asleep, "after {after} steps");
    }
}

#[test]
fn a_world_that_is_reset_is_a_new_one() {
    let mut fresh = world(ALL);
    let mut reset = fresh.clone();
    course(&mut reset, 70);
    // The door has turned once round, and sleepers have been woken.
    assert!(reset.engine().system().coordinates()[0] > 1.5);
    reset.engine_mut().set_motor(0, None).unwrap();
    reset.engine_mut().set_wrench(1, Wrench { force: DVec3::X, torque: DVec3::Z }).unwrap();
    reset.reset(None).unwrap();
    assert_eq!(bytes(&reset), bytes(&fresh));
    assert_eq!(course(&mut reset, 70), course(&mut fresh, 70));

    // With other states, as an engine that is made with them.
    let mut states = reset.first_states().to_vec();
    let ball = body(&reset, "ball");
    states[ball] = State { linear: DVec3::X, ..State::at_rest(Pose::at(DVec3::new(5.0, 1.0, 0.2))) };
    reset.reset(Some(states)).unwrap();
    let moved = ALL.replace("translation = [5, 0, 0.1]", "translation = [5, 1, 0.2]\nvelocity = [1, 0, 0]");
    assert_eq!(course(&mut reset, 30), course(&mut world(&moved), 30));

    // Masses and friction stay.
    let mut heavy = world(&ALL.replace("mass = 2", "mass = 3"));
    let door = body(&reset, "door");
    let Mass::Free(mass) = heavy.engine().system().bodies()[door].mass else { panic!() };
    reset.engine_mut().set_mass(door, mass).unwrap();
    assert_eq!(reset.first_masses()[door], world(ALL).engine().system().bodies()[door].mass);
    reset.engine_mut().set_friction(0, 0.1).unwrap();
    heavy.engine_mut().set_friction(0, 0.1).unwrap();
    reset.reset(None).unwrap();
    assert_eq!(course(&mut reset, 30), course(&mut heavy, 30));
}

#[test]
fn many_worlds_are_single_ones_on_any_number_of_threads() {
    let text = ALL.replace("[solver]", "gravity = [0, 0, -9]\n[solver]");
    let one = world(&text);
    let friction = |k: usize| 0.1 + 0.05 * k as f64;
    let randomised = |world: &mut World, k: usize| {
        let low = body(world, "low");
        let engine = world.engine_mut();
        engine.set_friction(0, friction(k)).unwrap();
        let Mass::Free(mass) = engine.system().bodies()[low].mass else { panic!() };
        engine.set_mass(low, mass.with_mass(1.0 + 0.1 * k as f64).unwrap()).unwrap();
        engine.set_gravity(DVec3::new(0.3 * k as f64, 0.0, -9.0)).unwrap();
    };
    let of_single = |k: usize| {
        let mut single = world(&text);
        randomised(&mut single, k);
        course(&mut single, 20);
        if k.is_multiple_of(2) {
            single.reset(None).unwrap();
        }
        course(&mut single, 20).pop()
    };
    let expected: Vec<_> = (0..6).map(of_single).collect();
    assert!(expected.windows(2).all(|pair| pair[0] != pair[1]));
    for threads in [1, 2, 4] {
        let pool = ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let found: Vec<_> = pool.install(|| {
            let mut worlds = Worlds::new(&one, 6);
            worlds.as_mut_slice().iter_mut().enumerate().for_each(|(k, world)| randomised(world, k));
            worlds.step(20).unwrap();
            for world in worlds.as_mut_slice().iter_mut().step_by(2) {
                world.reset(None).unwrap();
            }
            (0..20).for_each(|_| worlds.step(1).unwrap());
            worlds.as_slice().iter().map(|world| Some(bytes(world))).collect()
        });
        assert!(found == expected, "{threads} threads");
    }
}

#[test]
fn a_step_that_fails_names_its_world_and_leaves_the_others() {
    let mut worlds = Worlds::new(&world(ALL), 3);
    let far = State::at_rest(Pose::at(DVec3::splat(f64::MAX)));
    let far = State { linear: DVec3::splat(f64::MAX), ..far };
    worlds.as_mut_slice()[1].engine_mut().set_state(6, far).unwrap();
    let error = worlds.step(2).unwrap_err();
    assert!(error.world == 1 && error.to_string().starts_with("world 1: step 0: "), "{error}");
    assert_eq!(worlds.as_slice().iter().map(World::steps).collect::<Vec<_>>(), [2, 0, 2]);
    worlds.as_mut_slice()[1].reset(None).unwrap();
    worlds.step(2).unwrap();
    assert_eq!(worlds.as_slice().iter().map(World::steps).collect::<Vec<_>>(), [4, 2, 4]);
}

/// A box that slides on a plane at 1 m/s, or rests there.
fn slide(velocity: f64) -> Newton {
    let text = format!(
        "time_step = 1e-3\nduration = 1\n[solver]\nsleep = 0.05\n[[bodies]]\nname = \"floor\"\nshape = \
         \"plane\"\nfixed = true\nfriction = 0.2\n[[bodies]]\nname = \"box\"\nmass = 1\nfriction = 0.2\n\
         velocity = [{velocity:?}, 0, 0]\ntranslation = [0, 0, 0.05]\n\
         shape = {{ box = {{ half_extents = [0.05, 0.05, 0.05] }} }}\n"
    );
    let loaded = loaded(&text);
    loaded.newton(loaded.system().unwrap()).unwrap()
}

fn steps(engine: &mut Newton, count: usize) {
    (0..count).for_each(|_| assert!(engine.step(1e-3).unwrap().converged));
}

#[test]
fn friction_and_mass_act_from_the_next_step_on() {
    // v = v₀ − μ g t
    let mut engine = slide(1.0);
    let mut speed = 1.0;
    for (own, friction) in [(0.2, 0.2), (0.8, 0.4), (0.05, 0.1)] {
        engine.set_friction(1, own).unwrap();
        steps(&mut engine, 50);
        speed -= friction * 9.81 * 0.05;
        assert!((engine.system().states()[1].linear.x - speed).abs() < 1e-6, "friction {friction}");
    }
    // a = F / m − μ g
    let Mass::Free(mass) = engine.system().bodies()[1].mass else { panic!() };
    engine.set_mass(1, mass.with_mass(5.0).unwrap()).unwrap();
    engine.set_wrench(1, Wrench { force: DVec3::new(10.0, 0.0, 0.0), torque: DVec3::ZERO }).unwrap();
    steps(&mut engine, 50);
    speed += (10.0 / 5.0 - 0.1 * 9.81) * 0.05;
    assert!((engine.system().states()[1].linear.x - speed).abs() < 1e-5);
}

#[test]
fn a_body_that_sleeps_feels_another_friction() {
    let mut engine = slide(0.0);
    engine.set_gravity(DVec3::new(1.0, 0.0, -9.81)).unwrap();
    let asleep = (0..100).map(|_| engine.step(1e-3).unwrap().asleep).last();
    assert_eq!(asleep, Some(1));
    // That of the floor, which the body only touches: 0.2 g > 1 m/s² > 0.063 g.
    engine.set_friction(0, 0.02).unwrap();
    assert_eq!(engine.step(1e-3).unwrap().asleep, 0);
    steps(&mut engine, 99);
    let expected = 0.1 * (1.0 - 9.81 * (0.02_f64 * 0.2).sqrt());
    assert!((engine.system().states()[1].linear.x - expected).abs() < 1e-5);
}

#[test]
fn the_points_of_a_body_keep_their_velocities_when_its_centre_moves() {
    let mut engine = slide(0.0);
    let turned = Pose { translation: DVec3::Z, rotation: DQuat::from_rotation_z(1.0) };
    let [linear, angular] = [DVec3::X, DVec3::new(1.0, 2.0, 3.0)];
    engine.set_state(1, State { pose: turned, linear, angular }).unwrap();
    let Mass::Free(mass) = engine.system().bodies()[1].mass else { panic!() };
    let center = DVec3::new(0.02, -0.01, 0.03);
    engine.set_mass(1, MassProperties::new(2.0, center, mass.inertia).unwrap()).unwrap();
    let state = engine.system().states()[1];
    let origin = state.linear - state.angular.cross(state.pose.rotation * center);
    assert!(origin.distance(linear) < 1e-15 && state.linear.distance(linear) > 0.01);
}

#[test]
fn what_does_not_fit_is_refused() {
    let mut engine = slide(0.0);
    let Mass::Free(mass) = engine.system().bodies()[1].mass else { panic!() };
    let error = engine.set_mass(0, mass).unwrap_err();
    assert_eq!(error.to_string(), "body 0 (floor) is fixed and has no mass; only a free body has");
    assert_eq!(engine.set_friction(2, 0.1), Err(DynamicsError::NoBody { body: 2, bodies: 2 }));
    assert!(engine.set_friction(1, -0.1).is_err());
    let states = engine.system().states().to_vec();
    let error = engine.reset(states[1..].to_vec()).unwrap_err();
    assert_eq!(error, DynamicsError::States { found: 1, expected: 2 });
    let mut long = states.clone();
    long[1].pose.rotation = DQuat::from_xyzw(0.0, 0.0, 0.0, 2.0);
    assert!(engine.reset(long).unwrap_err().to_string().contains("length 2"));
    assert_eq!(engine.system().states(), states);
    let other = slide(0.0);
    assert_eq!(engine.restore(&other.snapshot()), Err(DynamicsError::OtherEngine));
    engine.clone().restore(&engine.snapshot()).unwrap();
    let motor = Some(Motor { drive: Drive::Velocity(1.0), limit: 1.0 });
    assert!(engine.set_motor(0, motor).is_err());
}

/// A press crushes a box. A world says of it what a run says, and nothing after a reset.
#[test]
fn worlds_tell_what_a_run_tells() {
    let press = r#"
time_step = 5e-3
duration = 0.4
[[bodies]]
name = "floor"
shape = "plane"
fixed = true
[[bodies]]
name = "box"
shape = { box = { half_extents = [0.05, 0.05, 0.05] } }
mass = 1
translation = [0, 0, 0.05]
[[bodies]]
name = "press"
shape = { box = { half_extents = [0.1, 0.1, 0.02] } }
kinematic = true
translation = [0, 0, 0.121]
velocity = [0, 0, -0.1]
"#;
    for mode in ["", "[detector]\nmode = \"node\"\n"] {
        let text = press.to_owned() + mode;
        let loaded = loaded(&text);
        let mut engine = loaded.newton(loaded.system().unwrap()).unwrap();
        let run = simulate(&loaded.scene, &mut engine, |_| ControlFlow::Continue(())).unwrap().1;
        assert!(!run.warnings.is_empty());
        let mut world = world(&text);
        let (first, mut recorded) = (world.snapshot(), world.clone());
        for _ in 0..run.steps {
            world.step().unwrap();
        }
        assert_eq!(world.warnings(), run.warnings);
        assert_eq!(world.unconverged_steps(), run.unconverged_steps);
        let mut record = run_of(&loaded, &recorded);
        (0..run.steps).for_each(|_| recorded.step_of(&mut record).unwrap());
        assert_eq!(recorded.warnings(), run.warnings);
        let last = world.snapshot();
        world.reset(None).unwrap();
        assert_eq!(world.warnings(), []);
        world.restore(&last).unwrap();
        assert_eq!(world.warnings(), run.warnings);
        world.restore(&first).unwrap();
        assert_eq!((world.warnings(), world.unconverged_steps()), (Vec::new(), 0));
    }
}

/// A run that records the steps of a world.
fn run_of(loaded: &LoadedScene, world: &World) -> Run {
    let system = world.engine().system();
    Run::new(&loaded.scene, system, PartialRun::new(&loaded.scene, system, String::new())).unwrap()
}

#[test]
fn a_world_that_records_its_steps_makes_the_same_ones() {
    let [mut recorded, mut alone] = [(); 2].map(|()| world(ALL));
    let mut run = run_of(&loaded(ALL), &recorded);
    for step in 1..=60 {
        recorded.step_of(&mut run).unwrap();
        alone.step().unwrap();
        assert_eq!((bytes(&recorded), recorded.steps()), (bytes(&alone), step));
    }
    assert_eq!(recorded.unconverged_steps(), alone.unconverged_steps());
    assert_eq!(run.record().states(60).unwrap(), alone.engine().system().states());

    // A step that fails is neither counted nor recorded.
    let far = State::at_rest(Pose::at(DVec3::splat(f64::MAX)));
    let far = State { linear: DVec3::splat(f64::MAX), ..far };
    recorded.engine_mut().set_state(6, far).unwrap();
    let error = recorded.step_of(&mut run).unwrap_err().to_string();
    assert!(error.starts_with("step 60: "), "{error}");
    assert_eq!((recorded.steps(), run.record().steps()), (60, 60));
}
