//! The output of `tesdf clearance`, `tesdf toi` and `tesdf collide --why`.

use crate::folder::Folder;
use serde_json::Value;

/// A cube with edges of length 2 and a corner at the origin.
const CUBE: &str = "v 0 0 0\nv 2 0 0\nv 2 2 0\nv 0 2 0\nv 0 0 2\nv 2 0 2\nv 2 2 2\nv 0 2 2\n\
                    f 1 4 3 2\nf 5 6 7 8\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n";

fn cube() -> Folder {
    let folder = Folder::new();
    folder.write("c.obj", CUBE);
    folder.good(&["encode", "c.obj", "-o", "c.tesdf", "--preset", "fast", "--unit", "mm"]);
    folder
}

fn json(folder: &Folder, args: &[&str]) -> Value {
    serde_json::from_str(&folder.good(args)).unwrap()
}

#[test]
fn clearance_of_two_cubes() {
    let folder = cube();
    let at = |z: &str| {
        let pose = format!("-0.5 0 {z} 0 0 0 1");
        json(&folder, &["clearance", "c.tesdf", "c.tesdf", "--pose-a", &pose, "--json"])
    };
    let apart = at("-3.5");
    assert!((apart["distance"].as_f64().unwrap() - 1.5).abs() < 4e-8, "{apart}");
    assert_eq!((&apart["normal"][2], &apart["converged"]), (&(-1.0).into(), &true.into()));
    assert_eq!((apart["point_a"][2].as_f64(), apart["point_b"][2].as_f64()), (Some(-1.5), Some(0.0)));
    for key in ["face_a", "face_b", "field"] {
        assert!(apart[key].is_u64(), "{key}: {apart}");
    }
    let deep = at("-1.75");
    assert!((deep["distance"].as_f64().unwrap() + 0.25).abs() < 4e-8, "{deep}");
    let lower_bound = deep["lower_bound"].as_f64().unwrap();
    assert!((-4e-8..=0.0).contains(&(lower_bound + 0.25)), "{deep}");
    let text = folder.good(&["clearance", "c.tesdf", "c.tesdf", "--pose-b", "0 0 3 0 0 0 1"]);
    assert!(text.contains("1e0 (apart)"), "{text}");
    let (code, _, error) = folder.tesdf(&["clearance", "c.tesdf", "c.tesdf", "--tolerance", "-1"]);
    assert!(code == Some(2) && error.contains("tolerance is -1"), "{error}");
}

#[test]
fn time_of_impact_of_two_cubes() {
    let folder = cube();
    let toi = |more: &[&str]| {
        let args =
            ["toi", "c.tesdf", "c.tesdf", "--pose-a", "0 0 5 0 0 0 1", "--tolerance", "1e-6", "--json"];
        json(&folder, &[&args[..], more].concat())
    };
    let hit = toi(&["--velocity-a", "0 0 -2 0 0 0", "--velocity-b", "0 0 1 0 0 0", "--end", "2"]);
    let time = hit["time"].as_f64().unwrap();
    assert!(time <= 1.0 && time > 1.0 - 1e-6, "{hit}");
    assert!(hit["distance"].as_f64().unwrap() >= 0.0 && hit["touches"] == true, "{hit}");
    assert_eq!(hit["normal"][2], 1.0);
    assert_eq!(
        (&hit["verdict"], &hit["free_until"], &hit["end"]),
        (&"impact".into(), &hit["time"], &2.0.into())
    );
    // The screw motion moves the body down by 4 per turn, and one turn takes a time of 2π.
    let screwed = toi(&["--screw-a", "1 1 0 0 0 -1 1 4", "--end", "9"]);
    let time = screwed["time"].as_f64().unwrap();
    assert!((time - 0.75 * std::f64::consts::TAU).abs() < 1e-5, "{screwed}");
    let miss = toi(&["--velocity-a", "0 0 -2 0 0 0"]);
    let expected = serde_json::json!({
        "verdict": "free", "time": null, "free_until": 1.0, "end": 1.0, "touches": false, "iterations": 0,
    });
    assert_eq!(miss, expected);
    // Past each other at a gap of 1e-4.
    let past = ["--velocity-a", "20 0 0 0 0 0", "--velocity-b", "0 0 2.9999 0 0 0"];
    let free = toi(&past);
    assert_eq!((&free["verdict"], &free["time"]), (&"free".into(), &Value::Null), "{free}");
    assert!(free["iterations"].as_u64().unwrap() < 20, "{free}");
    let unknown = toi(&[
        "--velocity-a",
        "0 0 -2 0.3 0 0.2",
        "--velocity-b",
        "0 0 1 0 0 0",
        "--end",
        "2",
        "--iterations",
        "1",
    ]);
    assert_eq!((&unknown["verdict"], &unknown["time"]), (&"undecided".into(), &Value::Null), "{unknown}");
    assert_eq!((&unknown["touches"], &unknown["iterations"]), (&false.into(), &1.into()));
    let until = unknown["free_until"].as_f64().unwrap();
    assert!(until > 0.0 && until < 1.0 && unknown["distance"].as_f64().unwrap() > 1e-6, "{unknown}");
    let text = folder.good(&["toi", "c.tesdf", "c.tesdf", "--pose-a", "0 0 5 0 0 0 1"]);
    assert_eq!(text, "no impact up to time 1\n");
    let spin = ["toi", "c.tesdf", "c.tesdf", "--pose-a", "0 0 5 0 0 0 1", "--velocity-a", "0 0 -9 0 1 0"];
    let text = folder.good(&[&spin[..], &["--iterations", "0"]].concat());
    assert!(text.contains("free up to") && text.contains("not known; try a larger --iterations"), "{text}");
    assert!(folder.good(&spin).contains("(they touch)"));
    let both = ["toi", "c.tesdf", "c.tesdf", "--velocity-a", "0 0 0 0 0 0", "--screw-a", "0 0 0 0 0 1 1 1"];
    assert_eq!(folder.tesdf(&both).0, Some(2));
}

#[test]
fn a_hidden_overlap_is_reported() {
    let folder = cube();
    // The cube has edges of length 2. Moved by 0.4, no vertex of either cube is inside the other.
    let shifted = ["collide", "c.tesdf", "c.tesdf", "--pose-b", "0 0 0.4 0 0 0 1"];
    let run = |more: &[&str]| {
        let (code, out, err) = folder.tesdf(&[&shifted[..], more].concat());
        assert_eq!(code, Some(0), "{out}{err}");
        (out, err)
    };
    let warning = "instances 0 and 1 overlap by";
    let (_, err) = run(&["--mode", "node"]);
    assert!(err.contains(warning) && err.contains("use --mode face or --mode exact"), "{err}");
    // Without --report the output stays an array; the object has more.
    let (out, err) = run(&["--mode", "node", "--json"]);
    assert!(serde_json::from_str::<serde_json::Value>(&out).unwrap().is_array() && err.contains(warning));
    let (out, _) = run(&["--mode", "node", "--json", "--report"]);
    let report: serde_json::Value = serde_json::from_str(&out).unwrap();
    assert_eq!(
        (&report["hidden"][0]["instance_a"], &report["hidden"][0]["instance_b"]),
        (&0.into(), &1.into())
    );
    assert!(report["hidden"][0]["depth"].as_f64().unwrap() > 0.29, "{report}");
    assert!(report["contacts"].is_array() && report["statistics"]["candidates"].is_number(), "{report}");
    let (_, err) = run(&["--mode", "exact"]);
    assert!(!err.contains(warning), "{err}");
    assert_eq!(folder.tesdf(&[&shifted[..], &["--report"]].concat()).0, Some(2), "a report is JSON");
}

#[test]
fn contacts_per_face_are_the_corners_of_a_cube_on_a_cube() {
    let folder = cube();
    let on_top = ["collide", "c.tesdf", "c.tesdf", "--pose-b", "0 0 2 0 0 0 1", "--json"];
    let found = json(&folder, &[&on_top[..], &["--contacts-per", "face", "--cos-theta", "0.5"]].concat());
    let faces = found.as_array().unwrap();
    for [x, y] in [[0.0, 0.0], [2.0, 0.0], [2.0, 2.0], [0.0, 2.0]] {
        let is_here = |c: &Value| c["point_a"][0] == x && c["point_a"][1] == y;
        assert!(faces.iter().any(is_here), "no contact at {x} {y}: {found}");
    }
    let (_, _, error) = folder.tesdf(&[&on_top[..], &["--mode", "node"]].concat());
    assert!(
        error.contains("of instance 0 touches instance 1") && error.contains("only tests vertices"),
        "{error}"
    );
    assert!(error.contains("hint: use --mode exact --contacts-per face"), "{error}");
    let (code, _, error) = folder.tesdf(&[&on_top[..], &["--contacts-per", "body"]].concat());
    assert!(code == Some(2) && error.contains("expected cell, face or minimum"), "{error}");
    for (mode, option, value, modes) in [
        ("node", "--contacts-per", "face", "`face` and `exact`"),
        ("node", "--tolerance", "1e-3", "`face` and `exact`"),
        ("node", "--cos-theta", "0.5", "`face` and `exact`"),
        ("exact", "--iterations", "16", "`face`"),
    ] {
        let (code, _, error) = folder.tesdf(&[&on_top[..], &["--mode", mode, option, value]].concat());
        let expected = format!("has no effect in the mode `{mode}`, only in {modes}");
        assert!(code == Some(2) && error.contains(&expected), "{error}");
    }
}

#[test]
fn a_reduction_prints_its_wrench_error() {
    let folder = cube();
    let few = ["collide", "c.tesdf", "c.tesdf", "--pose-b", "0 0 2 0 0 0 1", "--reduce", "3"];
    let report = json(&folder, &[&few[..], &["--json", "--report"]].concat());
    let error = report["reductions"][0]["wrench_error"].as_f64().unwrap();
    assert!(error > 0.0, "{report}");
    let text = folder.good(&few);
    assert!(text.contains(&format!("wrench error {error:.3e} of 3 kept of")), "{text}");
    assert!(!folder.good(&few[..5]).contains("wrench error"));
}

#[test]
fn few_contacts_are_found_without_the_others() {
    let folder = cube();
    let all = ["collide", "c.tesdf", "c.tesdf", "--pose-b", "0.1 0.2 1.9 0.1 0 0 0.99498743710662", "--json"];
    let report = json(&folder, &[&all[..], &["--spread", "3", "--report"]].concat());
    assert!((1..=3).contains(&report["contacts"].as_array().unwrap().len()), "{report}");
    assert!(report["reductions"][0]["left_out_above"].as_f64().is_some(), "{report}");
    let text = folder.good(&[&all[..5], &["--spread", "3"]].concat());
    assert!(text.contains("contacts kept; no other contact is below"), "{text}");
    let (code, _, error) = folder.tesdf(&[&all[..5], &["--spread", "3", "--reduce", "3"]].concat());
    assert!(code == Some(2) && error.contains("cannot be used with"), "{error}");
    let (code, _, error) = folder.tesdf(&[&all[..5], &["--spread", "0"]].concat());
    assert!(code != Some(0) && error.contains("at least 1"), "{error}");
}

#[test]
fn why_explains_found_and_missing_contacts() {
    let folder = cube();
    let why = |more: &[&str]| {
        let args = ["collide", "c.tesdf", "c.tesdf", "--pose-b", "0.5 0.25 1.75 0 0 0 1", "--json"];
        json(&folder, &[&args[..], more].concat())
    };
    let contacts = why(&[]);
    let reports = why(&["--why"]);
    // Faces that share a vertex share a contact there.
    let mut points = Vec::new();
    for report in reports.as_array().unwrap() {
        for polygon in
            report["parts"].as_array().unwrap().iter().flat_map(|p| p["polygons"].as_array().unwrap())
        {
            if polygon["verdict"] == "contact" {
                points.push((report["instance_a"].to_string(), polygon["point"].to_string()));
            }
        }
    }
    points.sort();
    points.dedup();
    assert_eq!(points.len(), contacts.as_array().unwrap().len());
    assert_eq!((&reports[0]["pair"], &reports[1]["instance_a"]), (&"tested".into(), &1.into()));
    // Face 0 is in the bottom of the cube. The one of A is far from B, the one of B is inside A.
    let far = why(&["--why", "0"]);
    assert_eq!(far.as_array().unwrap().len(), 1);
    let part = &far[0]["parts"][0];
    let bound = part["broad"]["pruned_by_tree"].get("bound").or(part["broad"]["pruned_by_ball"].get("bound"));
    assert!(part["broad"] == "candidate" || bound.is_some_and(|b| b.as_f64() > Some(0.0)), "{part}");
    assert!(part["polygons"].as_array().unwrap().iter().all(|p| p["verdict"] != "contact"), "{part}");
    let deep = why(&["--why", "1:0"]);
    assert_eq!((&deep[0]["instance_a"], &deep[0]["parts"][0]["broad"]), (&1.into(), &"candidate".into()));
    // The contacts that the cosine filter drops.
    let filtered = why(&["--why", "--cos-theta", "1"]);
    let text = filtered.to_string();
    assert!(text.contains("filtered") && text.contains("cosine"), "{text}");
    let apart = ["collide", "c.tesdf", "c.tesdf", "--pose-b", "0 0 9 0 0 0 1", "--why"];
    let text = folder.good(&apart);
    assert!(text.contains("not tested: bounds are 7e0 apart"), "{text}");
    let (code, _, error) = folder.tesdf(&[&apart[..], &["1:99"]].concat());
    assert!(code == Some(2) && error.contains("face is 99 (of 12)"), "{error}");
}

#[test]
fn why_prints_the_verdict_of_each_stage() {
    let folder = cube();
    let (above, turned) = ("0.5 0.25 1.875 0 0 0 1", "0.5 0.25 1.8 0.36 0.48 0 0.8");
    let cases: [(&str, &[&str], &[&str]); 4] = [
        (
            above,
            &["--mode", "node"],
            &[
                "nodes of instance 0 in the field of instance 1",
                "pair: tested; contact distance 0e0",
                "broad phase: 8 candidates of 8 nodes",
                "candidate; smallest signed distance -1.25e-1; 1 contact of 1 polygon",
                "1 corner: -1.25e-1 at (2.000000e0 2.000000e0 2.000000e0), contact",
                "no cell, 1 corner: 2.5e-1 at (2.000000e0 0.000000e0 2.000000e0), dropped: its cell is beyond",
            ],
        ),
        (
            above,
            &[],
            &[
                "faces of instance 1 in the field of instance 0",
                "at (2.500000e0 2.500000e-1 1.875000e0), dropped: beyond the contact distance",
                "and 2 more; --json prints all",
            ],
        ),
        (above, &["--cos-theta", "1"], &["dropped by the cosine filter: 0.0000", "; 0 contacts of "]),
        (turned, &["--contacts-per", "minimum"], &["dropped: the surface is lower beside it"]),
    ];
    for (pose, more, expected) in cases {
        let text =
            folder.good(&[&["collide", "c.tesdf", "c.tesdf", "--pose-b", pose, "--why"], more].concat());
        for part in expected {
            assert!(text.contains(part), "{more:?}: expected {part} in {text}");
        }
    }
}
