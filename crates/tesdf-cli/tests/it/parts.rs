//! `tesdf part`.

use crate::folder::Folder;
use tesdf::SolidMesh;
use tesdf::mesh::WriteFormat;
use tesdf_parts::{
    Bolt, ChainLink, Finger, Gear, LobedHole, LobedPeg, Nut, PartError, Resolution, Shaft, Sleeve, Spool,
    Spoon,
};

/// Every part by its name, as the library makes it by default.
fn parts(resolution: Resolution) -> Vec<(&'static str, Result<SolidMesh, PartError>)> {
    let size = "M16".parse().unwrap();
    vec![
        ("bolt", Bolt::iso_4014(size).mesh(resolution)),
        ("nut", Nut::iso_4032(size).mesh(resolution)),
        ("peg", LobedPeg::DEFAULT.mesh(resolution)),
        ("hole", LobedHole::DEFAULT.mesh(resolution)),
        ("gear", Gear::DEFAULT.mesh(resolution)),
        ("sleeve", Sleeve::DEFAULT.mesh(resolution)),
        ("shaft", Shaft::example().mesh(resolution)),
        ("link", ChainLink::DEFAULT.mesh(resolution)),
        ("spool", Spool::DEFAULT.mesh(resolution)),
        ("finger", Finger::DEFAULT.mesh(resolution)),
        ("spoon", Spoon::DEFAULT.mesh(resolution)),
    ]
}

#[test]
fn the_defaults_are_those_of_the_library() {
    let folder = Folder::new();
    let help = folder.good(&["part", "--help"]);
    for (name, solid) in parts(Resolution::Segments(24)) {
        assert!(help.contains(&format!("  {name} ")), "{help}");
        folder.good(&["part", name, "-o", "part.ply", "--segments", "24"]);
        let written = SolidMesh::read(folder.path("part.ply")).unwrap();
        let [ours, theirs] = [&written, &solid.unwrap()].map(|solid| solid.mesh().clone());
        assert_eq!(ours.faces(), theirs.faces(), "{name}");
        let moved =
            ours.vertices().iter().zip(theirs.vertices()).map(|(a, b)| a.distance(*b)).fold(0.0, f64::max);
        assert!(moved < 1e-15, "{name}: {moved:e}");
    }
}

/// `data/parts/parts.tsv` has the command of each mesh of the folder.
#[test]
fn the_meshes_of_scenes_are_made_by_their_commands() {
    let folder = Folder::new();
    let data = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../data/parts");
    let table = std::fs::read_to_string(data.join("parts.tsv")).unwrap();
    let rows: Vec<(&str, &str)> = table.lines().skip(1).map(|row| row.split_once('\t').unwrap()).collect();
    let files = std::fs::read_dir(&data).unwrap().count();
    assert_eq!(rows.len(), files - 1, "each mesh has one row");
    for (file, command) in rows {
        // Every second piece between quotes is one argument.
        let pieces = command.split('"').enumerate();
        let args = pieces.flat_map(|(k, piece)| match k % 2 {
            0 => piece.split_whitespace().collect(),
            _ => vec![piece],
        });
        let args: Vec<&str> = args.skip(1).chain(["-o", file]).collect();
        folder.good(&args);
        let [made, kept] = [folder.path(file), data.join(file)].map(|path| SolidMesh::read(path).unwrap());
        // No assert_eq!, which would print both meshes.
        assert!(made.mesh() == kept.mesh(), "{file}");
    }
}

#[test]
fn a_part_is_written_described_and_encoded() {
    let folder = Folder::new();
    let args = ["part", "bolt", "--size", "M8", "--clearance", "25um", "--segments", "24", "-o", "bolt.stl"];
    let (code, out, err) = folder.tesdf(&args);
    assert_eq!(code, Some(0), "{err}");
    assert_eq!(err, "hint: tesdf encode bolt.stl -o bolt.tesdf --unit m\n");
    let expected = "\
part           bolt
mesh           FACES
size           13 × 15.0111 × 45.3 mm
volume         VOLUME
thread         M8 × 1.25, right-handed
clearance      0.025 mm in radius, 0.0125 mm normal to the flanks
thread length  22 mm
written to     bolt.stl, in metres
";
    for (found, expected) in out.lines().zip(expected.lines()) {
        if !expected.ends_with("FACES") && !expected.ends_with("VOLUME") {
            assert_eq!(found, expected);
        }
    }
    assert_eq!(out.lines().count(), 8, "{out}");
    folder.good(&["check", "bolt.stl"]);
    let encode = err.trim_start_matches("hint: tesdf ").trim_end();
    folder.good(&encode.split(' ').chain(["--preset", "fast"]).collect::<Vec<_>>());
    folder.good(&["verify", "bolt.tesdf", "--samples", "100"]);
}

#[test]
fn units_and_formats() {
    let folder = Folder::new();
    for (unit, height) in [("m", 0.0148), ("mm", 14.8)] {
        for format in ["ply", "obj", "stl"] {
            let file = format!("nut.{format}");
            let args = ["part", "nut", "--segments", "24", "--unit", unit, "-o", &file, "--json"];
            let json: serde_json::Value = serde_json::from_str(&folder.good(&args)).unwrap();
            assert_eq!((json["part"].as_str(), json["unit"].as_str()), (Some("nut"), Some(unit)));
            assert!((json["max"][2].as_f64().unwrap() - 0.0148).abs() < 1e-12);
            let written = SolidMesh::read(folder.path(&file)).unwrap();
            let exact = WriteFormat::of_path(&file).unwrap().is_exact();
            let tolerance = height * if exact { 1e-12 } else { 1e-6 };
            assert!((written.mesh().bounds().max.z - height).abs() < tolerance);
            assert_eq!(json["faces"].as_u64(), Some(written.mesh().faces().len() as u64));
        }
    }
}

#[test]
fn options_of_gears_and_shafts() {
    let folder = Folder::new();
    let good = |args: &str| {
        let words: Vec<&str> = args.split('|').collect();
        folder.good(&[&["part"], &words[..], &["--segments", "24", "-o", "p.ply"]].concat())
    };
    let out = good("gear|--teeth|36|--spline|6 23mm 26mm 6mm|--hub|44mm 4mm|--dogs|6");
    assert!(out.contains("diameters   root 67, pitch 72, tip 76 mm\n"), "{out}");
    assert!(out.contains("× 19 mm"), "{out}");
    let out = good("shaft|--section|20mm 30mm|--section|6 23mm 26mm 6mm 40mm|--keyway|0 5mm 3mm 19mm 5mm");
    assert!(out.contains("sections    2 over 70 mm\n"), "{out}");
    let out = good("spool|--groove|0.5mm|--wire|3mm|--straight|6mm|--bend-radius|4mm");
    assert!(out.contains("mm wide, 4.5 mm deep, 12 mm from turn to turn\n"), "{out}");
    let out = good("gear|--teeth|12|--profile-shift|0.35|--bore|0");
    assert!(out.contains("pitch 24,"), "{out}");
}

#[test]
fn errors_name_what_was_expected() {
    let folder = Folder::new();
    for (args, expected) in [
        ("bolt|--size|M17", "M17 is not in the table of sizes; expected one of M3, M4, M5, M6, M8,"),
        ("bolt|--length|16", "expected a length with its unit (nm, um, mm, cm or m), such as 16mm"),
        (
            "bolt|--length|30mm|--thread-length|30mm",
            "error: the thread length is 30 mm; expected less than 27.84 mm",
        ),
        (
            "nut|--deviation|0mm",
            "error: the deviation is 0 mm; expected at least 0.000004 mm, which takes 4096 segments",
        ),
        ("nut|--segments|5", "error: the number of segments is 5; expected 12 to 4096"),
        ("gear|--teeth|14", "14 teeth are undercut"),
        ("gear|--teeth|14", "hint: tesdf part gear --help lists all dimensions"),
        ("gear|--spline|6 23mm 26mm", "2 lengths; expected a number of teeth and three lengths"),
        ("shaft|--section|20mm", "1 lengths; expected two, \"DIAMETER LENGTH\""),
        (
            "shaft|--section|20mm 30mm|--keyway|1 5mm 3mm 19mm 5mm",
            "error: the section of a keyway is 1; expected 0 to 0, the number of a --section",
        ),
        ("spoon|--output|s.step", "the extension names no mesh format that can be written"),
        ("cube", "unrecognized subcommand 'cube'"),
    ] {
        let mut words: Vec<&str> = args.split('|').collect();
        if !words.contains(&"--output") {
            words.extend(["-o", "p.ply"]);
        }
        let (code, out, err) = folder.tesdf(&[&["part"], &words[..]].concat());
        assert_eq!((code, out.as_str()), (Some(2), ""), "{args}: {err}");
        assert!(err.contains(expected), "{args}: {err}");
    }
    assert!(folder.names().is_empty(), "nothing is written: {:?}", folder.names());
}
