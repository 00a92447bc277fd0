//! Bodies that begin deep in each other come apart, also those that are past each other's middle.

use tesdf::glam::{DQuat, DVec3};
use tesdf_sim::criterion::{SeparationCriterion, SeparationReport};
use tesdf_sim::scene_file::{DetectorMode, LoadedScene};
use tesdf_sim::{Mass, RunRecord, Summary, System};

/// The pile of the repository with its first `shafts` shafts.
fn pile(shafts: usize) -> LoadedScene {
    let mut loaded = LoadedScene::read(crate::support::path_of("pile-of-shafts")).unwrap();
    loaded.scene.bodies.truncate(1 + shafts);
    loaded
}

/// The scene with two shafts that cross at a right angle, `offset` metres apart and, where it is 0,
/// exactly in each other's middle.
fn crossing(offset: f64) -> LoadedScene {
    let mut loaded = pile(2);
    let half = std::f64::consts::FRAC_1_SQRT_2;
    let places = [([0.0, 0.0, -0.045], [0.0, 0.0, 0.0, 1.0]), ([offset, 0.045, 0.0], [half, 0.0, 0.0, half])];
    for (body, (translation, rotation)) in loaded.scene.bodies[1..].iter_mut().zip(places) {
        let body = body.as_mut();
        (body.translation, body.rotation) = (translation, rotation);
    }
    loaded.scene.criterion.edit(|c: &mut SeparationCriterion| c.limits = vec![[0.06, 1e-5]]).unwrap();
    loaded
}

fn run(loaded: &LoadedScene) -> Summary {
    crate::support::run(loaded, loaded.system().unwrap()).1
}

#[test]
#[ignore = "a whole scene: .ci/release"]
fn shafts_that_cross_come_apart() {
    for mode in [DetectorMode::Exact, DetectorMode::Face, DetectorMode::Node] {
        for offset in [0.0, 1e-6, 3e-3, 1.2e-2] {
            let mut loaded = crossing(offset);
            loaded.scene.detector.choose(mode);
            let found = run(&loaded).report::<SeparationReport>().unwrap().clone();
            assert!(found.penetration[0] > 5e-3, "{offset}: {found:?}");
            assert_eq!(found.failures, [""; 0], "{mode:?}, {offset}: {found:?}");
        }
    }
}

#[test]
fn a_small_pile_comes_apart_the_same_on_any_number_of_threads() {
    let loaded = pile(24);
    let on = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| run(&loaded)).report::<SeparationReport>().unwrap().clone()
    };
    let one = on(1);
    assert_eq!(one.failures, [""; 0], "{one:?}");
    assert!(one.penetration[0] > 4e-3, "{one:?}");
    assert_eq!(one, on(2));
}

#[test]
fn without_contacts_the_criterion_fails() {
    let mut loaded = crossing(0.0);
    loaded.scene.detector.choose(DetectorMode::Off);
    let summary = run(&loaded);
    assert_eq!(summary.passed, Some(false));
    let failures = summary.report::<SeparationReport>().unwrap().failures.clone();
    assert_eq!(failures.len(), 1, "{failures:?}");
    assert!(failures[0].starts_with("penetration: ") && failures[0].ends_with("from 0.06 s on"));
}

#[test]
fn a_kick_is_named() {
    let mut loaded = crossing(0.0);
    loaded.scene.bodies[1].as_mut().velocity = [1.0, 0.0, 0.0];
    let failures = run(&loaded).report::<SeparationReport>().unwrap().clone().failures;
    assert!(failures.iter().any(|failure| failure.starts_with("kick: ")), "{failures:?}");
}

#[test]
fn limits_that_say_nothing_are_refused() {
    let message = |limits: Vec<[f64; 2]>| {
        let mut loaded = crossing(0.0);
        loaded.scene.criterion.edit(|c: &mut SeparationCriterion| c.limits = limits).unwrap();
        loaded.system().unwrap_err().to_string()
    };
    assert!(message(Vec::new()).contains("limits is empty"));
    let found = message(vec![[0.1, 1e-5], [0.1, 0.0]]);
    assert!(found.contains("entry 2 is [0.1, 0]") && found.contains("criterion.separation"), "{found}");
}

/// Two shafts side by side close over the floor, and two crosswise on them, which overlap them by up
/// to 2.5 mm.
fn small_pile() -> LoadedScene {
    let mut loaded = pile(4);
    loaded.scene.duration = 0.075;
    loaded.scene.bodies[0].as_mut().translation = [0.0; 3];
    // The centre of each, the direction of its axis, and a tilt, rad.
    let places = [
        ([-0.022, 0.0, 0.0165], DVec3::Y, 0.02),
        ([0.022, 0.003, 0.0165], DVec3::Y, -0.03),
        ([0.0, -0.021, 0.0405], DVec3::X, 0.015),
        ([0.004, 0.021, 0.0415], DVec3::X, -0.01),
    ];
    for (body, (center, axis, tilt)) in loaded.scene.bodies[1..].iter_mut().zip(places) {
        let body = body.as_mut();
        let rotation = DQuat::from_axis_angle(DVec3::new(0.6, 0.0, 0.8), tilt)
            * DQuat::from_rotation_arc(DVec3::Z, axis);
        body.rotation = rotation.normalize().to_array();
        // The origin of a shaft is at one of its ends.
        body.translation = (DVec3::from_array(center) - rotation * DVec3::new(0.0, 0.0, 0.045)).to_array();
    }
    loaded
}

/// The greatest kinetic energy that the bodies got from elsewhere than gravity, and the greatest
/// that they had, J. The work of gravity is that along their velocities: a push-out lifts bodies
/// without one, and is no source.
fn gain(record: &RunRecord, system: &mut System) -> [f64; 2] {
    let gravity = system.gravity;
    let mut momentum = |step: usize| {
        system.set_states(record.states(step).unwrap()).unwrap();
        let of_body = system.bodies().iter().zip(system.states()).map(|(body, state)| match body.mass {
            Mass::Free(mass) => mass.mass * state.linear,
            Mass::Fixed | Mass::Kinematic => DVec3::ZERO,
        });
        (system.kinetic_energy(), of_body.sum::<DVec3>())
    };
    let (mut before, mut unexplained, mut least) = (momentum(0), 0.0f64, 0.0f64);
    let (mut gain, mut most) = (0.0f64, 0.0f64);
    for step in 1..record.times().len() {
        let now = momentum(step);
        let h = record.times()[step] - record.times()[step - 1];
        unexplained += now.0 - before.0 - 0.5 * h * gravity.dot(before.1 + now.1);
        least = least.min(unexplained);
        (gain, most) = (gain.max(unexplained - least), most.max(now.0));
        before = now;
    }
    [gain, most]
}

#[test]
fn a_small_pile_has_no_energy_but_that_of_gravity() {
    for mode in [DetectorMode::Exact, DetectorMode::Node, DetectorMode::Face] {
        let mut loaded = small_pile();
        loaded.scene.detector.choose(mode);
        let (record, summary) = crate::support::run(&loaded, loaded.system().unwrap());
        let found = summary.report::<SeparationReport>().unwrap();
        let [gain, most] = gain(&record, &mut loaded.system().unwrap());
        assert!(found.penetration[0] > 2e-3 && most > 0.01, "{mode:?}: {most} J, {found:?}");
        // Springs of contacts give back up to 0.3 % of the energy. With a push of deep bodies that
        // gives them a velocity, 77 to 91 % of the energy is from it.
        assert!(gain <= 0.01 * most, "{mode:?}: {gain} of {most} J are not of gravity");
        let kicks = found.failures.iter().filter(|failure| failure.starts_with("kick: "));
        assert_eq!(kicks.count(), 0, "{mode:?}: {found:?}");
    }
}
