//! Interrupted runs: what remains of them, and that a resumed run gives the bits of an
//! uninterrupted run.
use std::fs;
use std::ops::ControlFlow;
use std::path::Path;
use std::time::Duration;

use tesdf::save::{Destination, SaveOptions};
use tesdf_sim::record::{InterruptedRun, RUN_VERSION, RecordError, RunJournal, RunOrigin, RunRecord};
use tesdf_sim::scene_file::LoadedScene;
use tesdf_sim::{Dynamics, PartialRun, Run, SimulateError, Summary, simulate, simulate_from};

/// A wedge falls onto a floor and a brick, and a door swings. The criterion follows it as a screw,
/// although it is not one.
const SCENE: &str = r#"
time_step = 2e-3
duration = 0.06

[record]
contacts_every = 3
forces_every = 2

[criterion.screw]
body = "wedge"
axis = [0, 0, -1]
pitch = 0.002
min_turns = 0.1
backlash = 1e-5

[[bodies]]
name = "floor"
shape = "plane"
fixed = true

[[bodies]]
name = "brick"
shape = { box = { half_extents = [0.02, 0.02, 0.01] } }
mass = 0.5
translation = [0, 0, 0.0101]

[[bodies]]
name = "wedge"
mesh = "wedge.obj"
density = 1000
translation = [0.012, 0.003, 0.022]
angular_velocity = [3, 20, 1]

[[bodies]]
name = "door"
shape = { sphere = { radius = 0.01 } }
mass = 0.2
translation = [0.2, 0, 0.1]

[[joints]]
name = "hinge"
kind = "hinge"
child = "door"
anchor = [0.23, 0, 0.1]
axis = [0, 1, 0]
"#;

const WEDGE: &str = "v 0 0 0\nv .02 0 0\nv 0 .02 0\nv 0 0 .02\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n";
const STEPS: u64 = 30;

struct Bench {
    folder: tempfile::TempDir,
    loaded: LoadedScene,
}

impl Bench {
    fn new() -> Self {
        let folder = tempfile::tempdir().unwrap();
        fs::write(folder.path().join("wedge.obj"), WEDGE).unwrap();
        let loaded = LoadedScene::parse(SCENE.into(), folder.path().join("scene.toml")).unwrap();
        Self { folder, loaded }
    }

    fn destination(&self) -> Destination {
        Destination::new(self.folder.path().join("run"), &SaveOptions::default()).unwrap()
    }

    fn system(&self) -> tesdf_sim::System {
        self.loaded.system().unwrap()
    }

    fn origin(&self) -> RunOrigin {
        RunOrigin::of(&self.system(), "cpu").unwrap()
    }

    /// An uninterrupted run.
    fn whole(&self) -> (RunRecord, Summary) {
        let mut engine = self.loaded.newton(self.system()).unwrap();
        simulate(&self.loaded.scene, &mut engine, |_| ControlFlow::Continue(())).unwrap()
    }

    /// Runs from the beginning or from an interrupted run, to the step `until`, or to the end for
    /// `None`.
    fn run(
        &self,
        cut: Option<&InterruptedRun>,
        until: Option<u64>,
    ) -> Result<(RunRecord, Summary), SimulateError> {
        let mut system = self.system();
        let run = match cut {
            Some(cut) => {
                cut.check(&self.loaded.scene, &self.origin()).unwrap();
                cut.run.restore(&mut system).unwrap();
                cut.run.clone()
            }
            None => PartialRun::new(&self.loaded.scene, &system, String::new()),
        };
        let mut engine = self.loaded.newton(system).unwrap();
        let mut journal = cut.map(|cut| RunJournal::resume(&self.destination(), cut).unwrap().unwrap());
        simulate_from(&self.loaded.scene, &mut engine, run, |moment| {
            let journal = journal.get_or_insert_with(|| {
                RunJournal::begin(&self.destination(), moment.record, &self.origin()).unwrap().unwrap()
            });
            journal.push(moment.record, &moment.report).unwrap();
            match Some(moment.step) == until {
                true => ControlFlow::Break(()),
                false => ControlFlow::Continue(()),
            }
        })
    }

    fn open(&self) -> InterruptedRun {
        InterruptedRun::open(self.folder.path().join("run")).unwrap()
    }

    fn bytes(&self) -> Vec<u8> {
        fs::read(self.folder.path().join("run")).unwrap()
    }
}

/// The summary without wall times, which differ between runs.
fn timeless(summary: &Summary) -> Summary {
    Summary { detection_ms: 0.0, solution_ms: 0.0, ..summary.clone() }
}

#[test]
fn a_run_interrupted_at_any_step_resumes_to_the_same_bytes() {
    let bench = Bench::new();
    let (whole, summary) = bench.whole();
    let expected = whole.to_bytes().unwrap();
    let last = whole.contacts().last().unwrap();
    assert!(!last.1.is_empty() && last.0 == 27, "nothing touches: the scene tests nothing");
    for at in [1, 2, 3, 11, STEPS - 1] {
        let stopped = bench.run(None, Some(at));
        assert!(matches!(stopped, Err(SimulateError::Interrupted { steps }) if steps == at));
        let cut = bench.open();
        assert_eq!((cut.run.record.steps(), cut.run.record.planned_steps()), (at, Some(STEPS)));
        let (record, found) = bench.run(Some(&cut), None).unwrap();
        assert!(record.to_bytes().unwrap() == expected, "cut at {at}: other bytes");
        assert_eq!((&record, timeless(&found)), (&whole, timeless(&summary)), "cut at {at}");
        assert!(found.detection_ms > 0.0 && found.solution_ms > 0.0);
    }
    // The journal is complete, but the complete file was not written. Resuming only has to write
    // it.
    let (record, _) = bench.run(Some(&bench.open()), None).unwrap();
    assert!(record.to_bytes().unwrap() == expected);
}

#[test]
fn a_run_made_step_by_step_is_the_same() {
    let bench = Bench::new();
    let (whole, summary) = bench.whole();
    let mut engine = bench.loaded.newton(bench.system()).unwrap();
    let run = PartialRun::new(&bench.loaded.scene, engine.system(), String::new());
    let mut run = Run::new(&bench.loaded.scene, engine.system(), run).unwrap();
    while !run.is_complete() {
        assert_eq!(run.record().planned_steps(), Some(STEPS));
        run.step(&mut engine).unwrap();
    }
    assert_eq!(run.planned_steps(), STEPS);
    assert_eq!(timeless(&run.summary(engine.system())), timeless(&summary));
    assert_eq!(run.clone().into_record(engine.system()), whole);
    // The duration does not limit the steps.
    assert_eq!(run.step(&mut engine).unwrap().step, STEPS + 1);
}

#[test]
fn a_run_may_be_interrupted_again_and_again() {
    let bench = Bench::new();
    assert!(bench.run(None, Some(4)).is_err());
    for at in [5, 9, 10, 22] {
        assert!(bench.run(Some(&bench.open()), Some(at)).is_err());
    }
    let (record, _) = bench.run(Some(&bench.open()), None).unwrap();
    assert_eq!(record, bench.whole().0);
}

/// A kill leaves a prefix of the journal. Each prefix is not yet a run, or a run up to a complete
/// step that equals the uninterrupted run.
#[test]
fn a_journal_is_read_up_to_its_last_whole_step() {
    let bench = Bench::new();
    bench.run(None, None).unwrap();
    let (bytes, whole) = (bench.bytes(), bench.whole().0);
    let mut steps = None;
    for end in 0..=bytes.len() {
        match RunRecord::from_bytes(&bytes[..end]) {
            Ok(found) => {
                assert!(Some(found.steps()) >= steps && found.planned_steps() == Some(STEPS));
                if Some(found.steps()) == steps {
                    continue;
                }
                steps = Some(found.steps());
                for step in 0..found.times().len() {
                    assert_eq!(found.pose(step, 2), whole.pose(step, 2), "{end} bytes");
                    assert_eq!(found.velocity(step, 1), whole.velocity(step, 1), "{end} bytes");
                }
                assert!(found.contacts().eq(whole.contacts().take_while(|(step, _)| *step < found.steps())));
            }
            Err(_) => assert_eq!(steps, None, "{end} bytes"),
        }
    }
    assert_eq!(steps, Some(STEPS));
    // A power failure can leave unwritten blocks before written blocks.
    for at in (0..bytes.len()).step_by(97) {
        let mut damaged = bytes.clone();
        damaged[at] ^= 0x10;
        if let Ok(found) = RunRecord::from_bytes(&damaged) {
            let intact = RunRecord::from_bytes(&bytes[..at]).map_or(0, |intact| intact.steps());
            assert_eq!(found.steps(), intact, "byte {at}");
        }
    }
}

#[test]
fn changes_that_would_give_other_bits_are_refused() {
    let bench = Bench::new();
    assert!(bench.run(None, Some(2)).is_err());
    let cut = bench.open();
    let refusal = |change: &dyn Fn(&mut LoadedScene, &mut RunOrigin)| {
        let (mut loaded, mut origin) = (bench.loaded.clone(), bench.origin());
        change(&mut loaded, &mut origin);
        cut.check(&loaded.scene, &origin).unwrap_err().to_string()
    };
    let run = ", but the run was made with ";
    assert_eq!(refusal(&|loaded, _| loaded.scene.time_step = 1e-3), format!("time_step is 0.001{run}0.002"));
    assert_eq!(
        refusal(&|loaded, _| loaded.scene.solver.redetections = 7),
        format!("solver.redetections is 7{run}{}", bench.loaded.scene.solver.redetections)
    );
    let heavier = refusal(&|loaded, _| loaded.scene.bodies[1].get_mut().mass = Some(0.75));
    assert_eq!(heavier, format!("bodies[1].mass is 0.75{run}0.5"));
    let fewer = refusal(&|loaded, _| drop(loaded.scene.bodies.pop()));
    assert!(fewer.starts_with("bodies is [{") && fewer.contains('…') && fewer.len() < 400, "{fewer}");
    assert_eq!(refusal(&|_, origin| origin.device = "gpu".into()), format!("device is \"gpu\"{run}\"cpu\""));
    assert!(refusal(&|_, origin| origin.version = "9.9.9".into()).starts_with("version is \"9.9.9\""));
    // Another mesh under the same name.
    fs::write(bench.folder.path().join("wedge.obj"), WEDGE.replace(".02", ".03")).unwrap();
    assert!(refusal(&|_, _| {}).starts_with("the geometry of body wedge is not the one"));
    // The same mesh under another name.
    fs::write(bench.folder.path().join("moved.obj"), WEDGE).unwrap();
    let mut loaded = bench.loaded.clone();
    assert!(loaded.replace_geometry("wedge", "moved.obj"));
    let system = loaded.system().unwrap();
    cut.check(&loaded.scene, &RunOrigin::of(&system, "cpu").unwrap()).unwrap();
}

#[test]
fn complete_runs_and_other_files_are_not_resumed() {
    let bench = Bench::new();
    let path = bench.folder.path().join("run");
    let open = || InterruptedRun::open(&path).unwrap_err();
    bench.whole().0.save(&path).unwrap();
    assert!(matches!(open(), RecordError::Complete { steps: STEPS }));
    fs::write(&path, b"tesdfrun\x09\0\0\0").unwrap();
    assert!(matches!(open(), RecordError::Version { found: 9, reads: RUN_VERSION }));
    let head = [&b"tesdfrun"[..], &RUN_VERSION.to_le_bytes()].concat();
    for bytes in [&head[..8], &head, b"solid cube"] {
        fs::write(&path, bytes).unwrap();
        let text = open().to_string();
        assert!(text.starts_with("not a run of tesdf: ") && text.contains("simulate"), "{text}");
    }
    assert!(matches!(InterruptedRun::open(Path::new("none")), Err(RecordError::Read { .. })));
}

/// An incomplete record stays marked as incomplete when it is written and read.
#[test]
fn an_unfinished_record_is_marked() {
    let bench = Bench::new();
    let mut kept = None;
    let mut engine = bench.loaded.newton(bench.system()).unwrap();
    let ended = simulate(&bench.loaded.scene, &mut engine, |moment| {
        assert!(moment.report.detection > Duration::ZERO);
        kept = Some(moment.record.clone());
        ControlFlow::Break(())
    });
    assert!(matches!(ended, Err(SimulateError::Interrupted { steps: 1 })));
    let read = RunRecord::from_bytes(&kept.clone().unwrap().to_bytes().unwrap()).unwrap();
    assert_eq!((read.steps(), read.planned_steps()), (1, Some(STEPS)));
    assert_eq!(Some(read), kept);
}
