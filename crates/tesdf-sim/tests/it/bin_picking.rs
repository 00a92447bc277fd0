//! A gripper of a URDF file picks one of 20 concave parts from a tray.
use tesdf_sim::Summary;
use tesdf_sim::criterion::{LiftReport, RestReport, SeparationReport};
use tesdf_sim::scene_file::LoadedScene;

use crate::support::path_of;

fn run(change: impl FnOnce(&mut LoadedScene)) -> (Summary, Vec<f64>) {
    let (loaded, system) = crate::support::scene("bin-picking", change);
    let (record, summary) = crate::support::run(&loaded, system);
    let last = record.states(record.steps() as usize).unwrap();
    (summary, last.iter().map(|state| state.pose.translation.z).collect())
}

#[test]
#[ignore = "a whole scene: .ci/release"]
fn a_part_of_a_bin_is_picked_and_nothing_passes_through_the_tray() {
    let (summary, heights) = run(|_| ());
    let failures = |found: &[String]| found.join("; ");
    assert_eq!(failures(&summary.report::<LiftReport>().unwrap().failures), "");
    assert_eq!(failures(&summary.report::<RestReport>().unwrap().failures), "");
    assert_eq!(failures(&summary.report::<SeparationReport>().unwrap().failures), "");
    assert_eq!(summary.passed, Some(true));
    // The tray is body 0, the wanted part body 1, and 19 others follow.
    assert!((heights[1] - 0.1325).abs() < 5e-5, "the part is at {} m", heights[1]);
    assert!(heights[2..21].iter().all(|z| (7e-3..0.06).contains(z)), "parts are at {heights:?} m");
}

#[test]
#[ignore = "a whole scene: .ci/release"]
fn without_friction_the_part_stays_in_the_bin() {
    let (summary, heights) = run(|loaded| {
        let bodies = loaded.scene.bodies.iter_mut().map(|body| body.as_mut());
        bodies.filter(|body| body.name.ends_with("_finger")).for_each(|finger| finger.friction = 0.0);
    });
    assert_eq!(summary.passed, Some(false));
    let failures = &summary.report::<LiftReport>().unwrap().failures;
    assert!(failures.iter().any(|text| text.starts_with("lift:")), "{failures:?}");
    assert!(heights[1] < 0.05, "the part is at {} m", heights[1]);
}

/// A part that tumbles over the floor of the tray, by 0.1 rad in the step, has one corner on it at
/// the beginning, and two predicted at the end. The contact of the second one is not that of the
/// first one.
#[test]
fn a_part_that_tumbles_over_two_corners_does_not_sink_into_the_floor() {
    let scene = r#"
        time_step = 5e-3
        duration = 5e-3
        [[bodies]]
        name = "tray"
        fixed = true
        friction = 0.4
        parts = [
            { shape = { box = { half_extents = [0.09, 0.07, 0.004] } }, translation = [0, 0, -0.004] },
            { shape = { box = { half_extents = [0.004, 0.07, 0.0225] } }, translation = [0.086, 0, 0.0175] },
        ]
        [[bodies]]
        name = "part"
        mesh = "channel.obj"
        density = 2700
        friction = 0.4
        translation = [0.020910819, -0.040590362, 0.011358376]
        rotation = [-0.038185452, 0.242764213, 0.957547178, -0.150701058]
        velocity = [0.096708864, -0.015052292, -0.294637131]
        angular_velocity = [4.97369283, 18.50398925, 1.225862603]
        [criterion.separation]
        limits = [[0, 2e-6]]
    "#;
    let loaded = LoadedScene::parse(scene.into(), path_of("scene")).unwrap();
    let (_, summary) = crate::support::run(&loaded, loaded.system().unwrap());
    let report = summary.report::<SeparationReport>().unwrap();
    assert!(report.penetration.len() == 2 && report.penetration[1] < 2e-6, "{report:?}");
}
