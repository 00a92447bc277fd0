//! A chain of light links holds a heavy end.

use tesdf_sim::Summary;
use tesdf_sim::scene_file::{DetectorMode, LoadedScene};

/// The chain of the repository for some tenths of a second, under a gravity that is turned by 17°.
fn chain(change: impl FnOnce(&mut LoadedScene)) -> Summary {
    let (loaded, system) = crate::support::scene("chain", |loaded| {
        loaded.scene.duration = 0.2;
        loaded.scene.gravity = [3.0, 0.0, -9.81];
        change(loaded);
    });
    crate::support::run(&loaded, system).1
}

#[test]
fn a_chain_holds_a_heavy_end_the_same_on_any_number_of_threads() {
    let on = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let mut summary = pool.install(|| chain(|_| {}));
        (summary.detection_ms, summary.solution_ms) = (0.0, 0.0);
        summary
    };
    let summary = on(1);
    assert_eq!(summary.passed, Some(true), "{summary:?}");
    assert_eq!(summary.unconverged_steps, 0);
    // Vertices are kept out up to the jerk with which the slack ends.
    assert!(summary.deepest_penetration < 1e-5, "{summary:?}");
    // The end swings, and energy is not gained.
    assert!(summary.kinetic_energy > 0.1 && summary.kinetic_energy < summary.released_energy, "{summary:?}");
    assert_eq!(summary, on(2));
}

/// The only minimum of the distance between two links is the bottom of a bend. Without the contacts of
/// the faces beside it the links slip out of each other.
#[test]
fn a_chain_of_faces_holds_a_heavy_end_that_swings() {
    let summary = chain(|loaded| loaded.scene.detector.choose(DetectorMode::Exact));
    assert_eq!(summary.passed, Some(true), "{summary:?}");
    assert!(summary.kinetic_energy > 0.1 && summary.kinetic_energy < summary.released_energy, "{summary:?}");
}

#[test]
fn without_contacts_the_chain_falls_apart() {
    let summary = chain(|loaded| loaded.scene.detector.choose(DetectorMode::Off));
    assert_eq!(summary.passed, Some(false), "{summary:?}");
}
