//! Messages for users: they are true, can be read, and say what to do next.

use std::process::Command;

use crate::folder::{Folder, data, texts};

/// A cube with edges of length 2 and a corner at the origin.
const CUBE: &str = "v 0 0 0\nv 2 0 0\nv 2 2 0\nv 0 2 0\nv 0 0 2\nv 2 0 2\nv 2 2 2\nv 0 2 2\n\
                    f 1 4 3 2\nf 5 6 7 8\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n";

/// Assets of the cube with these units as their names. `none.tesdf` records no unit.
fn cubes(units: &[&str]) -> Folder {
    let folder = Folder::new();
    folder.write("c.obj", CUBE);
    folder.good(&["encode", "c.obj", "-o", "none.tesdf", "--preset", "fast"]);
    for unit in units {
        let file = format!("{unit}.tesdf");
        folder.good(&["encode", "c.obj", "-o", &file, "--preset", "fast", "--unit", unit]);
    }
    folder
}

#[test]
fn control_characters_are_not_printed() {
    let folder = Folder::new();
    let hostile = "\u{1b}[31mred\u{7}\nfaces  12";
    folder.write("c.obj", CUBE);
    let encode = ["encode", "c.obj", "-o", "c.tesdf", "--preset", "fast", "--unit", hostile];
    folder.good(&encode);
    let text = folder.good(&["inspect", "c.tesdf"]);
    assert!(!text.contains(['\u{1b}', '\u{7}']) && text.contains(r"\u{1b}[31mred\u{7}\nfaces  12"), "{text}");
    let json = folder.good(&["inspect", "c.tesdf", "--json"]);
    let json: serde_json::Value = serde_json::from_str(&json).unwrap();
    assert!(json.to_string().contains(r"\u001b[31mred"), "{json}");
    // Keys of a file, and arguments.
    folder.write("s.toml", "\"\\u001b[31m\" = 1\n");
    for args in
        [&["simulate", "s.toml", "-o", "run"][..], &["encode", "\u{1b}[31m", "-o", "f"], &["\u{1b}[31m"]]
    {
        let (code, _, err) = folder.tesdf(args);
        assert_eq!(code, Some(2), "{err}");
        assert!(!err.contains('\u{1b}'), "{err:?}");
    }
}

#[test]
fn long_values_are_cut() {
    let folder = Folder::new();
    let long = "x".repeat(100_000);
    folder.write("s.toml", format!("{long} = 1\n"));
    folder.write("p.csv", format!("x,y,z\n1,2,{long}\n"));
    folder.write("c.obj", CUBE.replace("v 2 0 0", &format!("v 2 0 {long}")));
    for args in [
        &["simulate", "s.toml", "-o", "run"][..],
        &["encode", "c.obj", "-o", "f"],
        &["encode", "c.obj", "-o", "f", "--band", &long],
        &["encode", &long, "-o", "f"],
    ] {
        let (code, _, err) = folder.tesdf(args);
        assert_eq!(code, Some(2), "{err}");
        assert!(err.len() < 5000, "{} bytes: {}", err.len(), &err[..200]);
    }
}

#[test]
fn an_asset_comes_through_a_pipe() {
    let folder = cubes(&[]);
    let piped = |input: &str, command: &str| {
        let script = format!("{input} | \"$0\" {command}");
        let mut shell = Command::new("sh");
        shell.env("TESDF_CACHE", "");
        shell.args(["-c", &script, crate::folder::BINARY]).current_dir(folder.path(""));
        texts(shell.output().unwrap())
    };
    let (code, out, err) = piped("cat none.tesdf", "verify /dev/stdin --samples 100");
    assert!(code == Some(0) && out.contains("passed"), "{out}{err}");
    let (code, _, err) = piped("cat none.tesdf", "clearance /dev/stdin none.tesdf");
    assert_eq!(code, Some(0), "{err}");
    // An endless stream must not be read to its end.
    for args in [
        &["query", "none.tesdf", "--points"][..],
        &["simulate", "-o", "x"],
        &["view", "-o", "x"],
        &["import", "-o", "x"],
    ] {
        let (code, _, err) = folder.tesdf(&[args, &["/dev/zero"]].concat());
        assert!(code == Some(2) && err.contains("bytes came from it"), "{args:?}: {err}");
    }
    let (code, _, err) = piped("cat /dev/zero", "verify /dev/stdin");
    assert!(code == Some(2) && err.contains("not a .tesdf file"), "{err}");
    let (code, out, _) = piped("head -c 3000 none.tesdf", "verify /dev/stdin");
    assert!(code == Some(1) && out.starts_with("failed: /dev/stdin: "), "{out}");
}

#[test]
fn a_minus_is_a_stream_and_never_a_file() {
    let folder = cubes(&[]);
    folder.write("p.csv", "x,y,z\n1,1,1.5\n");
    folder.write("list", "c.obj\n");
    let shell = |script: &str| {
        let mut shell = Command::new("sh");
        shell.env("TESDF_CACHE", "").env("T", crate::folder::BINARY);
        shell.args(["-c", script]).current_dir(folder.path(""));
        texts(shell.output().unwrap())
    };
    let answer = folder.good(&["query", "none.tesdf", "--points", "p.csv"]);
    assert!(answer.contains(",-0.5,"), "{answer}");
    for script in [
        "$T query none.tesdf --points - <p.csv",
        "$T query - --points p.csv <none.tesdf",
        "$T encode c.obj --preset fast -o - | $T query - --points p.csv",
        "$T repair c.obj -o - >r.ply; $T encode r.ply -o r.tesdf >log; $T query r.tesdf --points p.csv",
    ] {
        let (code, out, err) = shell(script);
        assert_eq!((code, out.as_str()), (Some(0), answer.as_str()), "{script}: {err}");
    }
    for (script, expected) in [
        ("$T inspect - --json <none.tesdf", "\"file\": \"/dev/stdin\""),
        ("$T verify - --samples 50 <none.tesdf", "passed"),
        ("$T collide - none.tesdf --pose-b '5 0 0 0 0 0 1' --json <none.tesdf", "[]"),
        ("$T slice - -o - <none.tesdf | head -c 4 | tail -c 3", "PNG"),
        ("$T render - -o - <none.tesdf | head -c 4 | tail -c 3", "PNG"),
        ("$T part peg -o - | head -n 1", "ply"),
        ("$T encode-all - -o all <list", "1 now"),
    ] {
        let (code, out, err) = shell(script);
        assert!(code == Some(0) && out.contains(expected), "{script}: {out}{err}");
    }
    for (args, expected) in [
        (&["check", "-"][..], "the extension of the name is the format of the mesh; save it as a file first"),
        (&["encode", "-", "-o", "x"], "the extension of the name is the format"),
        (&["repair", "-", "-o", "x"], "the extension of the name is the format"),
        (&["simulate", "-", "-o", "x"], "a scene names its files from its own folder"),
        (&["encode-all", "list", "-o", "-"], "expected the name of a folder"),
        (&["query", "-", "--points", "-"], "cannot both come from the standard input"),
    ] {
        let (code, out, err) = folder.tesdf(args);
        assert_eq!((code, out.as_str()), (Some(2), ""), "{args:?}");
        assert!(err.contains(expected), "{args:?}: {err}");
    }
    assert!(!folder.names().contains(&"-".to_string()), "{:?}", folder.names());
}

#[test]
fn a_row_of_decimal_commas_is_an_error() {
    let folder = cubes(&[]);
    folder.write("p.csv", "x,y,z\n1,2,3\n1,5,2,5,3,5\n");
    let (code, out, err) = folder.tesdf(&["query", "none.tesdf", "--points", "p.csv"]);
    assert_eq!((code, out.as_str()), (Some(2), ""));
    assert!(err.starts_with("error: p.csv: line 3: 6 fields under 3 columns"), "{err}");
}

#[test]
fn a_body_overlaps_its_copy_in_the_same_pose() {
    let folder = cubes(&[]);
    let clearance = |pose: &str| {
        let args = ["clearance", "none.tesdf", "none.tesdf", "--pose-b", pose];
        let json: serde_json::Value =
            serde_json::from_str(&folder.good(&[&args[..], &["--json"]].concat())).unwrap();
        (folder.good(&args), json["overlap"].as_bool().unwrap())
    };
    for (pose, expected, overlap) in [
        ("0 0 0 0 0 0 1", "(they overlap: ", true),
        ("0.5 0.5 0.5 0 0 0 1", "(they overlap)", true),
        ("0 0 2 0 0 0 1", "(they touch)", false),
        ("0 0 3 0 0 0 1", "(apart)", false),
    ] {
        let (text, found) = clearance(pose);
        assert!(text.contains(expected) && found == overlap, "{pose}: {text}");
    }
    let help = folder.good(&["clearance", "--help"]);
    let help = help.split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(help.contains("A negative clearance means that the bodies overlap"), "{help}");
}

#[test]
fn units_that_differ_are_not_mixed() {
    let folder = cubes(&["mm", "millimetres", "m", "furlong"]);
    let collide = |a: &str, b: &str| folder.tesdf(&["collide", a, b, "--pose-b", "5 0 0 0 0 0 1"]);
    for command in [&["collide"][..], &["clearance"], &["toi"], &["render", "-o", "p.png"]] {
        for (a, b) in [("mm.tesdf", "m.tesdf"), ("furlong.tesdf", "mm.tesdf")] {
            let (code, out, err) = folder.tesdf(&[command, &[a, b]].concat());
            assert_eq!((code, out.as_str()), (Some(2), ""), "{command:?}");
            let unit = |file: &str| file.trim_end_matches(".tesdf").to_string();
            let expected = format!("error: {a} is in {} and {b} in {}: ", unit(a), unit(b));
            assert!(err.starts_with(&expected) && err.contains("hint: "), "{err}");
        }
    }
    let (code, _, err) = collide("mm.tesdf", "millimetres.tesdf");
    assert_eq!((code, err.as_str()), (Some(0), ""));
    let (code, _, err) = collide("mm.tesdf", "none.tesdf");
    assert_eq!(code, Some(0));
    assert_eq!(err, "warning: none.tesdf records no unit and is taken to be in mm, as mm.tesdf is\n");
}

#[test]
fn check_points_at_repair_where_it_helps() {
    let folder = Folder::new();
    for (file, expected) in [
        ("bad/flipped_all.obj", "makes it encodable"),
        ("bad/duplicate_faces.obj", "makes it encodable"),
        ("bad/open_half.obj", "--fill-holes makes it encodable"),
        ("bad/huge_1e200.obj", "no repair makes it encodable; scale or move it"),
    ] {
        let (code, _, err) = folder.tesdf(&["check", &data(file)]);
        assert_eq!(code, Some(1), "{file}");
        assert!(err.starts_with("hint: ") && err.contains(expected), "{file}: {err}");
    }
}

#[test]
fn help_explains_devices() {
    let folder = Folder::new();
    for command in [&["collide"][..], &["simulate"], &["encode"]] {
        let help = folder.good(&[command, &["--help"]].concat());
        let words = help.split_whitespace().collect::<Vec<_>>().join(" ");
        assert!(words.contains("gpu (32 bits; what TESDF_DEVICE names, else the best device)"), "{help}");
    }
}
