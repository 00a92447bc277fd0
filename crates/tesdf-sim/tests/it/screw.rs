//! A frictionless nut turns down its bolt. Without contacts it does not, and the criterion fails.

use std::ops::ControlFlow;
use std::sync::OnceLock;

use tesdf_sim::criterion::{ScrewCriterion, ScrewReport};
use tesdf_sim::scene_file::{DetectorMode, LoadedScene};
use tesdf_sim::{Moment, StepReport, Summary, System, simulate};

/// The bolt-nut scene of the repository, with the coarse bolt and a shorter duration.
fn scene() -> (LoadedScene, System) {
    static SCENE: OnceLock<(LoadedScene, System)> = OnceLock::new();
    SCENE
        .get_or_init(|| {
            crate::support::scene("bolt-nut", |loaded| {
                let bolt = loaded.scene.bodies[0].get_mut();
                bolt.mesh = Some("../data/procedural/iso_m16_bolt_6k.obj".into());
                loaded.scene.duration = 0.06;
                // An ideal screw makes 0.0083 turns in 60 ms.
                loaded.scene.criterion.edit(|c: &mut ScrewCriterion| c.min_turns = 0.003).unwrap();
                loaded.scene.criterion.edit(|c: &mut ScrewCriterion| c.min_acceleration = 0.0).unwrap();
            })
        })
        .clone()
}

fn run(change: impl FnOnce(&mut LoadedScene)) -> Summary {
    let (mut loaded, system) = scene();
    change(&mut loaded);
    crate::support::run(&loaded, system).1
}

#[test]
fn the_nut_turns_down_the_bolt() {
    for (time_step, redetections) in [(1e-3, 0), (3e-3, 1), (5e-3, 2)] {
        let summary = run(|loaded| {
            loaded.scene.detector.choose(DetectorMode::Node);
            loaded.scene.time_step = time_step;
            loaded.scene.solver.redetections = redetections;
        });
        assert_eq!((summary.passed, summary.unconverged_steps), (Some(true), 0), "{summary:?}");
        // This is a fifth of the clearance of 50 µm.
        assert!(summary.deepest_penetration < 1e-5, "{summary:?}");
        assert!(summary.mean_contacts > 100.0, "{summary:?}");
    }
}

/// Threads do not pay for fast pairs.
#[test]
fn the_nut_is_not_followed() {
    let (mut loaded, system) = scene();
    loaded.scene.duration = 2.0 * loaded.scene.time_step;
    let mut engine = loaded.newton(system).unwrap();
    let see = |moment: &Moment<'_>| {
        let StepReport { parts, followed, .. } = moment.report;
        assert_eq!((parts, followed), (1, 0));
        ControlFlow::Continue(())
    };
    simulate(&loaded.scene, &mut engine, see).unwrap();
}

#[test]
fn without_contacts_the_criterion_fails() {
    let summary = run(|loaded| loaded.scene.detector.choose(DetectorMode::Off));
    assert_eq!(summary.passed, Some(false));
    let screw = summary.report::<ScrewReport>().unwrap();
    assert!(screw.turns.abs() < 1e-9 && screw.travel > 0.01, "{screw:?}");
    assert!(screw.failures.iter().any(|f| f.contains("turns; expected at least")), "{screw:?}");
    assert!(screw.failures.iter().any(|f| f.contains("differ by")), "{screw:?}");
}
