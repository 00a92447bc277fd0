//! From a mesh file to answers, on the command line.

use crate::folder::{Folder, data};

/// A cube with edges of length 2 and a corner at the origin.
const CUBE: &str = "v 0 0 0\nv 2 0 0\nv 2 2 0\nv 0 2 0\nv 0 0 2\nv 2 0 2\nv 2 2 2\nv 0 2 2\n\
                    f 1 4 3 2\nf 5 6 7 8\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n";

/// A torus of radii 3 and 1 with `n` by `m` quadrilaterals.
fn torus(n: u32, m: u32) -> String {
    use std::f64::consts::TAU;
    let mut obj = String::new();
    for (i, j) in (0..n).flat_map(|i| (0..m).map(move |j| (i, j))) {
        let (u, v) = (TAU * f64::from(i) / f64::from(n), TAU * f64::from(j) / f64::from(m));
        let r = 3.0 + v.cos();
        obj += &format!("v {} {} {}\n", r * u.cos(), r * u.sin(), v.sin());
    }
    let id = |i: u32, j: u32| 1 + (i % n) * m + j % m;
    for (i, j) in (0..n).flat_map(|i| (0..m).map(move |j| (i, j))) {
        obj += &format!("f {} {} {} {}\n", id(i, j), id(i + 1, j), id(i + 1, j + 1), id(i, j + 1));
    }
    obj
}

fn cube() -> Folder {
    let folder = Folder::new();
    folder.write("cube.obj", CUBE);
    folder.good(&["encode", "cube.obj", "-o", "cube.tesdf", "--unit", "mm"]);
    folder
}

fn rows(csv: &str) -> Vec<Vec<f64>> {
    let number = |field: &str| if field.is_empty() { f64::NAN } else { field.parse().unwrap() };
    csv.lines().skip(1).map(|line| line.split(',').map(number).collect()).collect()
}

#[test]
fn every_preset_and_number_of_threads_is_encoded_and_verified() {
    let folder = Folder::new();
    folder.write("torus.obj", torus(24, 12));
    for preset in ["default", "fast", "compact", "gpu"] {
        let encode = |threads: &str, file: &str| {
            folder.good(&["encode", "torus.obj", "-o", file, "--preset", preset, "--threads", threads]);
            std::fs::read(folder.path(file)).unwrap()
        };
        let bytes = encode("1", "a.tesdf");
        assert!(bytes == encode("2", "b.tesdf") && bytes == encode("8", "c.tesdf"), "{preset}");
        let out = folder.good(&["verify", "a.tesdf", "--samples", "2000", "--json"]);
        let json: serde_json::Value = serde_json::from_str(&out).unwrap();
        assert_eq!((&json["passed"], &json["intact"]), (&true.into(), &true.into()), "{out}");
        assert_eq!(json["comparison"]["samples"], 2000);
        assert_eq!(json["comparison"]["precisions"][1]["sign_mistakes"], 0);
    }
}

#[test]
fn the_summary_and_inspect_agree() {
    let folder = Folder::new();
    folder.write("torus.obj", torus(24, 12));
    let args = ["encode", "torus.obj", "-o", "t.tesdf", "--band", "0.5", "--region", "-5 -5 -5 5 5 5"];
    let (code, out, err) = folder.tesdf(&[&args[..], &["--unit", "mm", "--json"]].concat());
    assert_eq!((code, err.as_str()), (Some(0), ""));
    let encoded: serde_json::Value = serde_json::from_str(&out).unwrap();
    let inspected: serde_json::Value =
        serde_json::from_str(&folder.good(&["inspect", "t.tesdf", "--json"])).unwrap();
    for key in ["options", "source", "certificate", "statistics"] {
        assert_eq!(encoded[key], inspected[key], "{key}");
    }
    assert_eq!((&inspected["unit"], &inspected["counts"]["faces"]), (&"mm".into(), &576.into()));
    assert_eq!(encoded["source"]["name"], "torus.obj");
    assert_eq!(encoded["source"]["blake3"].as_str().unwrap().len(), 64);
    assert_eq!(encoded["options"]["band"]["absolute"], 0.5);
    assert_eq!(encoded["options"]["regions"][0][5], 5.0);
    // Both commands count the same cells and entries in different ways.
    for key in ["listed_cells", "far_cells", "crossing_cells", "outside_cells", "entries"] {
        assert_eq!(inspected["counts"][key], inspected["statistics"][key], "{key}");
    }
    assert_eq!(inspected["lists"]["longest"], inspected["statistics"]["longest_list"]);
    let of = |key: &str| inspected["memory"][key].as_u64().unwrap();
    let parts = inspected["memory"]["parts"].as_array().unwrap();
    let sum: u64 = parts.iter().map(|p| p[1].as_u64().unwrap()).sum();
    assert_eq!(sum, of("whole"));
    assert_eq!(of("file"), std::fs::metadata(folder.path("t.tesdf")).unwrap().len());
    assert_eq!(of("file"), encoded["bytes"].as_u64().unwrap());
    let count = |key: &str| inspected["counts"][key].as_u64().unwrap();
    assert_eq!(of("paper"), 4 * count("entries") + 16 * count("listed_cells"));
    // The volume consists of cells with lists and cells without.
    let volume = |key: &str| inspected["statistics"][key].as_f64().unwrap();
    let share = inspected["reads"]["fallback_volume"].as_f64().unwrap();
    assert!((share - volume("far_volume") / volume("domain_volume")).abs() < 1e-9);
    let text = folder.good(&["inspect", "t.tesdf"]);
    assert!(text.contains("as in the paper") && text.contains("band") && text.contains("0.5 mm"), "{text}");
}

#[test]
fn an_output_is_replaced_in_one_step_or_left_alone() {
    let folder = Folder::new();
    folder.write("cube.obj", CUBE);
    folder.write("open.obj", CUBE.replace("f 4 1 5 8\n", ""));
    folder.write("f.tesdf", "what was here before");
    // A hard link keeps the old file, which shows that nothing was written into it.
    std::fs::hard_link(folder.path("f.tesdf"), folder.path("old")).unwrap();
    let before = folder.names();
    assert_eq!(folder.tesdf(&["encode", "open.obj", "-o", "f.tesdf"]).0, Some(2));
    let (code, _, err) = folder.tesdf(&["encode", "cube.obj", "-o", "f.tesdf", "--band", "1e300"]);
    assert!(code == Some(2) && err.contains("option band is 1e300; expected a length"), "{err}");
    assert_eq!(std::fs::read(folder.path("f.tesdf")).unwrap(), b"what was here before");
    folder.good(&["encode", "cube.obj", "-o", "f.tesdf"]);
    folder.good(&["verify", "f.tesdf", "--samples", "100"]);
    assert_eq!(std::fs::read(folder.path("old")).unwrap(), b"what was here before");
    assert_eq!(folder.names(), before);
    let (code, _, err) = folder.tesdf(&["encode", "cube.obj", "-o", "cube.obj"]);
    assert_eq!(code, Some(2));
    assert!(err.contains("is the input cube.obj itself"), "{err}");
    let (code, _, err) = folder.tesdf(&["encode", "cube.obj", "-o", "no/f.tesdf"]);
    assert_eq!(code, Some(2));
    assert!(err.contains("there is no folder no"), "{err}");
}

#[cfg(target_os = "linux")]
#[test]
fn ctrl_c_leaves_no_half_file() {
    use std::process::{Command, Stdio};
    let folder = Folder::new();
    folder.write("torus.obj", torus(160, 80));
    folder.write("f.tesdf", "what was here before");
    let child = folder
        .command(&["encode", "torus.obj", "-o", "f.tesdf", "--threads", "1"])
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    crate::folder::wait_for_handler(&child);
    assert!(Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap().success());
    let (code, out, err) = crate::folder::texts(child.wait_with_output().unwrap());
    assert_eq!((code, out.as_str()), (Some(2), ""));
    assert!(err.starts_with("error: interrupted; "), "{err}");
    assert_eq!(folder.names(), ["f.tesdf", "torus.obj"]);
    assert_eq!(std::fs::read(folder.path("f.tesdf")).unwrap(), b"what was here before");
}

#[test]
fn answers_come_in_order_with_every_digit() {
    let folder = cube();
    let numbers = [[0.1 + 0.2, 1.0, 1.0], [1.0, 1.0, 2.0 + 1e-9], [1e3, 1.0, 1.0], [5.0, 6.0, -2.0]];
    let mut csv = String::from("name,z,x,y\r\n");
    for [x, y, z] in numbers {
        csv += &format!("\"a, b\",{z:?},{x:?},{y:?}\r\n");
    }
    csv += "bad,nan,1,1\r\nworse,inf,1,1\r\n";
    folder.write("p.csv", csv);
    let (code, out, err) = folder.tesdf(&["query", "cube.tesdf", "--points", "p.csv"]);
    assert_eq!((code, err.as_str()), (Some(0), ""));
    assert!(out.starts_with("x,y,z,signed_distance,gx,gy,gz,cx,cy,cz,face\n"), "{out}");
    let rows = rows(&out);
    assert_eq!(rows.len(), 6);
    for (row, p) in rows.iter().zip(numbers) {
        assert_eq!(row[..3], p);
    }
    let expected = [-0.1 - 0.2, (2.0_f64 + 1e-9) - 2.0, 998.0, 29_f64.sqrt()];
    for (row, d) in rows.iter().zip(expected) {
        assert!((row[3] - d).abs() <= 1e-15 * d.abs(), "{} {d}", row[3]);
        // x = c + φ g, and the gradient g is a unit vector.
        for k in 0..3 {
            assert!(
                (row[k] - row[7 + k] - row[3] * row[4 + k]).abs() <= 1e-13 * row[k].abs().max(1.0),
                "{row:?}"
            );
        }
        assert!((row[4].hypot(row[5]).hypot(row[6]) - 1.0).abs() < 1e-12);
    }
    assert_eq!([rows[0][4..7].to_vec(), rows[1][4..7].to_vec()], [[-1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]);
    // Faces 2 and 3 are the two triangles of the top, which is the second polygon.
    assert!([2.0, 3.0].contains(&rows[1][10]));
    assert!(rows[4][3..].iter().chain(&rows[5][3..]).all(|v| v.is_nan()), "{out}");
    assert_eq!(out.lines().nth(5).unwrap(), "1.0,1.0,NaN,NaN,NaN,NaN,NaN,NaN,NaN,NaN,");
}

#[test]
fn bad_points_are_named() {
    let folder = cube();
    folder.write("p.csv", "x,y,z\n1,2,three\n");
    folder.write("q.csv", "x,y\n1,2\n");
    for (points, expected) in [
        ("p.csv", "p.csv: line 2, column z: \"three\""),
        ("q.csv", "q.csv: line 1: the column z"),
        ("none", "none: "),
    ] {
        let (code, out, err) = folder.tesdf(&["query", "cube.tesdf", "--points", points]);
        assert_eq!((code, out.as_str()), (Some(2), ""));
        assert!(err.starts_with(&format!("error: {expected}")), "{err}");
    }
    folder.write("empty.csv", "x,y,z\n");
    let out = folder.good(&["query", "cube.tesdf", "--points", "empty.csv"]);
    assert_eq!(out, "x,y,z,signed_distance,gx,gy,gz,cx,cy,cz,face\n");
}

#[test]
fn files_that_are_no_assets_are_named() {
    let folder = cube();
    let bytes = std::fs::read(folder.path("cube.tesdf")).unwrap();
    folder.write("p.csv", "x,y,z\n1,2,3\n");
    folder.write("empty.tesdf", "");
    folder.write("stl.tesdf", std::fs::read(data("bad/soup_unwelded.stl")).unwrap());
    folder.write("half.tesdf", &bytes[..bytes.len() / 2]);
    folder.write("short.tesdf", &bytes[..bytes.len() - 1]);
    folder.write("long.tesdf", [&bytes[..], b"x"].concat());
    for (file, expected) in [
        ("empty.tesdf", "empty"),
        ("stl.tesdf", "not a .tesdf file"),
        ("cube.obj", "not a .tesdf file"),
        ("half.tesdf", "cut short"),
        ("short.tesdf", "cut short"),
        ("long.tesdf", "1 byte follows the last section"),
        ("none.tesdf", "cannot open none.tesdf"),
    ] {
        for args in
            [&["inspect", file][..], &["query", file, "--points", "p.csv"], &["slice", file, "-o", "s.png"]]
        {
            let (code, out, err) = folder.tesdf(args);
            assert_eq!((code, out.as_str()), (Some(2), ""), "{args:?}");
            assert!(
                err.starts_with("error: ") && err.contains(file) && err.contains(expected),
                "{args:?}: {err}"
            );
        }
    }
    for file in ["empty.tesdf", "stl.tesdf", "none.tesdf"] {
        assert_eq!(folder.tesdf(&["verify", file]).0, Some(2), "{file}");
    }
    // A damaged asset fails the verification.
    for file in ["half.tesdf", "short.tesdf", "long.tesdf"] {
        let (code, out, _) = folder.tesdf(&["verify", file]);
        assert_eq!(code, Some(1), "{file}");
        assert!(out.starts_with(&format!("failed: {file}: ")), "{out}");
    }
    assert!(!folder.names().contains(&"s.png".to_string()));
}

#[test]
fn a_flipped_byte_fails_the_verification() {
    let folder = cube();
    let bytes = std::fs::read(folder.path("cube.tesdf")).unwrap();
    let header = 8 + u64::from_le_bytes(*bytes.first_chunk().unwrap()) as usize;
    // The first 32 bytes identify the kind of file, so a change there may make it another kind.
    for at in (32..bytes.len()).step_by(61).chain([header, bytes.len() - 1]) {
        let mut damaged = bytes.clone();
        damaged[at] ^= 0x10;
        folder.write("d.tesdf", &damaged);
        let (code, out, err) = folder.tesdf(&["verify", "d.tesdf", "--samples", "50"]);
        let version = err.contains("file-format version") || err.contains("not a .tesdf file");
        assert!(
            code == Some(1) || code == Some(2) && version && at < header,
            "byte {at}: {code:?} {out}{err}"
        );
        if at >= header {
            assert!(out.contains("section ") && out.contains("checksum"), "byte {at}: {out}");
        }
        // The other commands do not read every byte, but none of them may panic.
        let (code, _, err) = folder.tesdf(&["inspect", "d.tesdf"]);
        assert!(matches!(code, Some(0 | 2)) && !err.contains("bug"), "byte {at}: {err}");
    }
}

#[test]
fn a_slice_is_a_png_of_the_size_asked_for() {
    let folder = cube();
    for (axis, size) in [("x", 300), ("y", 512), ("z", 300)] {
        let size_text = size.to_string();
        let (code, out, err) = folder.tesdf(&[
            "slice",
            "cube.tesdf",
            "-o",
            "s.png",
            "--axis",
            axis,
            "--at",
            "0.4",
            "--size",
            &size_text,
        ]);
        assert_eq!((code, out.as_str(), err.as_str()), (Some(0), "", ""));
        let map = tiny_skia::Pixmap::load_png(folder.path("s.png")).unwrap();
        assert_eq!(map.width().max(map.height()), size);
        let warm = map.pixels().iter().filter(|p| i32::from(p.red()) > i32::from(p.blue()) + 20).count();
        let cold = map.pixels().iter().filter(|p| i32::from(p.blue()) > i32::from(p.red()) + 10).count();
        assert!(warm > 1000 && cold > 1000, "{axis}: {warm} {cold}");
    }
}

#[cfg(feature = "gpu")]
#[test]
fn samples_on_a_device_are_in_32_bits_and_the_file_says_so() {
    let folder = Folder::new();
    folder.write("cube.obj", CUBE);
    let encoded = |device: &str| {
        let sampled = ["--encoder", "sampled", "--resolution", "4", "--device", device, "--json"];
        let out = folder.good(&[&["encode", "cube.obj", "-o", "cube.tesdf"], &sampled[..]].concat());
        let report: serde_json::Value = serde_json::from_str(&out).unwrap();
        report["certificate"]["encoder"].as_str().unwrap().to_string()
    };
    assert_eq!(encoded("cpu"), "sampled");
    let on_device = encoded("gpu");
    assert!(on_device.starts_with("sampled, f32, "), "{on_device}");
    let (code, _, err) = folder.tesdf(&["encode", "cube.obj", "-o", "cube.tesdf", "--device", "gpu"]);
    assert_eq!(
        (code, err.trim()),
        (Some(2), "error: --device only applies to the sampled encoder; add --encoder sampled")
    );
}

#[test]
fn a_file_is_proved_or_the_exit_code_says_so() {
    let folder = cube();
    folder.write("torus.obj", torus(24, 12));
    folder.good(&["encode", "torus.obj", "-o", "torus.tesdf", "--preset", "fast"]);
    let out = folder.good(&["verify", "torus.tesdf", "--prove", "--samples", "200", "--json"]);
    let json: serde_json::Value = serde_json::from_str(&out).unwrap();
    let prove = &json["prove"];
    assert_eq!((&json["passed"], &prove["proved"]), (&true.into(), &true.into()), "{out}");
    assert_eq!(prove["distances"]["proved"], prove["distances"]["claims"]);
    assert!(prove["pieces"].as_u64() > Some(100) && prove["faults"] == serde_json::json!([]));

    let (code, out, _) =
        folder.tesdf(&["verify", "torus.tesdf", "--prove", "--pieces", "1", "--samples", "200"]);
    assert_eq!(code, Some(1), "{out}");
    assert!(out.contains("NOT everything is proved") && out.ends_with("not passed\n"), "{out}");
    assert!(out.contains("undecided: cell ") && out.contains("--pieces"), "{out}");

    let without = folder.good(&["verify", "cube.tesdf", "--samples", "20", "--json"]);
    assert!(serde_json::from_str::<serde_json::Value>(&without).unwrap()["prove"].is_null());
    let (code, _, err) = folder.tesdf(&["verify", "cube.tesdf", "--pieces", "5"]);
    assert_eq!(code, Some(2), "{err}");
}
