//! `tesdf simulate`
mod folder;

use folder::Folder;
use tesdf_sim::RunRecord;

const DROP: &str = r#"
time_step = 2e-3
duration = 0.02

[[bodies]]
name = "floor"
shape = "plane"
fixed = true

[[bodies]]
name = "ball"
shape = { sphere = { radius = 0.01 } }
density = 1000
translation = [0, 0, 0.011]
"#;

/// A ball cannot turn down a thread that is not there.
const SCREW: &str = r#"
[criterion.screw]
body = "ball"
axis = [0, 0, -1]
pitch = 0.002
min_turns = 0.1
backlash = 1e-5
"#;

#[test]
fn a_run_is_written_and_summed_up() {
    let folder = Folder::new();
    folder.write("drop.toml", DROP);
    let text = folder.good(&["simulate", "drop.toml", "-o", "run.safetensors"]);
    assert!(text.contains("10 steps") && text.contains("penetration"), "{text}");
    let record = RunRecord::open(&folder.path("run.safetensors")).unwrap();
    assert_eq!((record.bodies.as_slice(), record.times().len()), (&["floor".into(), "ball".into()][..], 11));

    let more = ["--time-step", "1e-3", "--duration", "0.005", "--mode", "node", "--json"];
    let json = folder.good(&[&["simulate", "drop.toml", "-o", "run.safetensors"], &more[..]].concat());
    let json: serde_json::Value = serde_json::from_str(&json).unwrap();
    assert_eq!((&json["steps"], &json["seconds"], &json["passed"]), (&5.into(), &0.005.into(), &().into()));
    let record = RunRecord::open(&folder.path("run.safetensors")).unwrap();
    assert_eq!(
        (&record.scene["time_step"], &record.scene["detector"]["mode"]),
        (&1e-3.into(), &"node".into())
    );
}

#[test]
fn a_criterion_that_does_not_hold_is_not_good() {
    let folder = Folder::new();
    folder.write("drop.toml", DROP.to_string() + SCREW);
    let (code, out, err) = folder.tesdf(&["simulate", "drop.toml", "-o", "run", "--mode", "off"]);
    assert_eq!(code, Some(1), "{out}{err}");
    assert!(out.contains("not passed") && out.contains("expected at least 0.1"), "{out}");
    assert_eq!(folder.names(), ["drop.toml", "run"]);
}

#[test]
fn errors_leave_no_file() {
    let folder = Folder::new();
    folder.write("drop.toml", DROP.replace("radius = 0.01", "radios = 0.01"));
    folder.write("good.toml", DROP);
    for (args, expected) in [
        (&["simulate", "drop.toml", "-o", "run"][..], vec!["drop.toml", "line 12", "radios"]),
        (&["simulate", "none.toml", "-o", "run"], vec!["cannot read none.toml"]),
        (&["simulate", "good.toml", "-o", "no/run"], vec!["there is no folder no"]),
        (&["simulate", "good.toml", "-o", "good.toml"], vec!["is the input good.toml itself"]),
        (&["simulate", "good.toml", "-o", "run", "--geometry", "cone=a.obj"], vec!["there is no body cone"]),
        (
            &["simulate", "good.toml", "-o", "run", "--geometry", "ball=a.obj"],
            vec!["line 10, body ball", "a.obj"],
        ),
        (&["simulate", "good.toml", "-o", "run", "--time-step", "0"], vec!["time_step", "above 0"]),
    ] {
        let (code, out, err) = folder.tesdf(args);
        assert_eq!((code, out.as_str()), (Some(2), ""), "{args:?}: {err}");
        expected.iter().for_each(|part| assert!(err.contains(part), "{args:?}: no {part:?} in {err}"));
    }
    assert_eq!(folder.names(), ["drop.toml", "good.toml"]);
}
