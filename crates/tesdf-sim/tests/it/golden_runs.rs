//! Files of each version of runs and journals, written once. They must continue to open and hold
//! the same values. `TESDF_WRITE_GOLDEN=1` writes them.
use std::fs;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

use tesdf::glam::DVec3;
use tesdf::save::{Destination, SaveOptions, save_atomic};
use tesdf_sim::record::{
    InterruptedRun, RUN_VERSION, RUN_VERSION_WITHOUT_TORQUES, RunJournal, RunOrigin, RunRecord,
};
use tesdf_sim::scene_file::LoadedScene;
use tesdf_sim::{PartialRun, SimulateError, simulate_from};

/// A box that spins on a floor, and a door.
const SCENE: &str = r#"
time_step = 4e-3
duration = 0.02

[record]
contacts_every = 1
forces_every = 2

[[bodies]]
name = "floor"
shape = "plane"
fixed = true

[[bodies]]
name = "box"
shape = { box = { half_extents = [0.06, 0.04, 0.02] } }
mass = 0.5
translation = [0, 0, 0.02]
angular_velocity = [0, 0, 3]

[[bodies]]
name = "door"
shape = { sphere = { radius = 0.01 } }
mass = 0.25
translation = [1, 0, 0.5]

[[joints]]
name = "hinge"
kind = "hinge"
child = "door"
anchor = [0.75, 0, 0.5]
axis = [0, 1, 0]
"#;
const STEPS: u64 = 5;
/// The step at which the journals end.
const CUT: u64 = 3;
/// Where the door is at the end, m.
const FALLEN: DVec3 = DVec3::new(0.999988927901231, 0.0, 0.49764714454123216);
/// What torsional friction takes of the spin until the end, rad/s: the coefficient (m) times the
/// weight, over the moment of inertia.
const BRAKED: f64 = 0.01 * (0.5 * 9.81) * 0.02 / (0.5 / 3.0 * (0.06 * 0.06 + 0.04 * 0.04));

fn path(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data").join(name)
}

/// Runs the scene to its end, or writes its journal up to a step.
fn run(text: &str, journal: Option<&Path>) -> Result<RunRecord, SimulateError> {
    let loaded = LoadedScene::parse(text.into(), "scene.toml").unwrap();
    let system = loaded.system().unwrap();
    let origin = RunOrigin::of(&system, "cpu").unwrap();
    let begun = PartialRun::new(&loaded.scene, &system, String::new());
    let mut engine = loaded.newton(system).unwrap();
    let mut open = None;
    let ended = simulate_from(&loaded.scene, &mut engine, begun, |moment| {
        let Some(journal) = journal else { return ControlFlow::Continue(()) };
        let open = open.get_or_insert_with(|| {
            let to = Destination::new(journal, &SaveOptions::default()).unwrap();
            RunJournal::begin(&to, moment.record, &origin).unwrap().unwrap()
        });
        open.push(moment.record, &moment.report).unwrap();
        if moment.step == CUT { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    });
    ended.map(|(record, _)| record)
}

#[test]
fn golden_runs_and_journals_open() {
    let torsional = SCENE.replace("mass = 0.5", "mass = 0.5\nfriction_torsional = 0.01");
    let torsional = torsional.replace("fixed = true", "fixed = true\nfriction_torsional = 0.01");
    for (version, text, spin) in
        [(RUN_VERSION_WITHOUT_TORQUES, SCENE, 3.0), (RUN_VERSION, &torsional, 3.0 - BRAKED)]
    {
        let [whole, cut] = ["run", "journal"].map(|kind| path(&format!("golden_{kind}_v{version}")));
        if std::env::var_os("TESDF_WRITE_GOLDEN").is_some() {
            save_atomic(&whole, &run(text, None).unwrap().to_bytes().unwrap()).unwrap();
            run(text, Some(&cut)).expect_err("it is cut");
        }
        let record = RunRecord::open(&whole).unwrap();
        let bytes = fs::read(&whole).unwrap();
        let told = format!("\\\"version\\\":{version},");
        assert!(String::from_utf8_lossy(&bytes).contains(&told), "{told}");
        assert_eq!((record.steps(), record.planned_steps()), (STEPS, None));
        assert_eq!(
            (record.bodies.join(" "), record.joints.join(" ")),
            ("floor box door".into(), "hinge".into())
        );
        assert_eq!(record.times(), [0.0, 0.004, 0.008, 0.012, 0.016, 0.02]);
        // The box spins in its place, and the door falls with its own acceleration.
        let last = STEPS as usize;
        let [_, turning] = record.velocity(last, 1).unwrap();
        assert!((turning - DVec3::Z * spin).length() < 1e-6, "version {version}: {turning}");
        let at = record.pose(last, 1).unwrap().translation;
        assert!((at - DVec3::Z * 0.02).length() < 1e-6, "version {version}: {at}");
        let fallen = record.pose(last, 2).unwrap().translation;
        assert!((fallen - FALLEN).length() < 1e-9, "version {version}: {fallen}");
        // The floor carries the box.
        assert_eq!(record.contacts().map(|(step, _)| step).collect::<Vec<_>>(), [0, 1, 2, 3, 4]);
        assert!(record.contacts().map(|(_, contacts)| contacts.len()).eq([7, 6, 6, 6, 6]));
        let forces: Vec<_> = record.forces().collect();
        assert_eq!(forces.iter().map(|(step, _)| *step).collect::<Vec<_>>(), [0, 2, 4]);
        for (_, forces) in &forces {
            let up: f64 = forces.contacts.iter().map(|force| force.normal_force).sum();
            assert!((up - 0.5 * 9.81).abs() < 1e-6, "version {version}: {up}");
            let torque: f64 = forces.contacts.iter().map(|force| force.torque.abs()).sum();
            assert_eq!(torque > 0.0, version == RUN_VERSION, "version {version}: {torque}");
        }
        assert!(record.to_bytes().unwrap() == bytes, "version {version}: other bytes");

        assert_eq!(fs::read(&cut).unwrap()[..12], [&b"tesdfrun"[..], &version.to_le_bytes()].concat());
        let cut = InterruptedRun::open(&cut).unwrap().run.record;
        assert_eq!((cut.steps(), cut.planned_steps()), (CUT, Some(STEPS)));
        for step in 0..=CUT as usize {
            for body in 0..3 {
                assert_eq!(cut.pose(step, body), record.pose(step, body));
                assert_eq!(cut.velocity(step, body), record.velocity(step, body));
            }
        }
        assert!(cut.contacts().eq(record.contacts().take(CUT as usize)));
        assert!(cut.forces().eq(record.forces().take(2)));
    }
}
