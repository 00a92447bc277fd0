//! A record has the warnings of its run: complete, cut at any step, resumed and read from bytes.
use std::fs;
use std::ops::ControlFlow;

use serde_json::{Value, json};
use tesdf::collide::{Contact, HiddenOverlap, InstanceId};
use tesdf::save::{Destination, SaveOptions};
use tesdf_sim::newton::Newton;
use tesdf_sim::record::{
    InterruptedRun, RUN_VERSION_WITHOUT_TORQUES, RecordError, RunJournal, RunOrigin, RunRecord,
};
use tesdf_sim::scene_file::LoadedScene;
use tesdf_sim::{
    Dynamics, DynamicsError, Motor, PartialRun, Run, State, StepReport, System, Warning, WarningKind, Wrench,
    simulate_from,
};

/// Two welds hold one box, and the other ends of both go away. A wrench pushes a ball for a while,
/// which is no energy from nowhere. A press goes deep into a block.
const SCENE: &str = r#"
time_step = 0.005
duration = 0.2

[[bodies]]
name = "p"
shape = { box = { half_extents = [0.05, 0.05, 0.05] } }
kinematic = true
translation = [-0.2, 0, 0.5]

[[bodies]]
name = "b"
shape = { box = { half_extents = [0.05, 0.05, 0.05] } }
mass = 1.0
translation = [0, 0, 0.5]

[[bodies]]
name = "ball"
shape = { sphere = { radius = 0.02 } }
mass = 1.0
translation = [3, 0, 0.5]

[[bodies]]
name = "block"
shape = { box = { half_extents = [0.05, 0.05, 0.05] } }
mass = 1.0
translation = [0, 3, 0.05]

[[bodies]]
name = "floor"
shape = "plane"
fixed = true

[[bodies]]
name = "press"
shape = { box = { half_extents = [0.1, 0.1, 0.02] } }
fixed = true
translation = [0, 3, 0.1]

[[joints]]
name = "u"
kind = "weld"
parent = "p"
child = "b"
anchor = [-0.05, 0, 0.5]

[[joints]]
name = "v"
kind = "weld"
child = "b"
anchor = [0.05, 0, 0.5]

[[scripts]]
body = "p"
keyframes = [{ time = 0.05 }, { time = 0.2, translation = [-0.4, 0, 0.5] }]

[[scripts]]
body = "ball"
interpolation = "step"
keyframes = [{ time = 0, force = [0, 0, 500] }, { time = 0.05, force = [0, 0, 0] }]
"#;

fn load(text: &str) -> LoadedScene {
    LoadedScene::parse(text.into(), "scene.toml").unwrap()
}

/// The scene without its kinematic body, so that energy is watched once the wrench is gone.
fn without_drives() -> String {
    let of_ball = SCENE.find("[[scripts]]\nbody = \"ball\"").unwrap();
    let (head, script) = (&SCENE[..SCENE.find("[[scripts]]").unwrap()], &SCENE[of_ball..]);
    head.replace("kinematic = true", "fixed = true") + script
}

/// Does what warnings are about: makes the ball faster once its wrench is gone, does not converge in
/// some steps, and has a hidden overlap in some.
struct Wrong {
    engine: Newton,
    hidden: Vec<HiddenOverlap>,
}

impl Wrong {
    fn new(loaded: &LoadedScene, system: System) -> Self {
        Self { engine: loaded.newton(system).unwrap(), hidden: Vec::new() }
    }
}

impl Dynamics for Wrong {
    fn system(&self) -> &System {
        self.engine.system()
    }

    fn set_state(&mut self, body: usize, state: State) -> Result<(), DynamicsError> {
        self.engine.set_state(body, state)
    }

    fn set_motor(&mut self, joint: usize, motor: Option<Motor>) -> Result<(), DynamicsError> {
        self.engine.set_motor(joint, motor)
    }

    fn set_wrench(&mut self, body: usize, wrench: Wrench) -> Result<(), DynamicsError> {
        self.engine.set_wrench(body, wrench)
    }

    fn recall(&mut self, states: Vec<State>, time_step: Option<f64>) -> Result<(), DynamicsError> {
        self.engine.recall(states, time_step)
    }

    fn remembers(&self) -> u64 {
        self.engine.remembers()
    }

    fn step(&mut self, time_step: f64) -> Result<StepReport, DynamicsError> {
        // What it does follows from the states alone, so that a resumed run does the same.
        let ball = self.engine.system().states()[2];
        let report = self.engine.step(time_step)?;
        let bits = ball.pose.translation.z.to_bits() as usize;
        let ids: Vec<InstanceId> =
            self.engine.system().bodies()[..2].iter().map(|body| body.instance).collect();
        let hidden = HiddenOverlap { instance_a: ids[0], instance_b: ids[1], depth: 1e-3 };
        self.hidden = if bits.is_multiple_of(5) { vec![hidden] } else { Vec::new() };
        let is_pushed = self.engine.system().wrenches()[2].force.length() == 0.0;
        if is_pushed {
            let state = self.engine.system().states()[2];
            self.engine.set_state(2, State { linear: 1.02 * state.linear, ..state })?;
        }
        Ok(StepReport { converged: report.converged && !bits.is_multiple_of(3), ..report })
    }

    fn contacts(&self) -> &[Contact] {
        self.engine.contacts()
    }

    fn hidden(&self) -> &[HiddenOverlap] {
        &self.hidden
    }
}

fn kinds(warnings: &[Warning]) -> Vec<WarningKind> {
    let mut kinds: Vec<WarningKind> = warnings.iter().map(|warning| warning.kind).collect();
    kinds.dedup();
    kinds
}

/// Runs a scene with a journal from its beginning or from an interrupted run to the step `until`.
fn run(
    loaded: &LoadedScene,
    destination: &Destination,
    cut: Option<&InterruptedRun>,
    until: u64,
) -> Option<(RunRecord, Vec<Warning>)> {
    let mut system = loaded.system().unwrap();
    let origin = RunOrigin::of(&system, "cpu").unwrap();
    let run = match cut {
        Some(cut) => {
            cut.run.restore(&mut system).unwrap();
            cut.run.clone()
        }
        None => PartialRun::new(&loaded.scene, &system, String::new()),
    };
    let mut journal = cut.map(|cut| RunJournal::resume(destination, cut).unwrap().unwrap());
    let mut engine = Wrong::new(loaded, system);
    let ended = simulate_from(&loaded.scene, &mut engine, run, |moment| {
        let journal = journal
            .get_or_insert_with(|| RunJournal::begin(destination, moment.record, &origin).unwrap().unwrap());
        journal.push(moment.record, &moment.report).unwrap();
        if moment.step == until { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    });
    let (record, summary) = ended.ok()?;
    assert_eq!(record.warnings(), summary.warnings);
    Some((record, summary.warnings))
}

fn journal() -> (tempfile::TempDir, Destination) {
    let folder = tempfile::tempdir().unwrap();
    let destination = Destination::new(folder.path().join("run"), &SaveOptions::default()).unwrap();
    (folder, destination)
}

#[test]
fn a_record_has_the_warnings_of_its_run_at_any_cut() {
    let (folder, destination) = journal();
    let path = folder.path().join("run");
    let mut seen = Vec::new();
    for text in [SCENE.to_string(), without_drives()] {
        let loaded = load(&text);
        let (whole, warnings) = run(&loaded, &destination, None, u64::MAX).unwrap();
        let journaled = fs::read(&path).unwrap();
        seen.extend(kinds(&warnings));
        let read = RunRecord::from_bytes(&whole.to_bytes().unwrap()).unwrap();
        assert_eq!((&read, read.warnings()), (&whole, warnings.clone()));
        for warning in &warnings {
            assert!((0.0..=0.2).contains(&warning.time) && warning.count > 0, "{warning:?}");
        }
        for at in [1, 12, 13, 30, 39, 40] {
            run(&loaded, &destination, None, at);
            let cut = InterruptedRun::open(&path).unwrap();
            // The warnings so far are a run's that ends here, without overlaps at its end.
            let so_far = cut.run.record.warnings();
            assert!(!kinds(&so_far).contains(&WarningKind::Overlap), "{at}");
            let (resumed, found) = run(&loaded, &destination, Some(&cut), u64::MAX).unwrap();
            assert_eq!(found, warnings, "{at}");
            assert!(resumed.to_bytes().unwrap() == whole.to_bytes().unwrap(), "cut at {at}: other bytes");
            // Wall times are in the journal, too, but in fields of fixed size.
            assert_eq!(fs::read(&path).unwrap().len(), journaled.len(), "cut at {at}");
        }
    }
    for kind in [
        WarningKind::Hidden,
        WarningKind::Overlap,
        WarningKind::Joint,
        WarningKind::Energy,
        WarningKind::NotConverged,
    ] {
        assert!(seen.contains(&kind), "no {kind:?}: the scenes test nothing of it");
    }
}

/// A kill leaves a prefix of the journal, whose warnings are those after its last whole step.
#[test]
fn a_cut_journal_has_the_warnings_of_its_last_whole_step() {
    let (folder, destination) = journal();
    let loaded = load(&without_drives());
    let mut system = loaded.system().unwrap();
    let origin = RunOrigin::of(&system, "cpu").unwrap();
    let run = PartialRun::new(&loaded.scene, &system, String::new());
    let mut run = Run::new(&loaded.scene, &system, run).unwrap();
    let mut journal = RunJournal::begin(&destination, run.record(), &origin).unwrap().unwrap();
    let (mut engine, mut expected) = (Wrong::new(&loaded, system.clone()), vec![Vec::new()]);
    while !run.is_complete() {
        let moment = run.step(&mut engine).unwrap();
        journal.push(moment.record, &moment.report).unwrap();
        expected.push(moment.record.warnings());
    }
    assert!(expected.iter().any(|warnings| warnings.len() > 2));
    let bytes = fs::read(folder.path().join("run")).unwrap();
    for end in (0..bytes.len()).step_by(41) {
        if let Ok(found) = RunRecord::from_bytes(&bytes[..end]) {
            assert_eq!(found.warnings(), expected[found.steps() as usize], "{end} bytes");
        }
    }
    // A warning at the end is measured once for the same states, and anew for others.
    system.set_states(engine.system().states().to_vec()).unwrap();
    let overlap = |system: &System| {
        run.summary(system).warnings.into_iter().find(|warning| warning.kind == WarningKind::Overlap)
    };
    let found = overlap(&system).unwrap();
    assert_eq!(overlap(&system).as_ref(), Some(&found));
    let mut state = system.states()[3];
    state.pose.translation.z += 1.0;
    system.set_state(3, state).unwrap();
    assert_eq!(overlap(&system), None);
    assert_eq!(run.clone().into_record(engine.system()).warnings(), run.summary(engine.system()).warnings);
}

/// The bytes of a complete run with these warnings as text.
fn bytes_with(bytes: &[u8], warnings: &str) -> Vec<u8> {
    let length = u64::from_le_bytes(bytes[..8].try_into().unwrap()) as usize;
    let mut header: Value = serde_json::from_slice(&bytes[8..8 + length]).unwrap();
    let about = &mut header["__metadata__"]["tesdf_run"];
    *about = about.as_str().unwrap().replacen('{', &format!("{{\"warnings\":{warnings},"), 1).into();
    let header = header.to_string();
    [&(header.len() as u64).to_le_bytes()[..], header.as_bytes(), &bytes[8 + length..]].concat()
}

/// Warnings that no run has, and what the error says of them.
fn bad_warnings() -> Vec<(Value, &'static str)> {
    let joint = json!({
        "kind": "joint", "names": ["u"], "time": 0.1, "value": 1.0, "count": 1, "message": "came apart"
    });
    let with = |key: &str, value: Value| {
        let mut other = joint.clone();
        other[key] = value;
        json!([other])
    };
    vec![
        (json!([joint, joint]), "warnings[1] is a second one of the kind Joint"),
        (with("kind", json!("hidden")), "warnings[0] is of the kind hidden"),
        (with("kind", json!("sunk")), "unknown variant `sunk`"),
        (with("kind", json!("energy")), "warnings[0] of the kind Energy has 1 names; expected 0"),
        (with("names", json!([])), "warnings[0] of the kind Joint has 0 names; expected 1"),
        (with("names", json!("u")), "invalid type: string"),
        (with("count", json!(0)), "the count 0"),
        (with("count", json!(-1)), "invalid value: integer `-1`"),
        (with("time", json!(-0.5)), "the time -0.5"),
        (with("value", json!(-2.5)), "the value -2.5"),
        (with("value", json!(null)), "invalid type: null"),
        (with("depth", json!(1)), "unknown field `depth`"),
        (json!([{ "kind": "joint" }]), "missing field `names`"),
        (json!([3]), "invalid type: integer `3`"),
        (json!({}), "invalid type: map"),
        (
            json!([{
                "kind": "overlap", "names": ["b", "nobody"], "time": 0, "value": 1, "count": 1, "message": ""
            }]),
            "warnings[0] names \"nobody\"; expected bodies of the run",
        ),
    ]
}

#[test]
fn warnings_that_no_run_has_are_refused() {
    let loaded = load(SCENE);
    let bytes = RunRecord::new(&loaded.system().unwrap(), Value::Null).to_bytes().unwrap();
    let good = json!([{
        "kind": "joint", "names": ["u"], "time": 0.1, "value": 1e-300, "count": 2, "message": "came apart"
    }]);
    let read = RunRecord::from_bytes(&bytes_with(&bytes, &good.to_string())).unwrap();
    assert_eq!((read.warnings()[0].value, read.warnings()[0].count), (1e-300, 2));
    for (warnings, expected) in bad_warnings() {
        let damaged = bytes_with(&bytes, &warnings.to_string());
        let text = RunRecord::from_bytes(&damaged).unwrap_err().to_string();
        assert!(text.starts_with("not a run of tesdf: tesdf_run: ") && text.contains(expected), "{text}");
    }
    // A number that is too large for its type.
    let huge =
        bytes_with(&bytes, r#"[{"kind":"energy","names":[],"time":0,"value":1e999,"count":1,"message":""}]"#);
    let text = RunRecord::from_bytes(&huge).unwrap_err().to_string();
    assert!(text.starts_with("not a run of tesdf: tesdf_run: number out of range"), "{text}");
}

/// The frames of a journal.
fn frames(bytes: &[u8]) -> Vec<Vec<u8>> {
    let (mut frames, mut rest) = (Vec::new(), &bytes[12..]);
    while !rest.is_empty() {
        let length = u64::from_le_bytes(rest[..8].try_into().unwrap()) as usize;
        frames.push(rest[24..24 + length].to_vec());
        rest = &rest[24 + length..];
    }
    frames
}

/// A journal of these frames, with right checksums.
fn journal_of(frames: &[Vec<u8>]) -> Vec<u8> {
    let mut bytes = [&b"tesdfrun"[..], &RUN_VERSION_WITHOUT_TORQUES.to_le_bytes()].concat();
    for (number, payload) in (0u64..).zip(frames) {
        let mut hasher = blake3::Hasher::new();
        hasher.update(&number.to_le_bytes()).update(payload);
        bytes.extend((payload.len() as u64).to_le_bytes());
        bytes.extend(&hasher.finalize().as_bytes()[..16]);
        bytes.extend(payload);
    }
    bytes
}

/// Frames whose checksums are right are read, or refused with their number.
#[test]
fn frames_with_other_contents_are_read_or_refused() {
    /// Offset of the length of the warnings in the head of a state.
    const LENGTH: usize = 64;
    let (folder, destination) = journal();
    run(&load(&without_drives()), &destination, None, 14);
    let bytes = fs::read(folder.path().join("run")).unwrap();
    let frames = frames(&bytes);
    assert!(journal_of(&frames) == bytes);
    let length = |frame: &[u8]| u64::from_le_bytes(frame[LENGTH..LENGTH + 8].try_into().unwrap()) as usize;
    let told = frames.iter().skip(1).rposition(|frame| length(frame) > 0).unwrap() + 1;
    // Other warnings in a frame.
    for (warnings, expected) in bad_warnings() {
        let (mut other, text) = (frames.clone(), warnings.to_string());
        let own = other[told].len() - length(&other[told]);
        other[told].truncate(own);
        other[told].extend(text.as_bytes());
        other[told][LENGTH..LENGTH + 8].copy_from_slice(&(text.len() as u64).to_le_bytes());
        let found = RunRecord::from_bytes(&journal_of(&other)).unwrap_err().to_string();
        let begin = format!("not a run of tesdf: frame {told} has warnings: ");
        assert!(found.starts_with(&begin) && found.contains(expected), "{found}");
    }
    // Other bytes anywhere in the head and the warnings.
    let mut refused = 0;
    for at in (0..LENGTH + 32).chain(frames[told].len() - length(&frames[told])..frames[told].len()) {
        for bit in [0x01, 0x20, 0x80] {
            let mut other = frames.clone();
            other[told][at] ^= bit;
            match RunRecord::from_bytes(&journal_of(&other)) {
                Ok(read) => drop(read.warnings()),
                Err(RecordError::NotARun(reason)) => {
                    refused += 1;
                    assert!(reason.starts_with(&format!("frame {told} ")), "{reason}");
                }
                Err(other) => panic!("{other}"),
            }
        }
    }
    assert!(refused > 50, "{refused}");
}
