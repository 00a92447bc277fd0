//! Detection, clearances, files of poses and of recorded runs: their figures and their errors.
use std::ops::ControlFlow;

use serde_json::Value;
use tesdf::Encoder;
use tesdf::encode::Preset;
use tesdf_sim::scene_file::LoadedScene;
use tesdf_sim::simulate;

use crate::folder::{Folder, data, scene};

/// A cube with edges of length 2 and a corner at the origin, as a mesh and as an asset.
fn cube() -> Folder {
    let folder = Folder::new();
    let text = "v 0 0 0\nv 2 0 0\nv 2 2 0\nv 0 2 0\nv 0 0 2\nv 2 0 2\nv 2 2 2\nv 0 2 2\n\
                f 1 4 3 2\nf 5 6 7 8\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n";
    folder.write("c.obj", text);
    let asset = Encoder::new().preset(Preset::Fast).encode_file(folder.path("c.obj")).unwrap();
    asset.save(folder.path("c.tesdf")).unwrap();
    folder
}

fn json(folder: &Folder, args: &[&str]) -> Value {
    serde_json::from_str(&folder.good(args)).unwrap()
}

#[test]
fn benchmarks_of_clearances_and_pairs_print_their_figures() {
    let folder = cube();
    let pairs = json(&folder, &["clearance", "c.tesdf", "c.obj", "--pairs", "3", "--json"]);
    let pairs = pairs.as_array().unwrap();
    assert_eq!(pairs.len(), 3);
    for pair in pairs {
        assert!(pair["distance"].as_f64() < Some(0.0) && pair["converged"] == true, "{pair}");
        assert!(pair["lower_bound"].as_f64() <= pair["distance"].as_f64(), "{pair}");
    }
    let text = folder.good(&["clearance", "c.tesdf", "--pairs", "3"]);
    assert!(text.contains("3 pairs, 3 overlap, 0 not converged"), "{text}");
    let text = folder.good(&["heap", "--bodies", "20", "--steps", "2"]);
    assert_eq!(text.lines().filter(|line| line.starts_with("| 20 |")).count(), 4, "{text}");
    let poses = [[0.5, 0.5, 1.5, 0.0, 0.0, 0.0, 1.0], [0.0, 0.0, 9.0, 0.0, 0.0, 0.0, 1.0]];
    let bytes: Vec<u8> = poses.as_flattened().iter().flat_map(|x: &f64| x.to_le_bytes()).collect();
    folder.write("poses", &bytes);
    let worlds = json(&folder, &["worlds", "c.tesdf", "c.tesdf", "--poses", "poses"]);
    assert!(worlds["contacts"].as_u64() > Some(0) && worlds["least"].as_f64() < Some(0.0), "{worlds}");
    folder.write("poses", &bytes[1..]);
    let (code, _, error) = folder.lab(&["worlds", "c.tesdf", "c.tesdf", "--poses", "poses"]);
    assert!(code == Some(2) && error.contains("111 bytes; expected a multiple of 56"), "{error}");
}

#[test]
fn refused_runs_and_poses_name_the_command_that_writes_them() {
    let folder = Folder::new();
    for (file, expected) in
        [("r.tesrun", "`tesdf simulate` writes runs"), ("p.json", "`tesdf-lab poses` writes files of poses")]
    {
        for bytes in ["", "x", "{}", "\u{10}\0\0\0\0\0\0\0{\"a\":1}        "] {
            folder.write(file, bytes);
            let (code, out, err) = folder.lab(&["collide", file, "--device", "cpu"]);
            assert_eq!((code, out.as_str()), (Some(2), ""), "{file}");
            assert!(err.starts_with(&format!("error: {file}: ")) && err.contains(expected), "{err}");
        }
    }
}

#[cfg(feature = "gpu")]
#[test]
fn a_benchmark_reports_its_worlds_frames_and_stages() {
    let folder = Folder::new();
    let poses = format!(
        r#"{{"tesdf_poses": 1, "contact_distance": 1e-3, "bodies": ["{0}", "{0}"], "instances": [[0, 0], [1, 0]],
            "frames": [[[0, 0, 0, 0, 0, 0, 1], [0.011, 0, 0, 0, 0, 0, 1]], [[0, 0, 0, 0, 0, 0, 1], [0.013, 0, 0, 0, 0, 0, 1]]]}}"#,
        data("procedural/cube.obj")
    );
    folder.write("poses.json", poses);
    let more = ["--worlds", "3", "--repeat", "1", "--against-cpu", "--json"];
    let report = json(&folder, &[&["collide", "poses.json"], &more[..]].concat());
    assert_eq!(
        (&report["worlds"], &report["instances"], &report["frames"]),
        (&3.into(), &6.into(), &2.into())
    );
    assert_eq!(report["counts"]["directions"]["mean"], 6.0);
    assert!(report["counts"]["contacts"]["mean"].as_f64() > Some(10.0), "{report}");
    assert!(
        report["counts"]["queries"]["mean"].as_f64() <= report["counts"]["queries_unpruned"]["mean"].as_f64()
    );
    let stages = report["stages"].as_array().expect("stages");
    assert_eq!(report["launches"].as_u64(), Some(stages.len() as u64));
    assert!(report["cpu_over_device"].as_f64() > Some(0.0));
    let text = folder.good(&["collide", "poses.json", "--repeat", "1", "--mode", "node"]);
    assert!(text.contains("BP / MP / NP") && text.contains("without pruning"), "{text}");

    for mode in ["node", "exact"] {
        let few = ["collide", "poses.json", "--repeat", "1", "--mode", mode, "--reduce", "4", "--json"];
        let report = json(&folder, &few);
        let counts = &report["counts"];
        assert!(counts["kept"]["max"].as_f64() <= Some(4.0), "{counts}");
        assert!(counts["contacts"]["mean"].as_f64() > counts["kept"]["mean"].as_f64(), "{counts}");
        let bytes = &report["bytes"];
        let buffers = bytes["products_by_buffer"].as_array().expect("buffers").iter();
        let products: u64 = buffers.map(|b| b[1].as_u64().expect("bytes")).sum();
        assert_eq!(bytes["products"].as_u64(), Some(products));
        let shapes =
            ["shapes_table", "shapes_words", "shapes_rows"].map(|k| bytes[k].as_u64().expect("bytes"));
        let instances = 2 * bytes["per_instance"].as_u64().expect("bytes");
        assert_eq!(bytes["total"].as_u64(), Some(products + shapes.iter().sum::<u64>() + instances));
    }

    folder.good(&["poses", "shafts", "--frames", "2", "-o", "shafts.json"]);
    let shafts = folder.json("shafts.json");
    assert_eq!(shafts["frames"][1].as_array().map(Vec::len), Some(128));
    folder.write(
        "bad.json",
        r#"{"tesdf_poses": 7, "contact_distance": 0, "bodies": [], "instances": [], "frames": []}"#,
    );
    let (code, _, err) = folder.lab(&["collide", "bad.json"]);
    assert_eq!(code, Some(2));
    assert!(err.contains("version 7; this build reads 1"), "{err}");
}

#[test]
fn a_file_of_poses_is_bounded() {
    let folder = Folder::new();
    let instances = vec!["[0,0]"; 65_537].join(",");
    let poses = |instances: &str| {
        format!(
            r#"{{"tesdf_poses":1,"contact_distance":0.0,"bodies":[],"instances":[{instances}],"frames":[]}}"#
        )
    };
    folder.write("p.json", poses(&instances));
    let (code, _, err) = folder.lab(&["collide", "p.json", "--device", "cpu"]);
    assert!(
        code == Some(2) && err.contains("0 bodies, 65537 instances; expected at most 65536 each"),
        "{err}"
    );
    assert!(err.ends_with("hint: `tesdf-lab poses` writes files of poses\n"), "{err}");
}

#[test]
fn recordings_are_refused_with_another_scene() {
    let folder = Folder::new();
    let mut loaded = LoadedScene::read(scene("stack.toml")).unwrap();
    loaded.scene.duration = 0.02;
    let mut engine = loaded.newton(loaded.system().unwrap()).unwrap();
    let (run, _) = simulate(&loaded.scene, &mut engine, |_| ControlFlow::Continue(())).unwrap();
    run.save(folder.path("run.tesrun")).unwrap();
    let record = |name: &str, output: &str| {
        folder.lab(&["record", "run.tesrun", "--scene", &scene(name), "--frames", "3", "-o", output])
    };
    assert_eq!(record("stack.toml", "poses.json").0, Some(0));
    assert_eq!(folder.json("poses.json")["frames"].as_array().unwrap().len(), 3);
    let (code, _, err) = record("chain.toml", "other.json");
    assert_eq!(code, Some(2));
    assert!(err.contains("its bodies are not those of run.tesrun"), "{err}");
}

#[test]
fn options_that_ask_for_too_much_are_bad_usage() {
    let folder = Folder::new();
    for (args, expected) in [
        (&["poses", "shafts", "-o", "p.json", "--frames", "1000000000"][..], "--frames <N>"),
        (&["collide", "s.toml", "--repeat", "1000000000"], "--repeat <N>"),
        (&["table1", "--grid", "0"], "--grid <N>"),
    ] {
        let (code, out, err) = folder.lab(args);
        assert_eq!((code, out.as_str()), (Some(2), ""), "{args:?}: {err}");
        assert!(err.contains(expected), "{args:?}: {err}");
    }
    let many = ["collide", &scene("stack.toml"), "--device", "cpu", "--worlds", "4000000000"];
    let (code, _, err) = folder.lab(&many);
    assert!(code == Some(2) && err.contains("--worlds 4000000000 makes"), "{err}");
}
