//! A gear turns another one. Without contacts it does not, and the criterion fails.

use std::f64::consts::TAU;
use std::sync::OnceLock;

use tesdf::Length;
use tesdf::collide::{ClearanceOptions, clearance};
use tesdf::glam::{DQuat, DVec3};
use tesdf_sim::criterion::{GearRatioCriterion, GearRatioReport, GearRatioTracker, Tracker};
use tesdf_sim::scene_file::{DetectorMode, LoadedScene};
use tesdf_sim::{Drive, Mass, Motor, RunRecord, Summary, System};

const PITCH_RADIUS: f64 = 0.02;

/// The gear scene of the repository, for a little more than one turn.
fn scene() -> (LoadedScene, System) {
    static SCENE: OnceLock<(LoadedScene, System)> = OnceLock::new();
    SCENE
        .get_or_init(|| {
            crate::support::scene("gear-pair", |loaded| {
                loaded.scene.duration = 1.25;
                loaded.scene.criterion.edit(|c: &mut GearRatioCriterion| c.min_turns = 1.0).unwrap();
            })
        })
        .clone()
}

fn run(change: impl FnOnce(&mut LoadedScene, &mut System)) -> (RunRecord, Summary) {
    let (mut loaded, mut system) = scene();
    change(&mut loaded, &mut system);
    crate::support::run(&loaded, system)
}

/// The names of the failures.
fn names(report: &GearRatioReport) -> Vec<&str> {
    report.failures.iter().filter_map(|f| f.split(':').next()).collect()
}

/// The transmission error of the two meshes, peak to peak, m: what they do when the flanks just
/// touch, by the exact clearance.
fn error_of_the_meshes() -> f64 {
    let (_, mut system) = scene();
    let mut states = system.states().to_vec();
    let [driver, driven] = [0, 1].map(|k| system.bodies()[k].instance);
    let start = states[1].pose.rotation;
    let options = ClearanceOptions { tolerance: Length::Absolute(1e-8) };
    let mut distance = |angle: f64, more: f64| {
        states[0].pose.rotation = DQuat::from_rotation_z(angle);
        states[1].pose.rotation = DQuat::from_rotation_z(more - angle) * start;
        let scene = system.scene_at(&states).unwrap();
        clearance(scene, driver, driven, &options).unwrap().distance
    };
    // The load turns the driven gear counter-clockwise until the flanks touch.
    let mut touch = |angle: f64| {
        let [mut apart, mut inside] = [2e-3, 4e-3];
        assert!(distance(angle, apart) > 0.0 && distance(angle, inside) < 0.0, "{angle}");
        while inside - apart > 1e-5 {
            let middle = 0.5 * (apart + inside);
            *(if distance(angle, middle) > 0.0 { &mut apart } else { &mut inside }) = middle;
        }
        PITCH_RADIUS * apart
    };
    let errors: Vec<f64> = (0..40).map(|k| touch(TAU / 20.0 * f64::from(k) / 40.0)).collect();
    errors.iter().fold(f64::MIN, |a, b| a.max(*b)) - errors.iter().fold(f64::MAX, |a, b| a.min(*b))
}

#[test]
fn the_gears_turn_at_the_ratio_of_their_teeth() {
    for (mode, duration) in [(DetectorMode::Node, 1.25), (DetectorMode::Exact, 0.5)] {
        let (_, summary) = run(|loaded, _| {
            loaded.scene.detector.choose(mode);
            loaded.scene.duration = duration;
            loaded
                .scene
                .criterion
                .edit(|c: &mut GearRatioCriterion| c.min_turns = 0.9 * duration - 0.14)
                .unwrap();
        });
        assert_eq!((summary.passed, summary.unconverged_steps), (Some(true), 0), "{summary:?}");
        let gears = summary.report::<GearRatioReport>().unwrap();
        assert!(gears.penetration < 1e-6 && gears.measurements >= 2, "{gears:?}");
        assert!(summary.joint_drift.unwrap().distance < 1e-9, "{summary:?}");
        // Both gears turn at 6 rad/s, up to their transmission error.
        let inertia = |body: &tesdf_sim::Body| match body.mass {
            Mass::Free(mass) => mass.inertia.z_axis.z,
            Mass::Fixed | Mass::Kinematic => 0.0,
        };
        let expected: f64 = scene().1.bodies().iter().map(|body| 0.5 * inertia(body) * 36.0).sum();
        assert!((summary.kinetic_energy / expected - 1.0).abs() < 0.05, "{expected} J: {summary:?}");
    }
}

/// What the run adds to the transmission error of the meshes.
#[test]
fn the_transmission_error_is_that_of_the_meshes() {
    let expected = error_of_the_meshes();
    assert!((1.4e-5..1.7e-5).contains(&expected), "{expected}");
    let (_, summary) = run(|loaded, _| {
        (loaded.scene.time_step, loaded.scene.duration) = (1e-3, 0.4);
        loaded.scene.criterion.edit(|c: &mut GearRatioCriterion| c.min_turns = 0.2).unwrap();
    });
    let gears = summary.report::<GearRatioReport>().unwrap();
    assert_eq!(summary.passed, Some(true), "{summary:?}");
    assert!((gears.transmission_error - expected).abs() < 1e-6, "{expected}: {gears:?}");
}

#[test]
fn without_contacts_or_with_a_load_that_drives_the_criterion_fails() {
    let (_, off) = run(|loaded, _| loaded.scene.detector.choose(DetectorMode::Off));
    assert_eq!(off.passed, Some(false));
    let gears = off.report::<GearRatioReport>().unwrap();
    assert!(gears.driven_turns > 1000.0, "{gears:?}");
    assert_eq!(names(gears), ["penetration", "turns", "ratio", "transmission error", "speed", "load"]);

    let helping = Motor { drive: Drive::Force(-0.5), limit: 0.5 };
    let (_, helped) = run(|_, system| system.set_motor(1, Some(helping)).unwrap());
    assert_eq!(helped.passed, Some(false));
    assert_eq!(names(helped.report::<GearRatioReport>().unwrap()), ["load"]);
}

#[test]
fn any_number_of_threads_gives_the_same_bytes() {
    let bytes = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| run(|loaded, _| loaded.scene.duration = 0.3)).0.to_bytes().unwrap()
    };
    let one = bytes(1);
    assert!(one == bytes(2) && one == bytes(8));
}

/// The report of gears with these angles and speeds after each step of 10 ms.
fn report(angle: impl Fn(f64) -> [f64; 2], speed: [f64; 2]) -> GearRatioReport {
    let (loaded, mut system) = scene();
    let criterion = loaded.scene.criterion.get::<GearRatioCriterion>().unwrap();
    let mut tracker = GearRatioTracker::new(criterion, &system).unwrap();
    let start = system.states().to_vec();
    for step in 1..=125 {
        let angles = angle(0.01 * f64::from(step));
        let mut states = start.clone();
        for (k, state) in states.iter_mut().enumerate() {
            state.pose.rotation = DQuat::from_rotation_z(angles[k]) * start[k].pose.rotation;
            state.angular = speed[k] * DVec3::Z;
        }
        system.set_states(states).unwrap();
        tracker.observe(&system, 0.01);
    }
    tracker.report(&system)
}

#[test]
fn each_failure_has_its_name() {
    let turning = [6.0, -6.0];
    let good = report(|time| [6.0 * time, -6.0 * time], turning);
    assert!(good.failures.is_empty() && good.measurements == 5, "{good:?}");
    assert!(
        (good.driver_turns - 1.1 * 6.0 / TAU).abs() < 1e-9 && good.transmission_error < 1e-12,
        "{good:?}"
    );
    let slow = report(|time| [5.0 * time, -5.0 * time], [5.0, -5.0]);
    assert_eq!(names(&slow), ["turns"]);
    let still = report(|_| [0.0; 2], [0.0; 2]);
    assert_eq!(names(&still), ["turns", "ratio"]);
    // 0.2 % of 6.6 rad on a radius of 20 mm are 0.26 mm.
    let slipping = report(|time| [6.0 * time, -6.012 * time], turning);
    assert_eq!(names(&slipping)[1..], ["ratio", "transmission error"]);
    let wobble = |time: f64| 6e-4 * (40.0 * time).sin();
    let wobbling = report(|time| [6.0 * time, wobble(time) - 6.0 * time], turning);
    assert_eq!(names(&wobbling), ["transmission error"]);
    assert!((wobbling.transmission_error - 2.4e-5).abs() < 1e-6, "{wobbling:?}");
    let bouncing = report(|time| [6.0 * time, -6.0 * time], [6.0, -6.7]);
    assert_eq!(names(&bouncing), ["speed"]);
    let deep = report(|time| [6.0 * time, 6e-3 - 6.0 * time], turning);
    assert_eq!(names(&deep), ["penetration"]);
}

#[test]
fn what_does_not_fit_is_refused_with_its_place() {
    let path = crate::support::path_of("gear-pair");
    // Cubes are encoded faster.
    let text = std::fs::read_to_string(&path).unwrap().replace("spur_gear_m2_z20.obj", "cube.obj");
    let script = "[[scripts]]\nbody = \"driven\"\nkeyframes = [{ time = 0, torque = [0, 0, 1] }]\n\n[criterion.gear_ratio]";
    let weld = "[[joints]]\nname = \"bond\"\nkind = \"weld\"\nparent = \"driver\"\nchild = \"driven\"\n\n\
        [criterion.gear_ratio]";
    let cases = [
        (
            "driven = \"output\"",
            "driven = \"shaft\"",
            "there is no joint shaft; the joints are input, output",
        ),
        ("driven = \"output\"", "driven = \"input\"", "both hinges turn body driver; expected two gears"),
        ("kind = \"hinge\"", "kind = \"slider\"", "joint input is a slider; expected a hinge"),
        ("{ force = 0.5 }", "{ velocity = -6 }", "the motor of joint output has the drive Velocity(-6.0)"),
        ("ratio = -1", "ratio = 0", "ratio is 0; expected a finite number other than 0"),
        ("pitch_radius = 0.02", "pitch_radius = -1", "pitch_radius is -1; expected a positive number"),
        ("[criterion.gear_ratio]", script, "a script drives body driven; only contacts may, so take it out"),
        ("[criterion.gear_ratio]", weld, "joint bond holds body driven too; expected the hinge output alone"),
    ];
    for message in crate::support::refused(&text, &path, &cases) {
        assert!(message.contains("criterion.gear_ratio: "), "{message}");
    }
}
