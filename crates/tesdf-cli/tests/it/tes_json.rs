//! `tesdf import`, and `tesdf export` of an asset: JSON of TES-Encoder.

use std::fs;

use crate::folder::{Folder, data};
use tesdf::TeSdf;
use tesdf::glam::DVec3;

/// A tetrahedron with three right angles, and another over its slanted face, whose list is LIST.
pub const FILE: &str = r#"{
    "surface_nodes": [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], "inner_nodes": [], "outer_nodes": [[1, 1, 1]],
    "faces": [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]],
    "surface_inner_tetras": [[0, 1, 3, 2]], "inner_tetras": [],
    "surface_outer_tetras": [[1, 2, 3, 4]], "outer_tetras": [],
    "encoded_faces_surface_inner": [[0, 1, 2, 3]], "encoded_faces_inner": [],
    "encoded_faces_surface_outer": [[LIST]], "encoded_faces_outer": []
}"#;

#[test]
fn a_file_is_imported_verified_and_exported() {
    let folder = Folder::new();
    folder.write("good.json", FILE.replace("LIST", "2"));
    let text = folder.good(&["import", "good.json", "-o", "good.tesdf"]);
    assert!(text.contains("not proven") && text.contains("2.5 faces, longest 4"), "{text}");
    let text = folder.good(&["inspect", "good.tesdf"]);
    assert!(text.contains("imported from JSON of TES-Encoder") && text.contains("not proven"), "{text}");
    assert!(text.contains("good.json"), "{text}");
    let text = folder.good(&["verify", "good.tesdf", "--prove", "--samples", "500"]);
    assert!(text.contains("the file certifies nothing") && !text.contains("nearer by"), "{text}");
    assert!(text.ends_with("\npassed\n") && !text.contains("as promised"), "{text}");
    let text = folder.good(&["verify", "good.tesdf", "--samples", "500"]);
    let cells = "the file certifies nothing: 8 points more inside 2 of 2 cells with a list\n";
    assert!(
        text.contains(cells) && text.contains("f64: nothing is promised; right at these points\n"),
        "{text}"
    );
    assert!(text.ends_with("passed at these points; --prove tells of all points\n"), "{text}");
    assert!(!text.contains("as promised"), "{text}");

    folder.good(&["export", "good.tesdf", "-o", "again.json"]);
    folder.good(&["import", "again.json", "-o", "again.tesdf"]);
    folder.good(&["export", "again.tesdf", "-o", "third.json"]);
    let read = |name: &str| std::fs::read_to_string(folder.path(name)).unwrap();
    assert_eq!(read("again.json"), read("third.json"));
    let (code, text, _) = folder.tesdf(&["export", "again.tesdf", "-o", "-"]);
    assert_eq!((code, text), (Some(0), read("third.json")));

    // The outer list has a face that is nowhere the nearest: at the slanted face, the distance is
    // up to 1 instead of 0.
    folder.write("bad.json", FILE.replace("LIST", "0"));
    folder.good(&["import", "bad.json", "-o", "bad.tesdf"]);
    let (code, text, _) = folder.tesdf(&["verify", "bad.tesdf", "--samples", "500"]);
    assert!(code == Some(1) && text.ends_with("\nnot passed\n"), "{text}");
    assert!(text.matches("nothing is promised; WRONG\n").count() == 2, "{text}");
    assert!(text.contains("  distances       wrong at "), "{text}");
    let (code, text, _) = folder.tesdf(&["verify", "bad.tesdf", "--prove", "--samples", "500"]);
    assert_eq!(code, Some(1));
    assert!(text.contains("1 refuted") && text.matches("nearer by").count() == 2, "{text}");
    assert!(text.contains("  refuted: cell 1: ") && !text.contains("--pieces"), "{text}");
    let (_, text, _) = folder.tesdf(&["verify", "bad.tesdf", "--prove", "--samples", "500", "--json"]);
    let found: serde_json::Value = serde_json::from_str(&text).unwrap();
    let most = found["prove"]["nearer_by"].as_f64().unwrap();
    assert!(most > 0.1 && most <= 1.0, "{most}");
    assert_eq!(found["prove"]["faults"][0]["nearer_by"], most);
}

/// A file that was written once must continue to open, and to give the same answers and bytes.
/// `TESDF_WRITE_GOLDEN=1` writes it.
#[test]
fn the_golden_file_answers() {
    let (folder, golden) = (Folder::new(), data("golden_tes.json"));
    if std::env::var_os("TESDF_WRITE_GOLDEN").is_some() {
        folder.write("hand.json", FILE.replace("LIST", "2"));
        folder.good(&["import", "hand.json", "-o", "hand.tesdf"]);
        folder.good(&["export", "hand.tesdf", "-o", &golden]);
    }
    folder.good(&["import", &golden, "-o", "a.tesdf"]);
    let asset = TeSdf::open(folder.path("a.tesdf")).unwrap();
    for (p, expected) in [(0.1, -0.1), (0.25, -0.25 / 3.0_f64.sqrt()), (0.5, 0.5 / 3.0_f64.sqrt())] {
        let found = asset.signed_distance(DVec3::splat(p));
        assert!((found - expected).abs() < 1e-15, "{p}: {found}");
    }
    folder.good(&["export", "a.tesdf", "-o", "again.json"]);
    assert!(fs::read(folder.path("again.json")).unwrap() == fs::read(golden).unwrap());
}

#[test]
fn what_does_not_fit_is_refused() {
    let folder = Folder::new();
    folder.write("good.json", FILE.replace("LIST", "2"));
    folder.write("bad.json", FILE.replace("LIST", "4"));
    folder.good(&["import", "good.json", "-o", "good.tesdf"]);
    folder.write("cube.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n");
    folder.good(&["encode", "cube.obj", "-o", "cube.tesdf"]);
    for (args, expected) in [
        (
            &["import", "bad.json", "-o", "a.tesdf"][..],
            "bad.json: encoded_faces_surface_outer[0]: face 4, expected below 4",
        ),
        (&["import", "none.json", "-o", "a.tesdf"][..], "none.json"),
        (&["import", "cube.obj", "-o", "a.tesdf"][..], "line 1"),
        (&["import", "good.json", "-o", "good.json"][..], "is the input"),
        (&["export", "cube.tesdf", "-o", "a.json"][..], "--domain gmsh --plain"),
        (&["export", "good.tesdf", "-o", "a.glb"][..], "a.json"),
        (&["export", "good.tesdf", "-o", "a.json", "--fps", "3"][..], "are for runs"),
        (&["export", "good.json", "-o", "a.json"][..], "not a run of tesdf"),
    ] {
        let (code, _, err) = folder.tesdf(args);
        assert_eq!(code, Some(2), "{args:?}: {err}");
        assert!(err.contains(expected), "{args:?}: {err}");
    }
    assert_eq!(folder.names(), ["bad.json", "cube.obj", "cube.tesdf", "good.json", "good.tesdf"]);
}
