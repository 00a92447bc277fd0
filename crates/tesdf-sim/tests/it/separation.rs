//! Bodies that begin deep in each other come apart, also those that are past each other's middle.

use tesdf_sim::Summary;
use tesdf_sim::scene_file::{DetectorMode, LoadedScene};

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
    loaded.scene.criterion.separation.as_mut().unwrap().limits = vec![[0.06, 1e-5]];
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
            loaded.scene.detector.mode = mode;
            let found = run(&loaded).separation.unwrap();
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
        pool.install(|| run(&loaded)).separation.unwrap()
    };
    let one = on(1);
    assert_eq!(one.failures, [""; 0], "{one:?}");
    assert!(one.penetration[0] > 4e-3, "{one:?}");
    assert_eq!(one, on(2));
}

#[test]
fn without_contacts_the_criterion_fails() {
    let mut loaded = crossing(0.0);
    loaded.scene.detector.mode = DetectorMode::Off;
    let summary = run(&loaded);
    assert_eq!(summary.passed, Some(false));
    let failures = summary.separation.unwrap().failures;
    assert_eq!(failures.len(), 1, "{failures:?}");
    assert!(failures[0].starts_with("penetration: ") && failures[0].ends_with("from 0.06 s on"));
}

#[test]
fn a_kick_is_named() {
    let mut loaded = crossing(0.0);
    loaded.scene.bodies[1].as_mut().velocity = [1.0, 0.0, 0.0];
    let failures = run(&loaded).separation.unwrap().failures;
    assert!(failures.iter().any(|failure| failure.starts_with("kick: ")), "{failures:?}");
}

#[test]
fn limits_that_say_nothing_are_refused() {
    let message = |limits: Vec<[f64; 2]>| {
        let mut loaded = crossing(0.0);
        loaded.scene.criterion.separation.as_mut().unwrap().limits = limits;
        loaded.system().unwrap_err().to_string()
    };
    assert!(message(Vec::new()).contains("limits is empty"));
    let found = message(vec![[0.1, 1e-5], [0.1, 0.0]]);
    assert!(found.contains("entry 2 is [0.1, 0]") && found.contains("criterion.separation"), "{found}");
}
