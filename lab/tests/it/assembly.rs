//! Grippers put a peg into its hole and a nut onto its bolt.
use std::f64::consts::TAU;
use std::ops::ControlFlow;

use tesdf::collide::Pose;
use tesdf::glam::{DQuat, DVec3};
use tesdf::mesh::write;
use tesdf::save::{Destination, SaveOptions};
use tesdf_lab::scenes::{AssemblyCriterion, AssemblyReport, AssemblyTracker, Plan};
use tesdf_parts::{Nut, Resolution, Size, Thread};
use tesdf_sim::criterion::Tracker;
use tesdf_sim::record::{InterruptedRun, RunJournal, RunOrigin};
use tesdf_sim::scene_file::{DetectorMode, LoadedScene};
use tesdf_sim::{Dynamics, PartialRun, RunRecord, State, Summary, System, Wrench, simulate_from};

use crate::support::{self, balls, parse, text_of};

/// Time in which the short form ends, s.
const END: f64 = 8.0;

/// The scene of the laboratory with one peg and one nut.
fn text() -> String {
    let mut text = text_of("robo-assembly");
    for (from, to) in [
        ("count = 3", "count = 1"),
        ("count = 7", "count = 1"),
        ("translation = [-0.18, 0.06,", "translation = [0.18, 0.06,"),
        ("translation = [-0.18, -0.06,", "translation = [0.18, -0.06,"),
        ("duration = 37", "duration = 8"),
    ] {
        assert!(text.contains(from), "{from}");
        text = text.replace(from, to);
    }
    text
}

/// Its plan. Each gripper does a task.
fn plan_text() -> String {
    let text = text_of("robo-assembly-plan");
    let (before, tasks) = text.split_once("[[tasks]]").expect("the tasks");
    let task = |part: &str| {
        let of_part = |task: &&str| task.contains(&format!("part = \"{part}\""));
        let task = tasks.split("[[tasks]]").find(of_part).expect(part);
        format!("[[tasks]]{task}\n")
    };
    format!("{before}{}{}", task("peg0"), task("nut0").replace("left", "right"))
}

/// The scene of `text` with the scripts of `plan`.
fn planned(text: String, plan: &str) -> Result<LoadedScene, String> {
    let mut loaded = parse(text, "robo-assembly").unwrap();
    let plan: Plan = toml::from_str(plan).unwrap();
    let scripts = plan.scripts(&loaded.scene)?;
    loaded.scene.scripts.extend(scripts);
    Ok(loaded)
}

fn load(text: String) -> LoadedScene {
    planned(text, &plan_text()).unwrap()
}

fn run(change: impl FnOnce(&mut LoadedScene)) -> (RunRecord, Summary) {
    let mut loaded = load(text());
    change(&mut loaded);
    support::run(&loaded)
}

fn failures(summary: &Summary) -> String {
    assert_eq!(summary.passed, Some(false));
    summary.report::<AssemblyReport>().unwrap().failures.join("\n")
}

#[test]
#[ignore = "a whole scene: .ci/release"]
fn a_peg_and_a_nut_are_assembled() {
    let (_, summary) = run(|_| ());
    assert_eq!(summary.passed, Some(true), "{summary:?}");
    let assembly = summary.report::<AssemblyReport>().unwrap();
    let [peg, nut] = assembly.parts.as_slice() else { panic!("{assembly:?}") };
    assert_eq!((assembly.assembled, peg.name.as_str(), nut.name.as_str()), (2, "peg0", "nut0"));
    assert!(nut.turns.unwrap() > 2.0 && nut.pitch_error.unwrap() > 1e-5, "{nut:?}");
    assert!(assembly.measurements >= 30, "{assembly:?}");
}

#[test]
#[ignore = "a whole scene: .ci/release"]
fn without_contacts_or_friction_nothing_is_assembled() {
    let (_, off) = run(|loaded| loaded.scene.detector.choose(DetectorMode::Off));
    let off = failures(&off);
    assert!(off.contains("depth: peg0") && off.contains("turns: nut0") && off.contains("rest: "), "{off}");

    let (_, slippery) = run(|loaded| {
        loaded.scene.bodies.iter_mut().for_each(|body| body.get_mut().friction = 0.0);
        // The grippers have risen without the parts.
        loaded.scene.duration = 2.5;
    });
    let slippery = failures(&slippery);
    assert!(slippery.contains("depth: peg0") && slippery.contains("turns: nut0"), "{slippery}");
}

/// A nut of a pitch of 1.5 mm does not go onto a bolt of 2 mm.
#[test]
#[ignore = "a whole scene: .ci/release"]
fn a_nut_of_another_pitch_fails() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("nut.ply");
    let m16 = "M16".parse::<Size>().unwrap();
    let nut = Nut { thread: Thread { pitch: 1.5e-3, ..m16.thread() }, clearance: 1e-4, ..Nut::iso_4032(m16) };
    write(&file, nut.mesh(Resolution::Segments(48)).unwrap().mesh()).unwrap();
    let (_, summary) = run(|loaded| assert!(loaded.replace_geometry("nut0", &file)));
    let assembly = summary.report::<AssemblyReport>().unwrap();
    assert_eq!(assembly.assembled, 1, "{assembly:?}");
    let failures = failures(&summary);
    assert!(failures.contains("nut0") && !failures.contains("peg0"), "{failures}");
}

/// The states after the first 1.6 s, in which the grippers grasp and lift.
fn states(threads: usize, killed_at: Option<u64>) -> Vec<State> {
    const STEPS: u64 = 320;
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
    pool.install(|| {
        let loaded = load(text());
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("run");
        let steps = |from: Option<InterruptedRun>, to: u64| {
            let mut system = loaded.system().unwrap();
            let origin = RunOrigin::of(&system, "cpu").unwrap();
            let run = from.as_ref().map_or_else(
                || PartialRun::new(&loaded.scene, &system, String::new()),
                |cut| cut.run.clone(),
            );
            run.restore(&mut system).unwrap();
            let mut engine = loaded.newton(system).unwrap();
            let destination = Destination::new(&file, &SaveOptions::default()).unwrap();
            let mut journal = None;
            let _ = simulate_from(&loaded.scene, &mut engine, run, |moment| {
                let journal = journal.get_or_insert_with(|| {
                    RunJournal::begin(&destination, moment.record, &origin).unwrap().unwrap()
                });
                journal.push(moment.record, &moment.report).unwrap();
                match moment.step == to {
                    true => ControlFlow::Break(()),
                    false => ControlFlow::Continue(()),
                }
            });
            engine.system().states().to_vec()
        };
        match killed_at {
            None => steps(None, STEPS),
            Some(at) => {
                steps(None, at);
                steps(Some(InterruptedRun::open(&file).unwrap()), STEPS)
            }
        }
    })
}

#[test]
#[ignore = "a whole scene: .ci/release"]
fn any_number_of_threads_and_a_resumed_run_give_the_same_states() {
    let one = states(1, None);
    let nut = load(text()).scene.bodies.iter().position(|b| b.get_ref().name == "nut0").unwrap();
    assert!(one[nut].pose.translation.z > 0.03, "{:?}", one[nut]);
    assert_eq!(one, states(8, None));
    assert_eq!(one, states(2, Some(250)));
}

/// The report of a run in which the peg is in its place and the nut goes down its bolt, changed at
/// each share of the run.
fn report(change: impl Fn(&mut System, f64)) -> AssemblyReport {
    let loaded = load(balls(&text()));
    let mut system = loaded.system().unwrap();
    let mut tracker =
        AssemblyTracker::new(loaded.scene.criterion.get::<AssemblyCriterion>().unwrap(), &system).unwrap();
    let start = system.states().to_vec();
    let [peg, hole, nut, bolt] = ["peg0", "hole0", "nut0", "bolt0"].map(|name| find(&system, name));
    for step in 1..=100 {
        let share = 0.01 * f64::from(step);
        let mut states = start.clone();
        states[peg].pose = Pose::at(states[hole].pose.to_world(DVec3::new(0.0, 0.0, 5e-3)));
        states[nut].pose = on_thread(states[bolt].pose, -0.016 + 0.008 * share, 0.0);
        system.set_states(states).unwrap();
        change(&mut system, share);
        tracker.observe(&system, 0.01);
    }
    tracker.report(&system)
}

/// A nut at this place of the bolt's axis, turned by `more` than the thread demands.
fn on_thread(bolt: Pose, z: f64, more: f64) -> Pose {
    let turn = DQuat::from_rotation_z(TAU * z / 2e-3 + more);
    Pose { translation: bolt.to_world(DVec3::Z * z), rotation: (bolt.rotation * turn).normalize() }
}

fn find(system: &System, name: &str) -> usize {
    system.bodies().iter().position(|body| body.name == name).unwrap()
}

fn change_state(system: &mut System, name: &str, change: impl FnOnce(&mut State)) {
    let body = find(system, name);
    let mut state = system.states()[body];
    change(&mut state);
    system.set_state(body, state).unwrap();
}

#[test]
fn each_failure_has_its_name() {
    let names = |report: &AssemblyReport| {
        report.failures.iter().map(|f| f.split(':').next().unwrap().to_string()).collect::<Vec<_>>()
    };
    let good = report(|_, _| ());
    assert_eq!((good.assembled, names(&good).len()), (2, 0), "{good:?}");
    // The nut comes a pitch over the tip at z = -12.8 mm, and ends at z = -8 mm.
    let turns = good.parts[1].turns.unwrap();
    assert!((turns - 2.4).abs() < 0.05 && good.parts[1].pitch_error.unwrap() < 1e-12, "{good:?}");

    type Change = fn(&mut System, f64);
    let cases: [(&str, Change); 8] = [
        ("depth", |s, _| change_state(s, "peg0", |peg| peg.pose.translation.z += 1.1e-4)),
        ("offset", |s, _| change_state(s, "peg0", |peg| peg.pose.translation.x += 2.1e-4)),
        ("tilt", |s, _| change_state(s, "peg0", |peg| peg.pose.rotation = DQuat::from_rotation_y(8.1e-3))),
        ("turns", |s, share| {
            let bolt = s.states()[find(s, "bolt0")].pose;
            let z = -0.016 + 0.008 * share.min(0.8);
            change_state(s, "nut0", |nut| nut.pose = on_thread(bolt, z, 0.0));
        }),
        // 5 % too fast: 0.05 × 4.8 mm.
        ("thread", |s, share| {
            let bolt = s.states()[find(s, "bolt0")].pose;
            let z = -0.016 + 0.008 * share;
            change_state(s, "nut0", |nut| nut.pose = on_thread(bolt, z, 0.05 * TAU * 4.0 * share));
        }),
        ("rest", |s, _| change_state(s, "nut0", |nut| nut.linear.y = 2e-4)),
        // Balls of 1 mm whose centres are 2.9 mm apart.
        ("release", |s, _| {
            let nut = s.states()[find(s, "nut0")].pose.translation;
            change_state(s, "left_finger_1", |finger| finger.pose.translation = nut + DVec3::Y * 2.9e-3);
        }),
        ("penetration", |s, share| {
            let peg = s.states()[find(s, "peg0")].pose.translation;
            let at = peg + DVec3::Y * if share < 0.5 { 1.985e-3 } else { 1.0 };
            change_state(s, "left_finger_1", |finger| finger.pose.translation = at);
        }),
    ];
    for (name, change) in cases {
        let found = report(change);
        assert_eq!(names(&found), [name], "{found:?}");
    }
    let pushed = report(|system, _| {
        let peg = find(system, "peg0");
        system.set_wrench(peg, Wrench { force: DVec3::Z, torque: DVec3::ZERO }).unwrap();
    });
    assert_eq!(names(&pushed), ["held"], "{pushed:?}");
}

#[test]
fn what_is_no_assembly_is_refused() {
    let text = balls(&text());
    let section = "[[criterion.assembly.nuts]]";
    let script = format!("[[scripts]]\nbody = \"peg0\"\nkeyframes = [{{ time = 0 }}]\n\n{section}");
    let joint = format!("[[joints]]\nname = \"hook\"\nkind = \"ball\"\nchild = \"nut0\"\n\n{section}");
    let cases = [
        ("parts = \"peg\"", "parts = \"pig\"", "there is no body pig0"),
        ("onto = \"bolt\"", "onto = \"bold\"", "there is no body bold0"),
        ("parts = \"peg\"", "parts = \"hole\"", "body hole0 is fixed; no contact can hold it"),
        ("into = \"hole\", count = 1", "into = \"hole\", count = 0", "count of peg is 0"),
        ("clearance = 1e-4 }]", "clearance = 0 }]", "pegs: clearance is 0; expected a positive number"),
        ("pitch = 2e-3\nclearance", "pitch = -1\nclearance", "nuts: pitch is -1"),
        ("check_every = 0.1", "check_every = 0", "check_every is 0; expected a positive number"),
        (section, &script, "a script drives body peg0; only contacts may, so take it out"),
        (section, &joint, "joint hook holds body nut0; only contacts may, so take it out"),
        (
            "translation = [-0.18, 0.14, 0.01]",
            "translation = [-0.18, -0.14, 0.04]",
            "body peg0 starts in its place",
        ),
        (
            "translation = [0.18, 0.06, 0.0248]",
            "translation = [0.18, -0.06, 0.05]",
            "body nut0 starts in its place",
        ),
    ];
    support::refused(&text, "robo-assembly", &cases);
}

#[test]
fn a_plan_that_does_not_fit_is_refused_with_its_place() {
    let (text, plan) = (text(), plan_text());
    let cases = [
        ("part = \"peg0\"", "part = \"pig\"", "task 1 (pig): there is no body pig; give the name of a body"),
        ("gripper = \"right\"", "gripper = \"middle\"", "task 2 (nut0): there is no gripper middle"),
        ("wrist = \"left_wrist\"", "wrist = \"wrist\"", "gripper left: there is no body wrist"),
        ("name = \"right\"\nwrist", "name = \"left\"\nwrist", "gripper left: the name is used twice"),
        ("speed = 0.3\n", "speed = 0\n", "gripper left: speed is 0; expected a positive number"),
        ("pitch = 2e-3 } }", "pitch = 0 } }", "task 2 (nut0): pitch is 0; expected a positive number"),
        ("approach = 0.03", "approach = nan", "task 1 (peg0): approach is NaN; expected a positive number"),
        ("press = 2e-4", "press = inf", "press inf m; expected finite numbers"),
        ("tool = [0, 0, -0.115]", "tool = [0, 0, nan]", "gripper left: tool"),
    ];
    for (from, to, expected) in cases {
        assert!(plan.contains(from), "{from}");
        let message = planned(text.clone(), &plan.replacen(from, to, 1)).expect_err(expected);
        assert!(message.contains(expected), "{message}: expected {expected}");
    }
    let short = planned(text.replace("duration = 8", "duration = 4"), &plan).unwrap_err();
    assert!(short.contains("expected at most the duration of 4 s"), "{short}");
}

#[test]
fn a_plan_becomes_scripts() {
    let loaded = load(text());
    assert_eq!(loaded.scene.scripts.len(), 6);
    let wrist = &loaded.scene.scripts[0];
    assert_eq!(wrist.body.as_deref(), Some("left_wrist"));
    let times: Vec<f64> = wrist.keyframes.iter().map(|k| k.time).collect();
    assert!(times.is_sorted_by(|a, b| a < b) && *times.last().unwrap() <= END, "{times:?}");
    let home = [wrist.keyframes.last().unwrap(), wrist.keyframes.first().unwrap()];
    assert_eq!(home[0].translation, Some([-0.22, 0.0, 0.235]));
    assert_eq!(home[1].translation, None);
    // The right wrist makes four turns clockwise while the nut descends by four pitches.
    let wrist = &loaded.scene.scripts[3];
    let turn = wrist.keyframes.iter().position(|k| k.turn.is_some()).unwrap();
    let heights = [turn - 1, turn].map(|k| wrist.keyframes[k].translation.unwrap()[2]);
    assert!((heights[0] - heights[1] - 8e-3).abs() < 1e-12, "{heights:?}");
    assert!((wrist.keyframes[turn].turn.unwrap()[2] + 8.0 * std::f64::consts::PI).abs() < 1e-9);
}
