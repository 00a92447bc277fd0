//! `tesdf-lab simulate`: scenes whose criteria the house does not have.
use serde_json::Value;
use tesdf_sim::RunRecord;

use crate::folder::{Folder, data};
use crate::support::path_of;

/// A platform that one link holds, as far as the criterion goes.
fn hoist(folder: &Folder) {
    let body = |name: &str, more: &str| {
        format!("[[bodies]]\nname = \"{name}\"\nshape = {{ sphere = {{ radius = 0.001 }} }}\n{more}\n")
    };
    let joint = |name: &str, kind: &str, parent: &str, child: &str| {
        format!("[[joints]]\nname = \"{name}\"\nkind = \"{kind}\"\n{parent}child = \"{child}\"\n")
    };
    let scene = [
        "time_step = 0.005\nduration = 0.1\n".into(),
        "[criterion.hoist]\nbody = \"platform\"\nchains = [{ spool = \"spool\", links = \"a\" }]\n".into(),
        "link = { straight = 0.02, bend_radius = 0.007, pitch = 0.029 }\nwinding_radius = 0.06\n".into(),
        "min_rise = 0.1\nrise_tolerance = 1e-3\nmax_tilt = 0.1\nmax_penetration = 1e-5\n".into(),
        "check_every = 0.05\n".into(),
        body("drum", "mass = 1"),
        body("a0", "mass = 1\ntranslation = [0.1, 0, 0]"),
        body("a1", "mass = 1\ntranslation = [0.2, 0, 0]"),
        body("platform", "mass = 1\ntranslation = [0.3, 0, 0]"),
        joint("spool", "hinge", "", "drum"),
        joint("first", "weld", "parent = \"drum\"\n", "a0"),
        joint("last", "weld", "parent = \"a1\"\n", "platform"),
    ];
    folder.write("hoist.toml", scene.concat());
}

#[test]
fn a_run_is_the_one_of_the_house_with_the_criteria_of_the_laboratory() {
    let folder = Folder::new();
    hoist(&folder);
    let (code, out, err) = folder.lab(&["simulate", "hoist.toml", "-o", "run.tesrun", "--json"]);
    assert_eq!(code, Some(1), "the platform falls: {err}");
    let report: Value = serde_json::from_str(&out).unwrap();
    assert_eq!((&report["steps"], &report["passed"]), (&20.into(), &false.into()), "{report:#}");
    let failures = report["hoist"]["failures"].to_string();
    assert!(failures.contains("rise: ") && failures.contains("linking: "), "{failures}");
    assert!(report["rest"].is_null() && report.get("assembly").is_none(), "{report:#}");
    // A run is played without its criteria.
    folder.good(&["collide", "run.tesrun", "--device", "cpu", "--repeat", "1"]);
    let (code, _, err) = folder.lab(&["simulate", "--resume", "run.tesrun"]);
    assert!(code == Some(2) && err.contains("nothing to resume"), "{err}");
}

#[test]
fn a_plan_moves_the_grippers_and_must_fit() {
    let folder = Folder::new();
    let [scene, plan] =
        ["robo-assembly", "robo-assembly-plan"].map(|name| path_of(name).display().to_string());
    let run = ["simulate", &scene, "--duration", "0.05", "-o", "run.tesrun", "--json", "--plan"];
    let (code, out, err) = folder.lab(&[&run[..], &[&plan]].concat());
    assert_eq!(code, Some(1), "nothing is assembled yet: {err}");
    let report: Value = serde_json::from_str(&out).unwrap();
    assert_eq!((&report["steps"], &report["assembly"]["assembled"]), (&10.into(), &0.into()), "{report:#}");
    let record = RunRecord::open(folder.path("run.tesrun")).unwrap();
    let wrist = record.bodies.iter().position(|name| name == "left_wrist").unwrap();
    assert_ne!(record.pose(10, wrist), record.pose(0, wrist));
    let (code, _, err) = folder.lab(&[&run[..], &[&data("MANIFEST.tsv")]].concat());
    assert!(code == Some(2) && err.contains("MANIFEST.tsv: "), "{err}");
    folder.write("plan.toml", std::fs::read_to_string(&plan).unwrap().replace("peg0", "pig"));
    let (code, _, err) = folder.lab(&[&run[..], &["plan.toml"]].concat());
    assert!(
        code == Some(2) && err.starts_with("error: plan.toml: task 1 (pig): there is no body pig"),
        "{err}"
    );
}
