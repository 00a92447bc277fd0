//! Torsional friction: a contact resists spin about its normal by at most a length times its push.
use std::fs;
use std::ops::ControlFlow;
use std::path::Path;

use tesdf::glam::DVec3;
use tesdf::save::{Destination, SaveOptions};
use tesdf_sim::newton::Newton;
use tesdf_sim::record::{
    InterruptedRun, RUN_VERSION, RUN_VERSION_WITHOUT_TORQUES, RunJournal, RunOrigin, RunRecord,
};
use tesdf_sim::scene_file::LoadedScene;
use tesdf_sim::{ContactForce, Dynamics, PartialRun, SimulateError, State, Wrench, simulate_from};

use crate::support::{refused, run};

const G: f64 = 9.81;
const STEP: f64 = 5e-3;
/// kg
const MASS: f64 = 0.4;
/// The coefficients of floor and body, m, and their geometric mean.
const OF_BOTH: [f64; 2] = [0.04, 0.0025];
const COEFFICIENT: f64 = 0.01;

const BALL: &str = "shape = { sphere = { radius = 0.05 } }\ntranslation = [0, 0, 0.05]";
const BOX: &str = "shape = { box = { half_extents = [0.06, 0.04, 0.02] } }\ntranslation = [0, 0, 0.02]";

/// Moment of inertia about the vertical, kg m².
fn inertia(geometry: &str) -> f64 {
    match geometry {
        BALL => 0.4 * MASS * 0.05 * 0.05,
        _ => MASS / 3.0 * (0.06 * 0.06 + 0.04 * 0.04),
    }
}

/// A body that spins on a floor, with these coefficients of torsional friction, and other keys.
fn text(geometry: &str, spin: f64, [floor, body]: [f64; 2], friction: f64, keys: &str) -> String {
    format!(
        "time_step = {STEP}\nduration = 0.5\n{keys}\n\
         [[bodies]]\nname = \"floor\"\nshape = \"plane\"\nfixed = true\nfriction = {friction}\n\
         friction_torsional = {floor}\n\
         [[bodies]]\nname = \"body\"\n{geometry}\nmass = {MASS}\nfriction = {friction}\n\
         friction_torsional = {body}\nangular_velocity = [0, 0, {spin}]\n"
    )
}

fn scene(geometry: &str, spin: f64, of_both: [f64; 2], friction: f64, keys: &str) -> LoadedScene {
    parse(text(geometry, spin, of_both, friction, keys))
}

fn parse(text: String) -> LoadedScene {
    LoadedScene::parse(text, "scene.toml").unwrap()
}

fn engine(loaded: &LoadedScene) -> Newton {
    loaded.newton(loaded.system().unwrap()).unwrap()
}

fn spin(engine: &Newton) -> f64 {
    engine.system().states()[1].angular.z
}

/// The moments of all contacts about the vertical on the body.
fn torque(engine: &Newton) -> f64 {
    let of = |c: &ContactForce| {
        if c.bodies[0] == 1 { c.torque * c.normal.z } else { -c.torque * c.normal.z }
    };
    engine.forces().unwrap().contacts.iter().map(of).sum()
}

/// dω/dt = −c N / I, then it stands, and forces tell the moment. A ball stands on a point: sliding
/// friction changes nothing.
#[test]
fn a_spin_slows_at_its_rate_and_stops() {
    for (geometry, friction) in [(BALL, 0.0), (BALL, 0.5), (BOX, 0.0)] {
        for begin in [8.0, -8.0] {
            let mut engine = engine(&scene(geometry, begin, OF_BOTH, friction, ""));
            let rate = COEFFICIENT * MASS * G / inertia(geometry);
            let name = format!("{geometry}, {friction}, {begin}");
            let mut time = 0.0;
            let mut before = begin.abs();
            while time < 2.0 * begin.abs() / rate {
                assert!(engine.step(STEP).unwrap().converged, "{name}");
                time += STEP;
                let expected = (begin.abs() - rate * time).max(0.0);
                let found = spin(&engine) * begin.signum();
                assert!(
                    (found - expected).abs() < 1e-2 * (begin.abs() - expected) + 1e-9,
                    "{name}: {found}, not {expected}"
                );
                // No energy is gained.
                assert!(found <= before && found > -1e-9, "{name}: {found} after {before}");
                if before > 2.0 * rate * STEP {
                    let share = torque(&engine) * begin.signum() / (-COEFFICIENT * MASS * G);
                    assert!((share - 1.0).abs() < 1e-6, "{name}: {share} of the moment");
                }
                before = found;
            }
            assert!(before.abs() < 1e-9 && torque(&engine).abs() < 1e-9, "{name}: {before}");
            let State { pose, .. } = engine.system().states()[1];
            assert!(pose.translation.truncate().length() < 1e-6, "{name}: {pose:?}");
        }
    }
}

/// A moment below the limit turns nothing, and the body sleeps; one above it turns by the
/// difference.
#[test]
fn a_moment_turns_a_body_above_the_limit_only() {
    let limit = COEFFICIENT * MASS * G;
    for (geometry, friction) in [(BALL, 0.0), (BALL, 0.5), (BOX, 0.0)] {
        for (share, keys) in [(0.9, ""), (0.9, "[solver]\nsleep = 0"), (1.2, "")] {
            let mut engine = engine(&scene(geometry, 0.0, OF_BOTH, friction, keys));
            let driving = Wrench { torque: share * limit * DVec3::Z, ..Wrench::default() };
            engine.set_wrench(1, driving).unwrap();
            let start = engine.system().states()[1];
            let mut asleep = 0;
            for _ in 0..300 {
                asleep = engine.step(STEP).unwrap().asleep;
            }
            let (state, time) = (engine.system().states()[1], 300.0 * STEP);
            let expected = -limit * share.min(1.0);
            let off = torque(&engine) / expected - 1.0;
            assert!(off.abs() < 5e-4, "{geometry}, {share}: {} N m", torque(&engine));
            if share < 1.0 {
                let turned = state.pose.rotation.angle_between(start.pose.rotation);
                assert!(turned < 1e-7 && state.angular.length() < 1e-7, "{geometry}, {share}: {turned} rad");
                assert_eq!(asleep, usize::from(keys.is_empty()), "{geometry}");
            } else {
                let found = state.angular.z / time;
                let expected = (share - 1.0) * limit / inertia(geometry);
                assert!((found / expected - 1.0).abs() < 1e-2, "{geometry}: {found}, not {expected}");
            }
        }
    }
}

/// What carries a body turns it along, up to its own spin.
#[test]
fn a_turntable_takes_a_ball_along() {
    let table = "kinematic = true\nangular_velocity = [0, 0, 3]";
    let text = text(BALL, 0.0, OF_BOTH, 0.5, "").replacen("fixed = true", table, 1);
    let text = text.replacen(
        "shape = \"plane\"",
        "shape = { box = { half_extents = [0.2, 0.2, 0.1] } }\ntranslation = [0, 0, -0.1]",
        1,
    );
    let mut engine = engine(&parse(text));
    let rate = COEFFICIENT * MASS * G / inertia(BALL);
    for k in 1..=100 {
        engine.step(STEP).unwrap();
        let expected = f64::min(3.0, rate * STEP * f64::from(k));
        assert!((spin(&engine) - expected).abs() < 0.01 * expected, "{}, not {expected}", spin(&engine));
    }
}

/// A pair may have a coefficient of its own, and a body without one has none with any other.
#[test]
fn coefficients_combine_as_those_of_friction() {
    let pair = "[[friction]]\nbodies = [\"floor\", \"body\"]\ncoefficient = 0\ntorsional = 0.02\n";
    for (of_both, pair, expected) in [
        (OF_BOTH, "", 0.01),
        ([0.04, 0.0], "", 0.0),
        ([0.0, 0.04], "", 0.0),
        ([0.0; 2], pair, 0.02),
        (OF_BOTH, pair, 0.02),
    ] {
        let mut engine = engine(&scene(BALL, 20.0, of_both, 0.0, pair));
        assert!((engine.system().friction_torsional(0, 1) - expected).abs() < 1e-15);
        for _ in 0..4 {
            engine.step(STEP).unwrap();
        }
        let found = (20.0 - spin(&engine)) * inertia(BALL) / (4.0 * STEP * MASS * G);
        assert!((found - expected).abs() <= 0.01 * expected + 1e-9, "{found}, not {expected}");
        // From now on.
        engine.set_friction_torsional(0, 0.0).unwrap();
        let before = spin(&engine);
        engine.step(STEP).unwrap();
        let stays = (spin(&engine) - before).abs() < 1e-9;
        assert_eq!(stays, pair.is_empty(), "{of_both:?}, {pair}");
    }
}

/// A box that is thrown, tumbles and comes to rest.
const TUMBLES: &str = r#"
time_step = 5e-3
duration = 1.5
[record]
forces_every = 1
[[bodies]]
name = "floor"
shape = "plane"
fixed = true
friction = 0.3
[[bodies]]
name = "ball"
shape = { sphere = { radius = 0.03 } }
mass = 0.1
friction = 0.3
translation = [0.02, 0, 0.2]
angular_velocity = [0, 3, 30]
[[bodies]]
name = "box"
shape = { box = { half_extents = [0.06, 0.04, 0.02] } }
mass = 0.4
friction = 0.3
translation = [0, 0, 0.08]
rotation = [0.1, 0.2, 0, 0.9746794344808963]
velocity = [0.5, 0.2, 0]
angular_velocity = [4, -3, 25]
"#;

fn tumbles(coefficient: &str) -> LoadedScene {
    let key = format!("friction = 0.3\nfriction_torsional = {coefficient}");
    let text = if coefficient.is_empty() { TUMBLES.into() } else { TUMBLES.replace("friction = 0.3", &key) };
    LoadedScene::parse(text, "scene.toml").unwrap()
}

/// Also where bodies tumble over each other. At the end a ball rolls.
#[test]
fn torsional_friction_gains_no_energy() {
    for coefficient in ["0.002", "0.02"] {
        let (loaded, length) = (tumbles(coefficient), coefficient.parse::<f64>().unwrap());
        let (record, summary) = run(&loaded, loaded.system().unwrap());
        assert_eq!(summary.unconverged_steps, 0, "{coefficient}: {summary:?}");
        assert!(summary.warnings.is_empty(), "{coefficient}: {summary:?}");
        assert!(summary.kinetic_energy < 0.05 * summary.released_energy, "{coefficient}: {summary:?}");
        // Limits that lag behind the pushes may be off by 0.3 % of all.
        let limits = |(_, forces): (u64, tesdf_sim::Forces)| {
            let all: f64 = forces.contacts.iter().map(|c| c.normal_force).sum();
            let most = |c: &ContactForce| length * (1.0001 * c.normal_force + 4e-3 * all);
            forces.contacts.iter().all(|c| c.torque.abs() <= most(c))
        };
        assert!(record.forces().all(limits), "{coefficient}: a moment is above its limit");
        assert!(record.forces().any(|(_, forces)| forces.contacts.iter().any(|c| c.torque != 0.0)));
    }
}

/// Where nothing has torsional friction, runs are those of scenes without the key; and one that has
/// some gives the same bytes on one and on two threads.
#[test]
fn runs_have_the_same_bytes() {
    let bytes = |coefficient: &str, threads: usize| {
        let loaded = tumbles(coefficient);
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| run(&loaded, loaded.system().unwrap()).0.to_bytes().unwrap())
    };
    let without = bytes("", 1);
    assert!(without == bytes("0", 1));
    let with = bytes("0.01", 1);
    assert!(with == bytes("0.01", 2));
    assert!(with != without);
    // One body alone has none with the others.
    let mut loaded = tumbles("");
    loaded.scene.bodies[1].get_mut().friction_torsional = 0.01;
    let (alone, _) = run(&loaded, loaded.system().unwrap());
    let plain = RunRecord::from_bytes(&without).unwrap();
    for step in 0..=alone.steps() as usize {
        assert_eq!(alone.states(step), plain.states(step), "step {step}");
    }
}

/// Complete runs and journals keep the moments in a version of their own.
#[test]
fn runs_keep_the_moments() {
    let versions = [("", RUN_VERSION_WITHOUT_TORQUES), ("0.01", RUN_VERSION)];
    for (coefficient, version) in versions {
        let (folder, loaded) = (tempfile::tempdir().unwrap(), tumbles(coefficient));
        let (whole, _) = run(&loaded, loaded.system().unwrap());
        let bytes = whole.to_bytes().unwrap();
        let text = String::from_utf8_lossy(&bytes);
        assert!(text.contains(&format!("\\\"version\\\":{version},")), "{coefficient}");
        assert_eq!(text.contains("forces.torques"), version == RUN_VERSION);
        assert_eq!(RunRecord::from_bytes(&bytes).unwrap(), whole);
        // The run is cut after 60 steps, and goes on.
        let system = || loaded.system().unwrap();
        let destination = Destination::new(folder.path().join("run"), &SaveOptions::default()).unwrap();
        let origin = RunOrigin::of(&system(), "cpu").unwrap();
        let part = |cut: Option<&InterruptedRun>, until: u64| {
            let mut system = system();
            let run = match cut {
                Some(cut) => {
                    cut.check(&loaded.scene, &origin).unwrap();
                    cut.run.restore(&mut system).unwrap();
                    cut.run.clone()
                }
                None => PartialRun::new(&loaded.scene, &system, String::new()),
            };
            let mut journal = cut.map(|cut| RunJournal::resume(&destination, cut).unwrap().unwrap());
            simulate_from(&loaded.scene, &mut loaded.newton(system).unwrap(), run, |moment| {
                let begin = || RunJournal::begin(&destination, moment.record, &origin).unwrap().unwrap();
                journal.get_or_insert_with(begin).push(moment.record, &moment.report).unwrap();
                if moment.step == until { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
            })
        };
        assert!(matches!(part(None, 60), Err(SimulateError::Interrupted { steps: 60 })));
        let journal = fs::read(folder.path().join("run")).unwrap();
        assert_eq!(journal[8..12], version.to_le_bytes());
        let cut = InterruptedRun::open(folder.path().join("run")).unwrap();
        for ((step, found), (_, expected)) in cut.run.record.forces().zip(whole.forces()) {
            assert_eq!(found, expected, "step {step}");
        }
        assert!(part(Some(&cut), u64::MAX).unwrap().0.to_bytes().unwrap() == bytes, "{coefficient}");
        let read = RunRecord::open(folder.path().join("run")).unwrap();
        assert!(read.forces().map(|(_, forces)| forces).eq(whole.forces().map(|(_, forces)| forces)));
    }
}

/// The second number of `friction`, where a geom has a `condim` of 4 or 6; defaults are MuJoCo's.
#[test]
fn mjcf_has_torsional_friction_from_condim_4_on() {
    let read = |geom: &str, keys: &str| {
        let folder = tempfile::tempdir().unwrap();
        let text = format!(
            "<mujoco><default><default class='soft'><geom friction='0.7 0.03 0.001' condim='4'/></default></default>\
             <worldbody><body name='ball' pos='0 0 0.1'><freejoint/>{geom}</body></worldbody></mujoco>"
        );
        fs::write(folder.path().join("robot.xml"), text).unwrap();
        let text =
            format!("time_step = 1e-3\nduration = 0.1\nbodies = []\n[[robots]]\nfile = 'robot.xml'\n{keys}");
        let loaded = LoadedScene::parse(text, folder.path().join("scene.toml"))?;
        let body = loaded.scene.bodies.iter().map(|body| body.get_ref()).find(|body| body.name == "ball");
        let body = body.unwrap();
        if body.friction_torsional < 0.0 {
            loaded.system()?;
        }
        Ok::<_, tesdf_sim::scene_file::SceneError>((body.friction, body.friction_torsional))
    };
    for (attributes, keys, expected) in [
        ("", "", (1.0, 0.0)),
        ("friction='0.5 0.02 0.001'", "", (0.5, 0.0)),
        ("condim='4'", "", (1.0, 0.005)),
        ("condim='4' friction='0.5 0.02 0.001'", "", (0.5, 0.02)),
        ("class='soft'", "", (0.7, 0.03)),
        ("class='soft' condim='3'", "", (0.7, 0.0)),
        ("condim='6' friction='0.5 0.02 0.001'", "ignore = ['condim']", (0.5, 0.02)),
        ("condim='4'", "friction_torsional = 0.01", (1.0, 0.01)),
    ] {
        let geom = format!("<geom type='sphere' size='0.1' {attributes}/>");
        assert_eq!(read(&geom, keys).unwrap(), expected, "{attributes}, {keys}");
    }
    // The greatest of a body's geoms.
    let geoms = "<geom type='sphere' size='0.1' condim='4'/><geom type='sphere' size='0.05' class='soft'/>";
    assert_eq!(read(geoms, "").unwrap(), (1.0, 0.03));
    // Rolling friction is not simulated.
    let told = read("<geom type='sphere' size='0.1' condim='6'/>", "").unwrap_err().to_string();
    assert!(told.contains("has condim 6"), "{told}");
    let told =
        read("<geom type='sphere' size='0.1' condim='4' friction='1 -1'/>", "").unwrap_err().to_string();
    assert!(told.contains("friction_torsional"), "{told}");
}

#[test]
fn coefficients_that_cannot_be_are_refused() {
    let pair = "[[friction]]\nbodies = [\"floor\", \"body\"]\ncoefficient = 0\ntorsional = 0.02\n";
    let cases = [
        ("friction_torsional = 0.04", "friction_torsional = -0.04"),
        ("friction_torsional = 0.0025", "friction_torsional = inf"),
        ("friction_torsional = 0.0025", "friction_torsional = nan"),
        ("torsional = 0.02", "torsional = -1"),
    ];
    let cases = cases.map(|(from, to)| (from, to, "friction_torsional"));
    let messages = refused(&text(BALL, 0.0, OF_BOTH, 0.0, pair), Path::new("scene.toml"), &cases);
    assert!(messages.iter().all(|told| told.contains("a finite number, 0 or greater")), "{messages:?}");
}
