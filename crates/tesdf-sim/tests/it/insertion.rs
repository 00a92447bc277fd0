//! A frictionless peg slides into its hole and seats. Without contacts it falls through the floor,
//! and the criterion fails.

use std::sync::OnceLock;

use tesdf::glam::{DQuat, DVec3};
use tesdf_sim::criterion::{InsertionCriterion, InsertionReport, InsertionTracker, Tracker};
use tesdf_sim::scene_file::{DetectorMode, LoadedScene};
use tesdf_sim::{State, Summary, System};

/// The peg scene of the repository.
fn scene() -> (LoadedScene, System) {
    static SCENE: OnceLock<(LoadedScene, System)> = OnceLock::new();
    SCENE.get_or_init(|| crate::support::scene("peg-in-hole", |_| ())).clone()
}

fn run(change: impl FnOnce(&mut LoadedScene)) -> Summary {
    let (mut loaded, system) = scene();
    change(&mut loaded);
    crate::support::run(&loaded, system).1
}

#[test]
fn the_peg_slides_into_the_hole_and_seats() {
    for time_step in [3e-3, 5e-3] {
        let summary = run(|loaded| loaded.scene.time_step = time_step);
        assert_eq!((summary.passed, summary.unconverged_steps), (Some(true), 0), "{summary:?}");
        let found = summary.report::<InsertionReport>().unwrap();
        assert!(found.measurements >= 9, "{found:?}");
        // The peg leans on the wall: it moves across the axis by at least the clearance.
        assert!(found.offset > 0.9e-4, "{found:?}");
    }
}

#[test]
fn without_contacts_the_criterion_fails() {
    let summary = run(|loaded| loaded.scene.detector.choose(DetectorMode::Off));
    assert_eq!(summary.passed, Some(false));
    let found = summary.report::<InsertionReport>().unwrap();
    assert!(found.travel > 0.02 && found.penetration > 1e-3, "{found:?}");
    for name in ["tunnelling", "penetration", "jitter"] {
        assert!(found.failures.iter().any(|f| f.starts_with(&format!("{name}: "))), "{name}: {found:?}");
    }
}

/// The names of the failures of a peg with this state after each step of 25 ms.
fn names(state: impl Fn(State, f64) -> State) -> Vec<String> {
    let (loaded, mut system) = scene();
    let criterion = loaded.scene.criterion.get::<InsertionCriterion>().unwrap();
    let mut tracker = InsertionTracker::new(criterion, &system).unwrap();
    let start = system.states()[1];
    for step in 1..=10 {
        system.set_state(1, state(start, 0.025 * f64::from(step))).unwrap();
        tracker.observe(&system, 0.025);
    }
    let InsertionReport { failures, .. } = tracker.report(&system);
    failures.iter().map(|f| f.split(':').next().unwrap_or_default().to_string()).collect()
}

/// A state after `travel` along the axis.
fn down(mut state: State, travel: f64) -> State {
    state.pose.translation.z -= travel;
    state
}

#[test]
fn each_failure_has_its_name() {
    let seated = |state: State, time: f64| down(state, 0.2 * time.min(0.05));
    assert_eq!(names(seated), [""; 0]);
    assert_eq!(names(|state, _| down(state, 0.004)), ["sticking"]);
    assert_eq!(names(|state, time| seated(state, 0.25 * time)), ["sticking"]);
    // 25 µm into the floor.
    assert_eq!(names(|state, time| down(seated(state, time), 2.5e-5)), ["tunnelling", "penetration"]);
    let aside = |mut state: State| {
        state.pose.translation.x += 4e-4;
        state
    };
    assert_eq!(names(|state, time| aside(seated(state, time))), ["tunnelling", "penetration"]);
    let tilted = |mut state: State| {
        state.pose.rotation = DQuat::from_rotation_y(0.05);
        state
    };
    assert!(names(|state, time| tilted(seated(state, time))).contains(&"penetration".into()));
    let shaking = |mut state: State| {
        state.linear = DVec3::new(0.03, 0.0, 0.0);
        state
    };
    assert_eq!(names(|state, time| shaking(seated(state, time))), ["jitter"]);
    let thrown = |mut state: State, time: f64| {
        state.linear = DVec3::new(0.0, 0.0, if time < 0.03 { 1.0 } else { 0.0 });
        state
    };
    assert_eq!(names(|state, time| thrown(seated(state, time), time)), ["energy gain"]);
}

#[test]
fn values_out_of_range_are_refused() {
    let (loaded, system) = scene();
    let mut criterion = loaded.scene.criterion.get::<InsertionCriterion>().unwrap().clone();
    criterion.check_every = 0.0;
    let error = InsertionTracker::new(&criterion, &system).unwrap_err();
    assert!(error.contains("check_every is 0; expected a positive number"), "{error}");
    criterion.check_every = 0.1;
    criterion.into = "peg".into();
    assert!(InsertionTracker::new(&criterion, &system).unwrap_err().contains("into itself"));
    criterion.into = "table".into();
    assert!(InsertionTracker::new(&criterion, &system).unwrap_err().contains("the bodies are hole, peg"));
    criterion.into = "peg".into();
    criterion.body = "hole".into();
    assert!(InsertionTracker::new(&criterion, &system).unwrap_err().contains("is fixed"));
}
