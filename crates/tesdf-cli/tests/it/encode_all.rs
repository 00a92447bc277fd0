//! `tesdf encode-all`: nothing is lost, repeated or half written.

use std::collections::BTreeMap;
use std::fs;
use std::process::{Child, Command, Stdio};
use std::time::Duration;

use crate::folder::{Folder, block, data, texts};
use serde_json::Value;
use tesdf::TeSdf;

/// `count` blocks of cubes, all different, half of them in a folder below.
fn blocks(count: u32, cubes: u32) -> Folder {
    let folder = Folder::new();
    fs::create_dir_all(folder.path("parts/below")).unwrap();
    for k in 0..count {
        let side = if k % 2 == 0 { "parts" } else { "parts/below" };
        folder.write(&format!("{side}/block {k}.obj"), block(cubes) + &format!("# {k}\n"));
    }
    folder.write("parts/readme.txt", "no mesh");
    folder
}

const ALL: [&str; 6] = ["encode-all", "parts", "-o", "out", "--preset", "fast"];

/// The assets in a folder. There is nothing else but manifests and times.
fn assets(folder: &Folder, out: &str) -> BTreeMap<String, Vec<u8>> {
    let mut assets = BTreeMap::new();
    for entry in fs::read_dir(folder.path(out)).unwrap() {
        let name = entry.unwrap().file_name().into_string().unwrap();
        if name.ends_with(".tesdf") {
            let bytes = fs::read(folder.path(out).join(&name)).unwrap();
            assets.insert(name, bytes);
        } else {
            let known = name.starts_with("manifest") || name.starts_with("times");
            assert!(known && name.ends_with(".json"), "{name}");
        }
    }
    assets
}

fn json(folder: &Folder, name: &str) -> Value {
    serde_json::from_slice(&fs::read(folder.path(name)).unwrap()).unwrap()
}

/// How many meshes were in each state: encoded, present, failed.
fn states(folder: &Folder, name: &str) -> [usize; 3] {
    let times = json(folder, name);
    let all = times["meshes"].as_array().unwrap();
    ["encoded", "present", "failed"].map(|state| all.iter().filter(|mesh| mesh["state"] == state).count())
}

/// Starts the command, and waits until it has written `count` assets.
fn start(folder: &Folder, count: usize) -> Child {
    let mut command = folder.command(&[&ALL[..], &["--jobs", "2"]].concat());
    let child = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    let is_asset = |entry: &fs::DirEntry| entry.path().extension().is_some_and(|e| e == "tesdf");
    let written = |out: fs::ReadDir| out.filter(|entry| is_asset(entry.as_ref().unwrap())).count();
    while fs::read_dir(folder.path("out")).map_or(0, written) < count {
        std::thread::sleep(Duration::from_millis(1));
    }
    child
}

#[test]
fn bad_meshes_stop_nothing_and_good_ones_are_encoded_as_alone() {
    let folder = Folder::new();
    let bad = data("bad");
    let (code, out, err) =
        folder.tesdf(&["encode-all", &bad, "-o", "out", "--preset", "fast", "--unit", "mm"]);
    assert_eq!(code, Some(1), "{err}");
    let manifest = json(&folder, "out/manifest.json");
    let made = assets(&folder, "out");
    let entries = manifest["meshes"].as_array().unwrap();
    let files = fs::read_dir(&bad).unwrap().filter(|file| {
        let name = file.as_ref().unwrap().file_name().into_string().unwrap();
        !name.ends_with(".tsv")
    });
    assert_eq!(entries.len(), files.count());
    let mut failed = 0;
    for entry in entries {
        let mesh = format!("{bad}/{}", entry["mesh"].as_str().unwrap());
        let (code, _, alone) =
            folder.tesdf(&["encode", &mesh, "-o", "one.tesdf", "--preset", "fast", "--unit", "mm"]);
        if let Some(error) = entry["error"].as_str() {
            assert_eq!((code, entry.as_object().unwrap().len()), (Some(2), 2), "{mesh}");
            assert!(alone.starts_with(&format!("error: {error}")), "{error}\n{alone}");
            failed += 1;
            continue;
        }
        assert_eq!(code, Some(0), "{mesh}: {alone}");
        let bytes = &made[entry["asset"].as_str().unwrap()];
        assert!(*bytes == fs::read(folder.path("one.tesdf")).unwrap(), "{mesh}");
        let asset = TeSdf::from_bytes(bytes).unwrap();
        assert_eq!(entry["mesh_blake3"], asset.about().source.blake3);
        assert_eq!(entry["faces"], asset.face_count());
        assert_eq!(entry["bytes"], bytes.len());
        assert_eq!(entry["certificate"], serde_json::to_value(asset.about().certificate()).unwrap());
        assert_eq!(manifest["options"], serde_json::to_value(&asset.about().options).unwrap());
    }
    let good = entries.len() - failed;
    assert!(good > 20 && failed > 20);
    assert_eq!((&manifest["assets"], &manifest["failed"]), (&good.into(), &failed.into()));
    assert_eq!(manifest["bytes"], made.values().map(Vec::len).sum::<usize>());
    assert!(out.contains(&format!("encoded   {good} now, 0 before\n")), "{out}");
    assert!(out.contains(&format!("failed    {failed}\n")), "{out}");
    assert_eq!(err.lines().count(), 11, "ten messages and their number: {err}");
    assert!(err.contains(&format!("... {failed} in all; out/manifest.json lists them")), "{err}");
}

#[test]
fn assets_that_are_there_and_whole_are_not_made_again() {
    let folder = blocks(6, 1);
    folder.good(&ALL);
    let (made, manifest) = (assets(&folder, "out"), fs::read(folder.path("out/manifest.json")).unwrap());
    assert_eq!((made.len(), states(&folder, "out/times.json")), (6, [6, 0, 0]));
    let names: Vec<_> = made.keys().cloned().collect();
    let out = folder.good(&[&ALL[..], &["--threads", "1", "--json"]].concat());
    let report: Value = serde_json::from_str(&out).unwrap();
    assert_eq!((&report["encoded"], &report["present"]), (&0.into(), &6.into()));
    assert_eq!(states(&folder, "out/times.json"), [0, 6, 0]);

    // A changed byte, a file that was cut, an asset under the name of another one, and no file.
    let mut changed = made[&names[0]].clone();
    *changed.last_mut().unwrap() ^= 1;
    folder.write(&format!("out/{}", names[0]), changed);
    folder.write(&format!("out/{}", names[1]), &made[&names[1]][..1000]);
    folder.write(&format!("out/{}", names[2]), &made[&names[3]]);
    fs::remove_file(folder.path("out").join(&names[4])).unwrap();
    folder.good(&ALL);
    assert_eq!(states(&folder, "out/times.json"), [4, 2, 0]);
    assert!(assets(&folder, "out") == made);
    assert!(fs::read(folder.path("out/manifest.json")).unwrap() == manifest);

    // Another mesh under a known name, and other options.
    folder.write("parts/block 0.obj", block(2));
    folder.good(&ALL);
    assert_eq!((assets(&folder, "out").len(), states(&folder, "out/times.json")), (7, [1, 5, 0]));
    for more in [&["--unit", "mm"][..], &["--band", "2"], &["--e-max", "4"]] {
        folder.good(&[&ALL[..], more].concat());
        assert_eq!(states(&folder, "out/times.json"), [6, 0, 0], "{more:?}");
    }
    assert_eq!(assets(&folder, "out").len(), 7 + 18);
}

#[test]
fn jobs_and_threads_change_no_byte() {
    let folder = blocks(7, 2);
    let mut found = Vec::new();
    for (out, jobs, threads) in [("a", "1", "1"), ("b", "3", "8"), ("c", "16", "2")] {
        let args =
            ["encode-all", "parts", "-o", out, "--preset", "fast", "--jobs", jobs, "--threads", threads];
        folder.good(&args);
        found.push((assets(&folder, out), fs::read(folder.path(out).join("manifest.json")).unwrap()));
    }
    assert_eq!(found[0].0.len(), 7);
    assert!(found.iter().all(|one| *one == found[0]));
}

#[test]
fn the_shards_together_are_all() {
    let folder = blocks(20, 1);
    folder.good(&ALL);
    let whole = assets(&folder, "out");
    let mut union = BTreeMap::new();
    let mut entries = Vec::new();
    for shard in ["1/3", "2/3", "3/3"] {
        let out = format!("only {}", &shard[..1]);
        folder.good(&["encode-all", "parts", "-o", &out, "--preset", "fast", "--shard", shard]);
        let part = assets(&folder, &out);
        let manifest = json(&folder, &format!("{out}/manifest-{}-of-3.json", &shard[..1]));
        assert_eq!(manifest["shard"][1], 3);
        assert_eq!(manifest["assets"], part.len());
        assert!(!part.is_empty() && part.len() < whole.len());
        entries.extend(manifest["meshes"].as_array().unwrap().clone());
        union.extend(part);
        folder.good(&["encode-all", "parts", "-o", "shared", "--preset", "fast", "--shard", shard]);
    }
    assert!(union == whole && assets(&folder, "shared") == whole);
    entries.sort_by_key(|entry| entry["mesh"].as_str().unwrap().to_string());
    assert_eq!(json(&folder, "out/manifest.json")["meshes"], Value::from(entries));
    // The manifest of all shards.
    folder.good(&["encode-all", "parts", "-o", "shared", "--preset", "fast"]);
    assert_eq!(states(&folder, "shared/times.json"), [0, 20, 0]);
    assert!(
        fs::read(folder.path("shared/manifest.json")).unwrap()
            == fs::read(folder.path("out/manifest.json")).unwrap()
    );
}

#[test]
fn two_processes_share_a_folder() {
    let folder = blocks(40, 1);
    folder.good(&["encode-all", "parts", "-o", "alone", "--preset", "fast"]);
    let run = || folder.command(&ALL).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    for child in [run(), run(), run()] {
        let (code, _, err) = texts(child.wait_with_output().unwrap());
        assert_eq!((code, err.as_str()), (Some(0), ""));
    }
    assert!(assets(&folder, "out") == assets(&folder, "alone"));
    let [shared, alone] =
        ["out", "alone"].map(|out| fs::read(folder.path(out).join("manifest.json")).unwrap());
    assert!(shared == alone);
}

#[test]
fn a_killed_run_is_resumed() {
    let folder = blocks(60, 4);
    folder.good(&["encode-all", "parts", "-o", "alone", "--preset", "fast"]);
    let whole = assets(&folder, "alone");
    for written in [2, 10, 25] {
        let mut child = start(&folder, written);
        child.kill().unwrap();
        child.wait().unwrap();
        // All that has the name of an asset is whole. Files that were being written have other
        // names, and the next run removes them.
        for entry in fs::read_dir(folder.path("out")).unwrap() {
            let name = entry.unwrap().file_name().into_string().unwrap();
            match whole.get(&name) {
                Some(bytes) => assert!(fs::read(folder.path("out").join(&name)).unwrap() == *bytes, "{name}"),
                None => assert!(name.starts_with(".tesdf-") && name.ends_with(".part"), "{name}"),
            }
        }
    }
    folder.good(&ALL);
    let [encoded, present, failed] = states(&folder, "out/times.json");
    assert!(present >= 25 && encoded > 0 && encoded + present == 60 && failed == 0, "{encoded} {present}");
    assert!(assets(&folder, "out") == whole);
}

#[cfg(unix)]
#[test]
fn ctrl_c_keeps_the_assets_and_says_how_to_continue() {
    let folder = blocks(60, 4);
    let child = start(&folder, 5);
    assert!(Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap().success());
    let (code, out, err) = texts(child.wait_with_output().unwrap());
    assert_eq!((code, out.as_str()), (Some(2), ""), "{err}");
    let made = assets(&folder, "out");
    let expected = format!(
        "error: interrupted; {} of 60 meshes are done\nhint: the same command encodes the others\n",
        made.len()
    );
    assert_eq!(err, expected);
    assert!((5..60).contains(&made.len()) && made.values().all(|bytes| TeSdf::from_bytes(bytes).is_ok()));
    folder.good(&ALL);
    assert_eq!(states(&folder, "out/times.json"), [60 - made.len(), made.len(), 0]);
}

#[test]
fn a_list_names_meshes_one_a_line() {
    let folder = blocks(4, 1);
    fs::create_dir(folder.path("a folder.obj")).unwrap();
    let list =
        "parts/block 0.obj\r\n\nparts/below/block 1.obj\nparts/block 0.obj\nnone.stl\na folder.obj\nx.txt\n";
    folder.write("list.txt", list);
    let (code, _, err) = folder.tesdf(&["encode-all", "list.txt", "-o", "new/out", "--preset", "fast"]);
    assert_eq!(code, Some(1), "{err}");
    let manifest = json(&folder, "new/out/manifest.json");
    let found: Vec<_> = manifest["meshes"]
        .as_array()
        .unwrap()
        .iter()
        .map(|entry| (entry["mesh"].as_str().unwrap(), entry["error"].as_str().unwrap_or("")))
        .collect();
    let [folder_named, text, missing] =
        ["a folder.obj is not a file; expected a mesh file", "x.txt", "cannot read none.stl: "];
    assert_eq!(found.len(), 5);
    assert_eq!(found[0], ("a folder.obj", folder_named));
    assert!(found[1].0 == "none.stl" && found[1].1.starts_with(missing), "{:?}", found[1]);
    assert_eq!(found[2..4], [("parts/below/block 1.obj", ""), ("parts/block 0.obj", "")]);
    assert!(found[4].0 == "x.txt" && found[4].1.contains(text), "{:?}", found[4]);
    assert_eq!(assets(&folder, "new/out").len(), 2);
}

#[test]
fn what_cannot_be_done_is_said_before_the_work() {
    let folder = blocks(1, 1);
    fs::create_dir(folder.path("empty")).unwrap();
    folder.write("empty.txt", "\n");
    folder.write("bytes.txt", b"\xff");
    for (args, expected) in [
        (
            &["empty", "-o", "out"][..],
            "error: empty has no mesh; expected STL, OBJ, PLY, OFF, glTF, GLB, 3MF",
        ),
        (&["empty.txt", "-o", "out"], "error: empty.txt has no mesh"),
        (&["none", "-o", "out"], "error: cannot read none: "),
        (&["bytes.txt", "-o", "out"], "error: cannot read bytes.txt: line 1 is not UTF-8"),
        (
            &["parts/block 0.obj", "-o", "out"],
            "error: parts/block 0.obj is a mesh; expected a folder or a list",
        ),
        (&["parts", "-o", "empty.txt"], "error: cannot make the folder empty.txt: "),
        (&["parts", "-o", "out", "--shard", "3/2"], "expected I/N with I from 1 to N, such as 2/4"),
        (&["parts", "-o", "out", "--domain", "beam.node"], "the tetrahedra of a file belong to one mesh"),
        (&["parts", "-o", "out", "--plain"], "the bisection domain is nothing but bisections"),
    ] {
        let (code, out, err) = folder.tesdf(&[&["encode-all"], args].concat());
        assert_eq!((code, out.as_str()), (Some(2), ""), "{args:?}");
        assert!(err.contains(expected), "{args:?}: {err}");
        assert!(!folder.path("out").exists(), "{args:?}");
    }
}
