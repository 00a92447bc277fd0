//! The binary treats every file of `bad/` as `bad/expected.tsv` says.

use std::collections::BTreeMap;

use crate::folder::{Folder, data};

/// Texts that the message of `encode` must contain, for each file that is refused or must be
/// repaired first.
const NAMED: [(&str, &[&str]); 34] = [
    ("open_holes.obj", &["edge ", "is open: only face "]),
    ("open_half.obj", &["edge ", "is open: only face "]),
    ("duplicate_face_reversed.obj", &["(10, ", "320)", "3 faces"]),
    ("t_junction_gap.obj", &["edge 4-6 is open"]),
    ("internal_fin.obj", &["0-7 is open", "12", "3 faces"]),
    ("nan_vertex.obj", &["line 5", "vertex 5", "y = NaN"]),
    ("inf_vertex.obj", &["line 5", "vertex 5", "y = inf"]),
    ("huge_1e200.obj", &["vertex 1", "1e200", "out of range"]),
    ("denormal_1e-310.obj", &["vertex 1", "1e-310", "out of range"]),
    ("index_out_of_range.obj", &["line 20", "face 11", "vertex 9", "8 vertices"]),
    ("index_zero.obj", &["line 20", "face 11", "vertex 0"]),
    ("index_negative_bad.obj", &["line 20", "-9", "8 vertices"]),
    ("short_face.obj", &["line 21", "2 corners"]),
    ("garbage_number.obj", &["line 2", "is not a number"]),
    ("zero_faces.obj", &["no face"]),
    ("empty.obj", &["empty"]),
    ("empty.stl", &["empty"]),
    ("stl_count_too_big.stl", &["1000", "12", "byte 80"]),
    ("stl_count_4g.stl", &["4294967295", "12", "byte 80"]),
    ("stl_count_too_small.stl", &["7", "12", "byte 80"]),
    ("stl_truncated.stl", &["12", "11", "17 bytes"]),
    ("stl_ascii_commas.stl", &["line 2", "comma"]),
    ("stl_ascii_truncated.stl", &["line 58", "facet 8"]),
    ("ply_truncated.ply", &["byte 52", "face 10"]),
    ("ply_index_out_of_range.ply", &["face 5", "vertex 77", "8 vertices"]),
    ("png_named.stl", &["PNG"]),
    ("png_named.obj", &["PNG"]),
    ("flipped_all.obj", &["inside out", "tesdf repair"]),
    ("mixed_winding.obj", &["faces 0, 3", "same direction", "tesdf repair"]),
    ("duplicate_faces.obj", &["320", "tesdf repair"]),
    ("soup_jitter.obj", &["--weld-tolerance", "tesdf repair"]),
    ("t_junction.obj", &["vertex 8", "4-6", "tesdf repair"]),
    // These files are accepted as they are: their winding number is an integer of at least 0
    // everywhere.
    ("zero_area_repeated_index.obj", &["face 12", "face 13"]),
    ("nan_unused_vertex.obj", &["vertex 9", "line 9"]),
];
/// Files that are marked `repair` but are encoded as they are, with a warning.
const WELL_DEFINED: [&str; 3] =
    ["zero_area_repeated_index.obj", "cavity_inverted.obj", "nan_unused_vertex.obj"];

fn expected() -> Vec<[String; 2]> {
    let table = std::fs::read_to_string(data("bad/expected.tsv")).unwrap();
    let rows = table.lines().skip(1).map(|line| {
        let mut fields = line.split('\t').map(String::from);
        [fields.next().unwrap(), fields.next().unwrap()]
    });
    rows.collect()
}

fn named(file: &str, text: &str) {
    let names: BTreeMap<_, _> = NAMED.into_iter().collect();
    for part in names.get(file).copied().unwrap_or_default() {
        assert!(text.contains(part), "{file}: no {part:?} in: {text}");
    }
}

#[test]
fn the_test_knows_every_row_of_the_table() {
    let rows = expected();
    assert_eq!(rows.len(), std::fs::read_dir(data("bad")).unwrap().count() - 1, "a file without a row");
    for (file, _) in NAMED {
        assert!(rows.iter().any(|[name, _]| name == file), "{file}");
    }
    for [file, expect] in &rows {
        let known = NAMED.iter().any(|(name, _)| name == file);
        assert!(known || expect != "reject", "{file} is refused; what must the message name?");
    }
}

#[test]
fn each_bad_file_is_encoded_or_refused_as_the_table_says() {
    for [file, expect] in expected() {
        let folder = Folder::new();
        let (code, out, err) =
            folder.tesdf(&["encode", &data(&format!("bad/{file}")), "-o", "f.tesdf", "--json"]);
        named(&file, &err);
        let accepted = match expect.as_str() {
            "accept" | "accept+note" => true,
            "repair" => WELL_DEFINED.contains(&file.as_str()),
            "reject" => false,
            other => panic!("{file}: the table says {other}"),
        };
        if accepted {
            assert_eq!((code, folder.names()), (Some(0), vec!["f.tesdf".to_string()]), "{file}: {err}");
            let json: serde_json::Value = serde_json::from_str(&out).unwrap();
            assert_eq!(json["source"]["name"], file.as_str());
            let warned = err.lines().any(|line| line.starts_with("warning: "));
            assert_eq!(warned, expect != "accept", "{file}: {err}");
            let verified = folder.good(&["inspect", "f.tesdf"]);
            assert!(verified.contains(&file), "{verified}");
        } else {
            assert_eq!((code, out.as_str()), (Some(2), ""), "{file}: {err}");
            assert!(err.starts_with("error: ") && err.contains(&file), "{file}: {err}");
            assert_eq!(folder.names(), Vec::<String>::new(), "{file}");
        }
    }
}

#[test]
fn each_file_marked_for_repair_is_repaired() {
    for [file, expect] in expected() {
        if expect != "repair" {
            continue;
        }
        let folder = Folder::new();
        let mesh = data(&format!("bad/{file}"));
        let mut args = vec!["repair", &mesh, "-o", "r.ply"];
        if file == "soup_jitter.obj" {
            let (code, out, err) = folder.tesdf(&args);
            assert_eq!(code, Some(1), "{out}");
            assert!(out.contains("is open") && err.contains("--weld-tolerance"), "{out}{err}");
            args.extend(["--weld-tolerance", "1e-8"]);
        }
        folder.good(&args);
        folder.good(&["encode", "r.ply", "-o", "f.tesdf"]);
        let out = folder.good(&["verify", "f.tesdf", "--samples", "200"]);
        assert!(out.ends_with("passed\n"), "{out}");
    }
}

#[test]
fn each_refused_mesh_stays_refused_after_a_repair_or_is_named_again() {
    for [file, expect] in expected() {
        if expect != "reject" {
            continue;
        }
        let folder = Folder::new();
        let (code, out, err) = folder.tesdf(&["repair", &data(&format!("bad/{file}")), "-o", "r.ply"]);
        assert!(code == Some(1) || code == Some(2), "{file}: {code:?} {out}{err}");
    }
}

#[test]
fn a_cavity_is_outside() {
    let folder = Folder::new();
    folder.write("p.csv", "x,y,z\n0.01,0.01,0.01\n0.0025,0.01,0.01\n");
    for (file, centre) in [("cavity.obj", 0.005), ("cavity_inverted.obj", -0.005)] {
        folder.good(&["encode", &data(&format!("bad/{file}")), "-o", "f.tesdf"]);
        let out = folder.good(&["query", "f.tesdf", "--points", "p.csv"]);
        let distance =
            |row: usize| -> f64 { out.lines().nth(row).unwrap().split(',').nth(3).unwrap().parse().unwrap() };
        assert!((distance(1) - centre).abs() < 1e-17, "{file}: {out}");
        assert!((distance(2) + 0.0025).abs() < 1e-17, "{file}: {out}");
    }
}
