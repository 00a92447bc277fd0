//! Friction, joints, motors and scripts of scene files.

use std::ops::ControlFlow;
use std::path::Path;

use tesdf::glam::DVec3;
use tesdf_sim::scene_file::LoadedScene;
use tesdf_sim::{Joint, RunRecord, Summary, System, simulate};

/// Two fingers on sliders close on a brick and hold it while their wrist lifts it.
const GRIPPER: &str = r#"
time_step = 5e-3
duration = 1.2

[[bodies]]
name = "floor"
shape = "plane"
fixed = true

[[bodies]]
name = "wrist"
shape = { box = { half_extents = [0.06, 0.03, 0.01] } }
kinematic = true
translation = [0, 0, 0.13]

[[bodies]]
name = "left"
shape = { box = { half_extents = [0.005, 0.02, 0.04] } }
mass = 0.1
friction = 0.6
translation = [-0.035, 0, 0.06]

[[bodies]]
name = "right"
shape = { box = { half_extents = [0.005, 0.02, 0.04] } }
mass = 0.1
friction = 0.6
translation = [0.035, 0, 0.06]

[[bodies]]
name = "brick"
shape = { box = { half_extents = [0.02, 0.01, 0.03] } }
mass = 0.2
friction = 0.6
translation = [0, 0, 0.03]

[[joints]]
name = "left"
kind = "slider"
parent = "wrist"
child = "left"
axis = [1, 0, 0]
limits = [-0.02, 0.03]
motor = { drive = { velocity = 0 }, limit = 20 }

[[joints]]
name = "right"
kind = "slider"
parent = "wrist"
child = "right"
axis = [-1, 0, 0]
limits = [-0.02, 0.03]
motor = { drive = { velocity = 0 }, limit = 20 }

[[scripts]]
joint = "left"
interpolation = "step"
keyframes = [{ time = 0, target = 0.05 }]

[[scripts]]
joint = "right"
interpolation = "step"
keyframes = [{ time = 0, target = 0.05 }]

[[scripts]]
body = "wrist"
keyframes = [{ time = 0.3 }, { time = 0.8, translation = [0, 0, 0.18] }]

[detector]
contact_distance = 5e-4
"#;

fn load(text: &str) -> LoadedScene {
    LoadedScene::parse(text.into(), Path::new("scene.toml")).unwrap()
}

fn run(text: &str) -> (RunRecord, Summary, System) {
    let loaded = load(text);
    let mut engine = loaded.newton(loaded.system().unwrap()).unwrap();
    let (record, summary) = simulate(&loaded.scene, &mut engine, |_| ControlFlow::Continue(())).unwrap();
    let system = tesdf_sim::Dynamics::system(&engine).clone();
    (record, summary, system)
}

#[test]
fn a_gripper_lifts_a_brick_by_friction() {
    let (record, summary, system) = run(GRIPPER);
    assert_eq!(summary.unconverged_steps, 0);
    let drift = summary.joint_drift.unwrap();
    assert!(drift.distance < 1e-6 && drift.angle < 1e-6, "{drift:?}");
    let height = |step: usize| record.states(step).unwrap()[4].pose.translation.z;
    assert!((height(240) - height(60) - 0.05).abs() < 1e-5, "{} to {}", height(60), height(240));
    // From 0.8 s on it is held, and creeps by less than 0.01 mm/s.
    let creep = (height(240) - height(165)) / 0.375;
    assert!(creep.abs() < 1e-5, "{creep} m/s");
    assert!(system.states()[4].pose.rotation.xyz().length() < 1e-4, "{:?}", system.states()[4]);
}

#[test]
fn without_friction_the_brick_stays() {
    let (_, _, system) = run(&GRIPPER.replace("friction = 0.6", "friction = 0"));
    assert!(system.states()[4].pose.translation.z < 0.031, "{:?}", system.states()[4]);
}

#[test]
fn friction_of_a_pair_counts_more_than_that_of_its_bodies() {
    let pair = "[[friction]]\nbodies = [\"brick\", \"left\"]\ncoefficient = 0\n\n";
    let one = format!("{GRIPPER}\n{pair}");
    let both = format!("{one}\n{}", pair.replace("left", "right"));
    let (_, _, system) = run(&both);
    assert!(system.states()[4].pose.translation.z < 0.031, "{:?}", system.states()[4]);
}

/// A motor that follows a script of positions, on a hinge that turns more than once.
#[test]
fn a_position_motor_follows_its_script() {
    let text = r#"
        time_step = 2e-3
        duration = 1.0
        [[bodies]]
        name = "wheel"
        shape = { sphere = { radius = 0.02 } }
        mass = 0.1
        [[joints]]
        name = "axle"
        kind = "hinge"
        child = "wheel"
        motor = { drive = { position = 0 }, limit = 10 }
        [[scripts]]
        joint = "axle"
        interpolation = "linear"
        keyframes = [{ time = 0, target = 0 }, { time = 1, target = 12 }]
    "#;
    let (record, _, system) = run(text);
    let joint: &Joint = &system.joints()[0];
    for step in [100, 250, 500] {
        let angle = joint.coordinate(System::poses_of(joint, &record.states(step).unwrap()));
        let expected = 12.0 * 2e-3 * step as f64;
        let turns = (angle - expected) / std::f64::consts::TAU;
        assert!((turns - turns.round()).abs() < 1e-6, "step {step}: {angle} for {expected}");
    }
    let spin = system.states()[0].angular;
    assert!(spin.distance(12.0 * DVec3::Z) < 1e-6, "{spin}");
}

/// A wrist that makes two and a half turns about a tilted axis, evenly, and moves along it as a
/// screw.
#[test]
fn a_turn_may_be_more_than_a_whole_one() {
    let text = r#"
        time_step = 5e-3
        duration = 1.0
        [[bodies]]
        name = "wrist"
        shape = { sphere = { radius = 0.02 } }
        kinematic = true
        rotation = [0, 0, 0.6, 0.8]
        [[scripts]]
        body = "wrist"
        interpolation = "linear"
        keyframes = [{ time = 0 }, { time = 1, translation = [0.03, 0, 0.04], turn = [9.42477796076938, 0, 12.566370614359172] }]
    "#;
    let (record, _, system) = run(text);
    let (axis, angle) = (DVec3::new(0.6, 0.0, 0.8), 5.0 * std::f64::consts::PI);
    let start = tesdf::glam::DQuat::from_xyzw(0.0, 0.0, 0.6, 0.8);
    for step in [1, 30, 77, 200] {
        let pose = record.states(step).unwrap()[0].pose;
        let share = step as f64 / 200.0;
        let expected = tesdf::glam::DQuat::from_axis_angle(axis, share * angle) * start;
        assert!(
            pose.rotation.dot(expected).abs() > 1.0 - 1e-12,
            "step {step}: {pose:?}, expected {expected}"
        );
        assert!(pose.translation.distance(0.05 * share * axis) < 1e-12, "step {step}: {pose:?}");
    }
    assert!(system.states()[0].angular.distance(angle * axis) < 1e-9, "{:?}", system.states()[0]);
    let cases = [
        ("turn = [9.42", "rotation = [0, 0, 0, 1], turn = [9.42", "it has a rotation and a turn; keep one"),
        ("turn = [9.42477796076938,", "turn = [inf,", "expected finite numbers, rad"),
    ];
    crate::support::refused(text, Path::new("scene.toml"), &cases);
}

/// A force that is ramped up and cut off.
#[test]
fn a_wrench_script_accelerates_a_free_body() {
    let text = r#"
        time_step = 1e-3
        duration = 1.0
        gravity = [0, 0, 0]
        [[bodies]]
        name = "puck"
        shape = { sphere = { radius = 0.02 } }
        mass = 2
        [[scripts]]
        body = "puck"
        interpolation = "step"
        keyframes = [{ time = 0, force = [3, 0, 0] }, { time = 0.5, force = [0, 0, 0], torque = [0, 0, 1e-4] }]
    "#;
    let (_, summary, system) = run(text);
    assert!((system.states()[0].linear.x - 0.75).abs() < 1e-9, "{:?}", system.states()[0]);
    assert!((summary.momentum[0] - 1.5).abs() < 1e-9 && summary.angular_momentum[2] > 4.9e-5, "{summary:?}");
}

#[test]
fn what_does_not_fit_is_refused_with_its_place() {
    let cases = [
        ("parent = \"wrist\"", "parent = \"arm\"", "left: there is no body arm; the bodies are floor, wrist"),
        ("duration = 1.2", "duration = 1.2\ngravity = [0, 0, nan]", "expected finite numbers, in m/s²"),
        (
            "kind = \"slider\"",
            "kind = \"slider\"\ncoordinate = inf",
            "left: coordinate inf; expected a travel",
        ),
        (
            "kind = \"slider\"",
            "kind = \"ball\"\ncoordinate = 0.1",
            "left: only hinges and sliders have a coordinate; take it out",
        ),
        ("axis = [1, 0, 0]", "axis = [0, 0, 0]", "left: axis [0.0, 0.0, 0.0]; expected a direction"),
        ("kinematic = true", "kinematic = true\nmass = 1", "it is kinematic, so it needs no mass"),
        ("kinematic = true", "kinematic = true\nfixed = true", "it is fixed and kinematic; keep one"),
        ("friction = 0.6", "friction = -1", "friction is -1; expected a finite number, 0 or greater"),
        ("name = \"right\"\nkind", "name = \"left\"\nkind", "left: the name is used twice"),
        (
            "limits = [-0.02, 0.03]",
            "limits = [0.03, -0.02]",
            "limits 0.03 to -0.02; expected two finite numbers",
        ),
        ("body = \"wrist\"", "body = \"floor\"", "script 3 (floor): the body is fixed"),
        ("body = \"wrist\"", "body = \"hand\"", "script 3 (hand): there is no body hand"),
        (
            "body = \"wrist\"",
            "joint = \"left\"",
            "script 3 (left): the keyframe at 0.8 s has translation; expected target",
        ),
        ("{ time = 0.8,", "{ time = 0.2,", "its keyframes are at [0.3, 0.2] s; expected finite times"),
        (
            "keyframes = [{ time = 0, target = 0.05 }]",
            "keyframes = []",
            "script 1 (left): it has no keyframes",
        ),
        ("motor = { drive = { velocity = 0 }, limit = 20 }", "", "the joint has no motor; give it one"),
        (
            "body = \"wrist\"\nkeyframes = [{ time = 0.3 }, { time = 0.8, translation = [0, 0, 0.18] }]",
            "keyframes = [{ time = 0.3 }]",
            "script 3: expected either body or joint",
        ),
        ("target = 0.05", "target = nan", "script 1 (left): the keyframe at 0 s has target NaN"),
        ("translation = [0, 0, 0.18]", "turn = [0, inf, 0]", "expected finite numbers, rad"),
        (
            "body = \"wrist\"\nkeyframes = [{ time = 0.3 }, { time = 0.8, translation = [0, 0, 0.18] }]",
            "body = \"brick\"\nkeyframes = [{ time = 0.3, force = [0, 0, nan] }]",
            "script 3 (brick): the keyframe at 0.3 s has force [0, 0, NaN]; expected finite numbers, N",
        ),
    ];
    crate::support::refused(GRIPPER, Path::new("scene.toml"), &cases);
}
