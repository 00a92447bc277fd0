//! The output and exit codes of `tesdf check` and `tesdf repair`.

use std::path::Path;

use crate::folder::Folder;

const VERTICES: &str = "v 0 0 0\nv 2 0 0\nv 2 2 0\nv 0 2 0\nv 0 0 2\nv 2 0 2\nv 2 2 2\nv 0 2 2\n";
const FACES: &str = "f 1 4 3 2\nf 5 6 7 8\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n";

#[test]
fn a_good_mesh_exits_with_0() {
    let folder = Folder::new();
    folder.write("cube.obj", format!("{VERTICES}{FACES}"));
    let (code, out, err) = folder.tesdf(&["check", "cube.obj"]);
    assert_eq!((code, err.as_str()), (Some(0), ""));
    assert!(out.starts_with("cube.obj: OBJ, 6 faces, 8 vertices\n"), "{out}");
    assert!(out.ends_with("ok: the inside is well defined\n"), "{out}");
    let (code, out, _) = folder.tesdf(&["check", "cube.obj", "--json"]);
    let json: serde_json::Value = serde_json::from_str(&out).unwrap();
    assert_eq!(code, Some(0));
    assert_eq!(json["file"], "cube.obj");
    assert_eq!(json["load"]["format"], "obj");
    assert_eq!(json["check"]["faces"], 12);
    assert_eq!(json["check"]["encodable"], true);
}

#[test]
fn a_hole_exits_with_1_and_names_its_edges() {
    let folder = Folder::new();
    folder.write("open.obj", format!("{VERTICES}{}", &FACES[10..]));
    let (code, out, err) = folder.tesdf(&["check", "open.obj"]);
    assert_eq!(code, Some(1), "{err}");
    assert!(out.contains("error: edge 0-1 is open: only face "), "{out}");
    assert!(out.contains("boundary loop 0: 4 edges, length 8"), "{out}");
    assert_eq!(err, "hint: tesdf repair open.obj -o open.ply --fill-holes makes it encodable\n");
    let (_, out, _) = folder.tesdf(&["check", "open.obj", "--json"]);
    let json: serde_json::Value = serde_json::from_str(&out).unwrap();
    assert_eq!(json["suggestion"], "tesdf repair open.obj -o open.ply --fill-holes");
    let (code, out, err) = folder.tesdf(&["repair", "open.obj", "-o", "r.ply"]);
    assert_eq!(code, Some(1));
    assert!(out.contains("not encodable: 4 errors left"), "{out}");
    assert!(err.contains("hint: tesdf repair open.obj -o open.ply --fill-holes"), "{err}");
}

#[test]
fn the_suggested_command_works() {
    let folder = Folder::new();
    folder.write("open.obj", format!("{VERTICES}{}", &FACES[10..]));
    let near = "v 0 0 2.000003\nv 2 0 2.000003\nv 2 2 2.000003\nv 0 2 2.000003\n";
    let crack = FACES.replace("f 5 6 7 8", "f 9 10 11 12");
    folder.write("crack.obj", format!("{VERTICES}{near}{crack}"));
    for file in ["open.obj", "crack.obj"] {
        let (_, _, hint) = folder.tesdf(&["check", file]);
        let command = hint.strip_prefix("hint: tesdf ").and_then(|h| h.split(" makes it").next()).unwrap();
        let (code, out, err) = folder.tesdf(&command.split(' ').collect::<Vec<_>>());
        assert_eq!((code, err.as_str()), (Some(0), ""), "{command}: {out}");
        // `--auto` does the same.
        let (code, same, _) = folder.tesdf(&["repair", file, "-o", "auto.ply", "--auto", "--json"]);
        let json: serde_json::Value = serde_json::from_str(&same).unwrap();
        assert_eq!(code, Some(0));
        assert!(command.ends_with(json["flags"].as_str().unwrap()), "{command}: {same}");
        let written = command.split(' ').nth(3).unwrap();
        assert_eq!(
            std::fs::read(folder.path("auto.ply")).unwrap(),
            std::fs::read(folder.path(written)).unwrap()
        );
    }
}

/// A sheet has no inside by any winding number. A dish has one, although it is too open to be filled.
#[test]
fn a_sheet_is_encoded_as_a_sheet_and_a_dish_as_a_solid() {
    let folder = Folder::new();
    let grid = |height: fn(u32, u32) -> f64| {
        let corner = |k: u32| format!("v {} {} {}\n", k % 5, k / 5, height(k % 5, k / 5));
        let square = |k: u32| {
            let a = k / 4 * 5 + k % 4 + 1;
            format!("f {a} {} {} {}\n", a + 1, a + 6, a + 5)
        };
        (0..25).map(corner).chain((0..16).map(square)).collect::<String>()
    };
    folder.write("plate.obj", grid(|_, _| 1.0));
    folder.write("triangle.obj", "v 0 0 0\nv 2 1 0\nv 1 0 3\nf 1 2 3\n");
    folder.write("dish.obj", grid(|x, y| 0.2 * f64::from(x.abs_diff(2).max(y.abs_diff(2)))));
    for (file, rule) in
        [("plate", "sheet --thickness 0.05"), ("triangle", "sheet --thickness 0.03"), ("dish", "generalized")]
    {
        let (_, out, hint) = folder.tesdf(&["check", &format!("{file}.obj"), "--json"]);
        let json: serde_json::Value = serde_json::from_str(&out).unwrap();
        let command = json["suggestion"].as_str().unwrap();
        assert_eq!(command, format!("tesdf encode {file}.obj -o {file}.tesdf --inside {rule}"));
        assert!(hint.contains(command), "{hint}");
        assert_eq!(hint.contains("encloses nothing"), rule != "generalized", "{hint}");
        folder.good(&command.split(' ').skip(1).collect::<Vec<_>>());
        let (_, _, refusal) = folder.tesdf(&["encode", &format!("{file}.obj"), "-o", "a.tesdf"]);
        assert_eq!(refusal.contains("--inside generalized"), rule == "generalized", "{refusal}");
    }
}

#[test]
fn holes_are_filled_and_named() {
    let folder = Folder::new();
    folder.write("open.obj", format!("{VERTICES}{}", &FACES[10..]));
    let (code, out, err) = folder.tesdf(&["repair", "open.obj", "-o", "r.ply", "--fill-holes"]);
    assert_eq!((code, err.as_str()), (Some(0), ""), "{out}");
    assert!(out.contains("1 hole filled (0-based): 0 3 2 1 (4 edges, flat, area 4.000e0)\n"), "{out}");
    let (code, out, _) = folder.tesdf(&["repair", "open.obj", "-o", "r.ply", "--json", "--fill-holes", "3"]);
    let json: serde_json::Value = serde_json::from_str(&out).unwrap();
    assert_eq!((code, &json["repair"]["filled_holes"]), (Some(1), &serde_json::json!([])));
    assert_eq!(json["repair"]["holes_left"][0]["reason"], "too-many-edges");
    let (code, _, err) = folder.tesdf(&["repair", "--fill-holes", "open.obj", "-o", "r.ply"]);
    assert_eq!(code, Some(2));
    assert!(err.contains("give the mesh before this option"), "{err}");
}

#[test]
fn the_weld_tolerance_is_found_and_printed() {
    let folder = Folder::new();
    let near = "v 0 0 2.000003\nv 2 0 2.000003\nv 2 2 2.000003\nv 0 2 2.000003\n";
    let faces = FACES.replace("f 5 6 7 8", "f 9 10 11 12");
    folder.write("crack.obj", format!("{VERTICES}{near}{faces}"));
    let args = ["repair", "crack.obj", "-o", "r.ply", "--weld-tolerance", "auto"];
    let (code, out, err) = folder.tesdf(&args);
    assert_eq!((code, err.as_str()), (Some(0), ""), "{out}");
    assert!(out.contains("weld tolerance 3.5e-6\n4 vertices merged"), "{out}");
    let (_, out, _) = folder.tesdf(&[&args[..], &["--json"]].concat());
    let json: serde_json::Value = serde_json::from_str(&out).unwrap();
    assert_eq!(json["repair"]["weld_tolerance"], 3.5e-6);
}

#[test]
fn a_union_is_refused_with_what_to_do_instead() {
    let folder = Folder::new();
    folder.write("cube.obj", format!("{VERTICES}{FACES}"));
    let (code, out, err) = folder.tesdf(&["repair", "cube.obj", "-o", "r.ply", "--union"]);
    assert_eq!((code, out.as_str()), (Some(2), ""));
    assert!(
        err.contains("error: cube.obj: --union: ") && err.contains("hint: encode the mesh as it is"),
        "{err}"
    );
    assert!(!folder.path("r.ply").exists());
}

#[test]
fn a_mesh_is_repaired_while_it_is_encoded() {
    let folder = Folder::new();
    folder.write("open.obj", format!("{VERTICES}{}", &FACES[10..]));
    let (code, _, err) = folder.tesdf(&["encode", "open.obj", "-o", "a.tesdf"]);
    assert_eq!(code, Some(2));
    assert!(err.contains("--fill-holes`, or `--repair auto` here, makes it encodable"), "{err}");
    let encode = ["encode", "open.obj", "-o", "a.tesdf", "--repair", "auto"];
    let (code, out, err) = folder.tesdf(&encode);
    assert_eq!(code, Some(0), "{err}");
    assert!(
        err.contains("note: repaired as by `tesdf repair --fill-holes`; 1 hole filled, area 4.000e0"),
        "{err}"
    );
    assert!(out.contains("12 faces"), "{out}");
    let (_, out, _) = folder.tesdf(&["inspect", "a.tesdf"]);
    assert!(out.contains("as by `tesdf repair --fill-holes`; 1 hole filled"), "{out}");
    let (_, out, _) = folder.tesdf(&["inspect", "a.tesdf", "--json"]);
    let json: serde_json::Value = serde_json::from_str(&out).unwrap();
    assert_eq!(json["source"]["repair"]["filled_holes"], 1);
    assert_eq!(folder.tesdf(&["verify", "a.tesdf"]).0, Some(0));
    let (_, out, _) = folder.tesdf(&[&encode[..], &["--json"]].concat());
    let json: serde_json::Value = serde_json::from_str(&out).unwrap();
    assert_eq!(json["repair"]["filled_holes"][0]["faces"], 2);
    // A mesh that needs no repair is encoded to the same bytes with the option.
    folder.write("cube.obj", format!("{VERTICES}{FACES}"));
    for (name, option) in [("plain.tesdf", &[][..]), ("auto.tesdf", &["--repair", "auto"])] {
        assert_eq!(folder.tesdf(&[&["encode", "cube.obj", "-o", name][..], option].concat()).0, Some(0));
    }
    let bytes = |name: &str| std::fs::read(folder.path(name)).unwrap();
    assert_eq!(bytes("plain.tesdf"), bytes("auto.tesdf"));
}

#[test]
fn a_face_without_area_that_stands_out_is_no_surface_where_it_is_repaired() {
    let folder = Folder::new();
    // The last face runs from a corner to a point above the cube and back.
    folder.write("hair.obj", format!("{VERTICES}v 1 1 50\n{FACES}f 7 9 7\n"));
    folder.write("p.csv", "x,y,z\n1,1,50\n");
    let distance = |more: &[&str]| {
        let (code, _, err) =
            folder.tesdf(&[&["encode", "hair.obj", "-o", "a.tesdf", "--preset", "fast"], more].concat());
        assert_eq!(code, Some(0), "{err}");
        let out = folder.good(&["query", "a.tesdf", "--points", "p.csv"]);
        let answer = out.lines().nth(1).expect("an answer");
        (answer.split(',').nth(3).expect("a distance").parse::<f64>().expect("a number"), err)
    };
    let (as_it_is, err) = distance(&[]);
    assert!(as_it_is.abs() < 1e-6, "{as_it_is}");
    assert!(err.contains("stands out of the surface, and distances refer to it, too"), "{err}");
    let (boundary, err) = distance(&["--surface", "boundary"]);
    assert!((boundary - 48.0).abs() < 1e-4 && err.contains("and is left out of it"), "{boundary} {err}");
    let (repaired, err) = distance(&["--repair", "auto"]);
    assert!((repaired - 48.0).abs() < 1e-4 && !err.contains("stands out"), "{repaired} {err}");
    assert!(err.contains("note: repaired as by `tesdf repair`; 1 face dropped"), "{err}");
    // The command for repairs does the same.
    folder.good(&["repair", "hair.obj", "--auto", "-o", "r.ply"]);
    let (_, out, _) = folder.tesdf(&["check", "r.ply"]);
    assert!(out.ends_with("ok: the inside is well defined\n"), "{out}");
    let (_, out, _) = folder.tesdf(&["check", "hair.obj"]);
    assert!(out.contains("face 12 has two equal corners (6, 8, 6); it stands out of the surface"), "{out}");
}

#[test]
fn many_meshes_are_repaired_while_they_are_encoded() {
    let folder = Folder::new();
    std::fs::create_dir(folder.path("meshes")).unwrap();
    folder.write("meshes/open.obj", format!("{VERTICES}{}", &FACES[10..]));
    folder.write("meshes/cube.obj", format!("{VERTICES}{FACES}"));
    let all = ["encode-all", "meshes", "-o", "out"];
    assert_eq!(folder.tesdf(&all).0, Some(1));
    // With the option, all are there, and stay.
    for _ in 0..2 {
        let (code, _, err) = folder.tesdf(&[&all[..], &["--repair", "auto"]].concat());
        assert_eq!(code, Some(0), "{err}");
        let manifest = std::fs::read_to_string(folder.path("out/manifest.json")).unwrap();
        let manifest: serde_json::Value = serde_json::from_str(&manifest).unwrap();
        assert_eq!(manifest["failed"], 0);
        assert_eq!(manifest["meshes"][1]["repair"]["flags"], "--fill-holes");
        assert!(manifest["meshes"][0].get("repair").is_none());
    }
}

#[test]
fn repairs_are_reported_and_pass_the_check_in_every_format() {
    let folder = Folder::new();
    // The last face occurs twice, and the first face is reversed.
    let faces = FACES.replace("f 1 4 3 2", "f 1 2 3 4");
    folder.write("bad.obj", format!("{VERTICES}{faces}f 4 1 5 8\n"));
    assert_eq!(folder.tesdf(&["check", "bad.obj"]).0, Some(1));
    for name in ["r.ply", "r.obj", "r.stl"] {
        let (code, out, err) = folder.tesdf(&["repair", "bad.obj", "-o", name]);
        assert_eq!((code, err.as_str()), (Some(0), ""), "{out}");
        assert!(out.contains("2 duplicate faces dropped (0-based): 12 repeats 10, 13 repeats 11\n"), "{out}");
        assert!(out.contains("2 faces reversed (0-based): 0, 1\n"), "{out}");
        assert!(out.ends_with(&format!("ok: encodable\nwritten to {name}\n")), "{out}");
        assert_eq!(folder.tesdf(&["check", name]).0, Some(0));
    }
    let (_, out, _) = folder.tesdf(&["repair", "bad.obj", "-o", "r.ply", "--json"]);
    let json: serde_json::Value = serde_json::from_str(&out).unwrap();
    assert_eq!(json["repair"]["reversed_faces"], serde_json::json!([0, 1]));
    assert_eq!(json["output"], "r.ply");
}

#[test]
fn a_weld_tolerance_merges_near_vertices() {
    let folder = Folder::new();
    // The top has corners of its own, which are a millionth away from those of the sides.
    let near = "v 0 0 2.000001\nv 2 0 2.000001\nv 2 2 2.000001\nv 0 2 2.000001\n";
    let faces = FACES.replace("f 5 6 7 8", "f 9 10 11 12");
    folder.write("crack.obj", format!("{VERTICES}{near}{faces}"));
    assert_eq!(folder.tesdf(&["repair", "crack.obj", "-o", "r.ply"]).0, Some(1));
    let (code, out, _) = folder.tesdf(&["repair", "crack.obj", "-o", "r.ply", "--weld-tolerance", "1e-5"]);
    assert_eq!(code, Some(0), "{out}");
    assert!(out.contains("4 vertices merged (0-based): 8 into 4"), "{out}");
    let (code, _, err) = folder.tesdf(&["repair", "crack.obj", "-o", "r.ply", "--weld-tolerance", "0"]);
    assert_eq!(code, Some(2));
    assert!(err.contains("the weld tolerance is 0; expected a finite number above 0"), "{err}");
}

#[test]
fn files_that_cannot_be_read_or_written_are_named() {
    let folder = Folder::new();
    folder.write("cube.obj", format!("{VERTICES}{FACES}"));
    folder.write("bad.obj", "v 0 0 zero\n");
    folder.write("bad.txt", "");
    folder.write("empty.stl", "");
    for (args, expected) in [
        (&["check", "none.stl"][..], "error: cannot read none.stl: "),
        (&["check", "none"], "error: cannot read none: "),
        (&["check", "bad.txt"], "error: bad.txt: the extension names no mesh format that can be read"),
        (&["check", "bad.obj"], "error: bad.obj: OBJ, line 1: 'zero' is not a number"),
        (&["check", "empty.stl"], "error: empty.stl: the file is empty"),
        (
            &["repair", "cube.obj", "-o", "r.step"],
            "error: r.step: the extension names no mesh format that can be written",
        ),
        (
            &["encode", "cube.obj", "-o", "c.stl"],
            "error: c.stl: the extension is that of a mesh, but an asset would be written\nhint: -o c.tesdf\n",
        ),
        (&["repair", "cube.obj", "-o", "no/r.ply"], "error: cannot write no/r.ply: "),
    ] {
        let (code, out, err) = folder.tesdf(args);
        assert_eq!((code, out.as_str()), (Some(2), ""), "{args:?}");
        assert!(err.starts_with(expected), "{args:?}: {err}");
    }
    assert!(!Path::new(&folder.path("r.step")).exists());
}
