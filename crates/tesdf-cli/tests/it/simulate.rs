//! `tesdf simulate`

use crate::folder::{DROP, Folder};
use tesdf_sim::RunRecord;

/// The ball has no thread, so it cannot meet this criterion.
const SCREW: &str = r#"
[criterion.screw]
body = "ball"
axis = [0, 0, -1]
pitch = 0.002
min_turns = 0.1
backlash = 1e-5
"#;

#[test]
fn a_run_is_written_and_summarised() {
    let folder = Folder::new();
    folder.write("drop.toml", DROP);
    let text = folder.good(&["simulate", "drop.toml", "-o", "run.safetensors"]);
    assert!(text.contains("10 steps") && text.contains("penetration"), "{text}");
    let record = RunRecord::open(folder.path("run.safetensors")).unwrap();
    assert_eq!((record.bodies.as_slice(), record.times().len()), (&["floor".into(), "ball".into()][..], 11));

    let more = ["--time-step", "1e-3", "--duration", "0.005", "--mode", "node", "--json"];
    let json = folder.good(&[&["simulate", "drop.toml", "-o", "run.safetensors"], &more[..]].concat());
    let json: serde_json::Value = serde_json::from_str(&json).unwrap();
    assert_eq!((&json["steps"], &json["seconds"], &json["passed"]), (&5.into(), &0.005.into(), &().into()));
    let record = RunRecord::open(folder.path("run.safetensors")).unwrap();
    assert_eq!(
        (&record.scene["time_step"], &record.scene["detector"]["mode"]),
        (&1e-3.into(), &"node".into())
    );
}

#[test]
fn warnings_are_told_and_with_strict_exit_with_1() {
    let folder = Folder::new();
    let box_of_1_cm =
        DROP.replace("sphere = { radius = 0.01 }", "box = { half_extents = [0.01, 0.01, 0.01] }");
    // Its lower side is 15 mm above the plane, too low for the box.
    let ceiling = "[[bodies]]\nname = \"ceiling\"\nshape = { box = { half_extents = [0.1, 0.1, 0.02] } }\n\
                   fixed = true\ntranslation = [0, 0, 0.035]\n";
    folder.write("drop.toml", box_of_1_cm + ceiling);
    let arguments = ["simulate", "drop.toml", "-o", "run", "--json", "--duration", "0.1"];
    let (code, out, err) = folder.tesdf(&arguments);
    let json: serde_json::Value = serde_json::from_str(&out).unwrap();
    let warning = &json["warnings"][0];
    assert_eq!((code, &warning["kind"]), (Some(0), &"overlap".into()), "{json}");
    assert!(warning["value"].as_f64().is_some_and(|depth| depth > 1e-3), "{json}");
    assert!(err.contains(warning["message"].as_str().unwrap()), "{err}");
    let (code, ..) = folder.tesdf(&[&arguments[..], &["--strict"]].concat());
    assert_eq!(code, Some(1));
}

#[test]
fn an_unmet_criterion_exits_with_1() {
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

/// Two equal boxes, one above the other. No vertex of either is ever inside the other.
const TWINS: &str = r#"
time_step = 2e-3
duration = 0.2

[detector]
mode = "node"
contact_distance = 1e-6

[[bodies]]
name = "below"
shape = { box = { half_extents = [0.01, 0.01, 0.01] } }
fixed = true

[[bodies]]
name = "above"
shape = { box = { half_extents = [0.01, 0.01, 0.01] } }
mass = 0.1
translation = [0, 0, 0.016]
"#;

#[test]
fn a_hidden_overlap_is_reported_and_meets_no_criterion() {
    let folder = Folder::new();
    folder.write("twins.toml", TWINS);
    let (code, out, err) = folder.tesdf(&["simulate", "twins.toml", "-o", "run", "--json"]);
    assert_eq!(code, Some(0), "{out}{err}");
    let json: serde_json::Value = serde_json::from_str(&out).unwrap();
    let pair = &json["hidden"][0];
    assert_eq!((&pair["bodies"][0], &pair["bodies"][1]), (&"below".into(), &"above".into()), "{json}");
    assert_eq!(pair["first_step"], 0);
    let depth = pair["depth"].as_f64().unwrap();
    assert!(depth > 2e-3 && json["deepest_penetration"].as_f64().unwrap() >= depth, "{json}");
    assert!(err.contains("bodies below and above overlapped by") && err.contains("--mode face"), "{err}");
    assert!(
        err.contains("of `below` touches `above`") && err.contains("use mode = \"exact\" under"),
        "{err}"
    );
    // The record has it as well.
    let record = RunRecord::open(folder.path("run")).unwrap();
    assert_eq!(serde_json::to_value(record.hidden_pairs()).unwrap(), json["hidden"]);
    let warnings = serde_json::to_value(record.warnings()).unwrap();
    assert_eq!(warnings, json["warnings"]);
    assert!(warnings.as_array().unwrap().iter().any(|warning| warning["kind"] == "hidden"), "{warnings}");
    let (code, _, err) = folder.tesdf(&["view", "run", "--contacts", "0", "-o", "page.html"]);
    let page = std::fs::read_to_string(folder.path("page.html")).unwrap();
    for warning in warnings.as_array().unwrap() {
        let (line, text) = (warning["message"].as_str().unwrap(), warning["message"].to_string());
        assert!(code == Some(0) && err.contains(&format!("warning: run: {line}\n")), "{err}");
        assert!(page.contains(&text), "{text}");
    }

    folder.write("judged.toml", TWINS.to_string() + &SCREW.replace("ball", "above"));
    let (code, out, err) = folder.tesdf(&["simulate", "judged.toml", "-o", "run"]);
    assert_eq!(code, Some(1), "{out}{err}");
    assert!(out.contains("bodies below and above overlapped by"), "{out}");

    let shown = folder.good(&["simulate", "twins.toml", "-o", "run", "--mode", "face", "--json"]);
    let json: serde_json::Value = serde_json::from_str(&shown).unwrap();
    assert_eq!(json["hidden"], serde_json::json!([]), "faces show it");
}
