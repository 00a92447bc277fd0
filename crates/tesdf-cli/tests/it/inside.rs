//! What is inside, on the command line.

use crate::folder::Folder;

/// A cube with edges of length 2 and a corner at the origin, without its upper side.
const OPEN: &str = "v 0 0 0\nv 2 0 0\nv 2 2 0\nv 0 2 0\nv 0 0 2\nv 2 0 2\nv 2 2 2\nv 0 2 2\n\
                    f 1 4 3 2\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n";

fn open() -> Folder {
    let folder = Folder::new();
    folder.write("open.obj", OPEN);
    folder.write("points.csv", "x,y,z\n1,1,0.25\n1,1,3\n");
    folder
}

fn distances(folder: &Folder, asset: &str) -> Vec<f64> {
    let csv = folder.good(&["query", asset, "--points", "points.csv"]);
    let header: Vec<&str> = csv.lines().next().expect("a header").split(',').collect();
    let at = header.iter().position(|name| *name == "signed_distance").expect("a column");
    let distance = |line: &str| line.split(',').nth(at).expect("a field").parse().expect("a number");
    csv.lines().skip(1).map(distance).collect()
}

#[test]
fn an_open_mesh_is_encoded_under_the_rules_that_its_refusal_names() {
    let folder = open();
    let (code, _, err) = folder.tesdf(&["encode", "open.obj", "-o", "a.tesdf"]);
    assert_ne!(code, Some(0));
    assert!(err.contains("--inside generalized") && err.contains("--inside sheet --thickness 0.03"), "{err}");

    folder.good(&["encode", "open.obj", "-o", "a.tesdf", "--inside", "generalized"]);
    let found = distances(&folder, "a.tesdf");
    assert!((found[0] + 0.25).abs() < 1e-12 && (found[1] - 2f64.sqrt()).abs() < 1e-12, "{found:?}");
    let out = folder.good(&["inspect", "a.tesdf"]);
    assert!(out.contains("generalised winding number") && out.contains("holes of the mesh"), "{out}");
    let json = folder.good(&["inspect", "a.tesdf", "--json"]);
    let json: serde_json::Value = serde_json::from_str(&json).unwrap();
    assert_eq!(json["certificate"]["inside"]["rule"], "generalized");
    assert_eq!((&json["certificate"]["jumps"], &json["format_version"]), (&true.into(), &2.into()));
    folder.good(&["verify", "a.tesdf", "--samples", "500", "--prove"]);

    folder.good(&["encode", "open.obj", "-o", "b.tesdf", "--inside", "sheet", "--thickness", "0.1"]);
    let found = distances(&folder, "b.tesdf");
    assert!((found[0] - 0.2).abs() < 1e-12 && (found[1] - 2f64.sqrt() + 0.05).abs() < 1e-12, "{found:?}");
    folder.good(&["verify", "b.tesdf", "--samples", "500", "--prove"]);
}

#[test]
fn options_that_exclude_each_other_are_named() {
    let folder = open();
    for (options, says) in [
        (&["--inside", "sheet"][..], "needs its thickness"),
        (&["--thickness", "1"], "only the faces of a sheet"),
        (&["--inside", "sheet", "--thickness", "1", "--surface", "boundary"], "has no faces between"),
        (&["--inside", "generalized", "--surface", "boundary"], "surface is boundary"),
        (&["--inside", "odd"], "open"),
    ] {
        let (code, _, err) = folder.tesdf(&[&["encode", "open.obj", "-o", "a.tesdf"], options].concat());
        assert!(code != Some(0) && err.contains(says), "{options:?}: {err}");
    }
}

#[test]
fn detection_takes_an_open_mesh_and_a_sheet() {
    let folder = open();
    folder.good(&["encode", "open.obj", "-o", "a.tesdf", "--inside", "generalized"]);
    folder.good(&["encode", "open.obj", "-o", "b.tesdf", "--inside", "sheet", "--thickness", "0.1"]);
    let collide = ["--pose-b", "0 0 -3 0 0 0 1", "--contact-distance", "2"];
    for (first, expected) in [("a.tesdf", 0.95), ("b.tesdf", 0.9)] {
        let out = folder.good(&[&["collide", first, "b.tesdf", "--json"], &collide[..]].concat());
        let json: serde_json::Value = serde_json::from_str(&out).unwrap();
        let contacts = json.as_array().expect("contacts");
        let least = contacts.iter().map(|c| c["distance"].as_f64().unwrap()).fold(f64::INFINITY, f64::min);
        assert!((least - expected).abs() < 1e-6, "{first}: {least}");
    }
}
