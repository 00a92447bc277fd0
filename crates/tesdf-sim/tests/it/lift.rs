//! A gripper lifts a peg by friction and holds it. Without contacts or friction the peg stays below,
//! and the criterion fails.

use std::sync::OnceLock;

use tesdf::collide::Pose;
use tesdf::glam::{DQuat, DVec3};
use tesdf_sim::criterion::{LiftCriterion, LiftReport, LiftTracker, Tracker};
use tesdf_sim::scene_file::{DetectorMode, LoadedScene};
use tesdf_sim::{RunRecord, State, Summary, System};

const LEFT: usize = 2;
const PEG: usize = 4;

/// The gripper scene of the repository.
fn scene() -> (LoadedScene, System) {
    static SCENE: OnceLock<(LoadedScene, System)> = OnceLock::new();
    SCENE.get_or_init(|| crate::support::scene("gripper-lift", |_| ())).clone()
}

fn run(change: impl FnOnce(&mut LoadedScene, &mut System)) -> (RunRecord, Summary) {
    let (mut loaded, mut system) = scene();
    change(&mut loaded, &mut system);
    crate::support::run(&loaded, system)
}

/// The names of the failures.
fn names(report: &LiftReport) -> Vec<&str> {
    report.failures.iter().filter_map(|f| f.split(':').next()).collect()
}

#[test]
fn the_gripper_lifts_the_peg_and_holds_it() {
    for (mode, duration) in [(DetectorMode::Node, 2.0), (DetectorMode::Exact, 1.2)] {
        let (_, summary) = run(|loaded, _| {
            loaded.scene.detector.choose(mode);
            loaded.scene.duration = duration;
        });
        assert_eq!((summary.passed, summary.unconverged_steps), (Some(true), 0), "{summary:?}");
        let lift = summary.report::<LiftReport>().unwrap();
        // The criterion asks for 0.01 mm/s.
        assert!(lift.creep < 1e-8 && lift.penetration < 1e-7 && lift.measurements >= 11, "{lift:?}");
        // The work of the lift: 2 × 27 g of fingers and 63 g of peg. Nothing moves at the end.
        assert!((summary.released_energy + 0.0577).abs() < 1e-4, "{summary:?}");
        assert!(summary.kinetic_energy < 1e-15, "{summary:?}");
        assert!(summary.joint_drift.unwrap().distance < 1e-9, "{summary:?}");
    }
}

#[test]
fn without_contacts_or_friction_the_criterion_fails() {
    let (_, off) = run(|loaded, _| loaded.scene.detector.choose(DetectorMode::Off));
    assert_eq!(off.passed, Some(false));
    let lift = off.report::<LiftReport>().unwrap();
    assert!(lift.rise < -1.0, "{lift:?}");
    assert_eq!(names(lift), ["lift", "creep", "jitter"]);

    let (_, slippery) = run(|_, system| system.set_friction(PEG, 0.0).unwrap());
    assert_eq!(slippery.passed, Some(false));
    let lift = slippery.report::<LiftReport>().unwrap();
    assert!(lift.rise.abs() < 1e-5, "{lift:?}");
    // The peg glides away between the fingers and the floor, so it is also said to creep.
    assert_eq!(names(lift)[0], "lift");
}

/// Two pads that push by 20 N each hold up to 2 μ 20 N = 12 N. On its way the peg accelerates by up
/// to 0.83 m/s².
#[test]
fn the_fingers_hold_what_friction_allows() {
    for (mass, holds) in [(1.12, true), (1.14, false)] {
        let (record, summary) = run(|loaded, system| {
            let peg = loaded.scene.bodies[PEG].get_mut();
            (peg.density, peg.mass) = (None, Some(mass));
            // Upright between lobe and valley, so that the two pushes are on one line.
            (peg.translation, peg.rotation) = ([0.0; 3], [0.0, 0.0, 0.0, 1.0]);
            *system = loaded.system().unwrap();
        });
        let states = [60, 180].map(|step| record.states(step).unwrap());
        let [before, after] = states.map(|s| s[PEG].pose.translation.z - s[LEFT].pose.translation.z);
        assert_eq!((before - after) < 1e-7, holds, "{mass} kg: {before} m, then {after} m: {summary:?}");
        assert_eq!(summary.passed, Some(holds), "{mass} kg: {summary:?}");
    }
}

#[test]
fn any_number_of_threads_gives_the_same_bytes() {
    let bytes = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| run(|loaded, _| loaded.scene.duration = 0.4)).0.to_bytes().unwrap()
    };
    let one = bytes(1);
    assert!(one == bytes(2) && one == bytes(8));
}

/// The report of a run whose bodies have these states after each step of 0.1 s.
fn report(state: impl Fn(&mut Vec<State>, f64)) -> LiftReport {
    let (loaded, mut system) = scene();
    let criterion = loaded.scene.criterion.get::<LiftCriterion>().unwrap();
    system.set_state(PEG, State::at_rest(Pose::IDENTITY)).unwrap();
    let mut tracker = LiftTracker::new(criterion, &system).unwrap();
    let start = system.states().to_vec();
    for step in 1..=20 {
        let time = 0.1 * f64::from(step);
        let (mut states, rise) = (start.clone(), 0.05 * time.min(1.0));
        states[1..].iter_mut().for_each(|s| s.pose.translation.z += rise);
        state(&mut states, time);
        system.set_states(states).unwrap();
        tracker.observe(&system, 0.1);
    }
    tracker.report(&system)
}

#[test]
fn each_failure_has_its_name() {
    let held = report(|_, _| {});
    assert!(held.failures.is_empty() && held.measurements == 20, "{held:?}");
    assert!((held.rise - 0.05).abs() < 1e-12 && held.creep < 1e-12, "{held:?}");
    let low = report(|states, _| states[PEG].pose.translation.z -= 6e-5);
    assert_eq!(names(&low), ["lift"]);
    // 11 µm in the second in which it is held.
    let slow = report(|states, time| states[PEG].pose.translation.z -= 1.1e-5 * (time - 1.0).max(0.0));
    assert_eq!(names(&slow), ["creep"]);
    assert!((slow.creep - 1.1e-5).abs() < 1e-10, "{slow:?}");
    let turning = report(|states, time| states[PEG].pose.rotation = DQuat::from_rotation_z(2e-3 * time));
    assert_eq!(names(&turning), ["creep"]);
    let in_finger = report(|states, _| states[LEFT].pose.translation.x += 4.1e-3);
    assert_eq!(names(&in_finger), ["penetration"]);
    assert!((in_finger.penetration - 1e-4).abs() < 1e-6, "{in_finger:?}");
    let shaking = report(|states, _| states[PEG].linear = DVec3::new(0.0, 0.0, 2e-4));
    assert_eq!(names(&shaking), ["jitter"]);
    let thrown = report(|states, time| {
        let speed = DVec3::new(0.0, 0.0, if time > 1.05 { 0.1 } else { 0.0 });
        (states[PEG].linear, states[LEFT].linear, states[LEFT + 1].linear) = (speed, speed, speed);
    });
    assert_eq!(names(&thrown), ["energy gain"]);

    let (loaded, system) = scene();
    let mut tracker =
        LiftTracker::new(loaded.scene.criterion.get::<LiftCriterion>().unwrap(), &system).unwrap();
    tracker.observe(&system, 0.05);
    let short = tracker.report(&system);
    assert_eq!(names(&short), ["penetration", "lift"]);
    assert!(short.failures[1].contains("the run ends before 1 s"), "{short:?}");
}

#[test]
fn what_does_not_fit_is_refused_with_its_place() {
    let path = crate::support::path_of("gripper-lift");
    // Cubes are encoded faster.
    let text = std::fs::read_to_string(&path)
        .unwrap()
        .replace("lobed_peg.obj", "cube.obj")
        .replace("gripper_finger.obj", "cube.obj");
    let script =
        "[[scripts]]\nbody = \"peg\"\nkeyframes = [{ time = 0, force = [0, 0, 1] }]\n\n[criterion.lift]";
    let joint = "[[joints]]\nname = \"hook\"\nkind = \"ball\"\nchild = \"peg\"\n\n[criterion.lift]";
    let cases = [
        ("body = \"peg\"", "body = \"pig\"", "there is no body pig; the bodies are floor, wrist, left"),
        ("body = \"peg\"", "body = \"wrist\"", "body wrist is kinematic; no contact can lift it"),
        (
            "body = \"peg\"\nfingers = [\"left\", ",
            "body = \"left\"\nfingers = [",
            "joint left holds body left; only the fingers may",
        ),
        ("fingers = [\"left\"", "fingers = [\"peg\"", "body peg cannot hold itself"),
        ("fingers = [\"left\", \"right\"]", "fingers = []", "fingers is empty; name the bodies"),
        ("axis = [0, 0, 1]", "axis = [0, 0, 2]", "axis has length 2; expected 1"),
        ("height = 0.05", "height = 0", "height is 0; expected a positive number"),
        ("[criterion.lift]", script, "a script drives body peg; only contacts may, so take it out"),
        ("[criterion.lift]", joint, "joint hook holds body peg; only the fingers may, so take it out"),
    ];
    for message in crate::support::refused(&text, &path, &cases) {
        assert!(message.contains("criterion.lift: "), "{message}");
    }
}
