//! Faults of the system: calls of the C library fail. The tool ends with an error that names the
//! file and the reason, or it did all of its work; no file is half written.
use std::collections::BTreeMap;
use std::fs::{self, FileTimes};
use std::process::Stdio;
use std::time::{Duration, SystemTime};

mod bench;
#[allow(dead_code)]
#[path = "../../../../tesdf/tests/it/support/rotation.rs"]
mod rotation;

use crate::folder::{Folder, block, texts};
use crate::outputs::SCENE;
use bench::{Bench, MOST, Writer};
use rotation::of_the_day;

/// A scene whose run records contacts.
fn scene() -> String {
    format!("{SCENE}\n[record]\ncontacts_every = 1\n")
}

/// A tetrahedron, and another over one of its faces.
const JSON: &str = r#"{
    "surface_nodes": [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], "inner_nodes": [], "outer_nodes": [[1, 1, 1]],
    "faces": [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]],
    "surface_inner_tetras": [[0, 1, 3, 2]], "inner_tetras": [],
    "surface_outer_tetras": [[1, 2, 3, 4]], "outer_tetras": [],
    "encoded_faces_surface_inner": [[0, 1, 2, 3]], "encoded_faces_inner": [],
    "encoded_faces_surface_outer": [[2]], "encoded_faces_outer": []
}"#;

const ENCODE: Writer = Writer { args: &["encode", "cube.obj", "--preset", "fast"], output: "out.tesdf" };
const SIMULATE: Writer = Writer { args: &["simulate", "scene.toml"], output: "out.tesrun" };
/// The other commands that write one file.
const OTHERS: [Writer; 8] = [
    Writer { args: &["repair", "cube.obj"], output: "out.ply" },
    Writer { args: &["part", "peg"], output: "out.stl" },
    Writer { args: &["import", "a.json"], output: "out.tesdf" },
    Writer { args: &["export", "json.tesdf"], output: "out.json" },
    Writer { args: &["slice", "a.tesdf", "--size", "256"], output: "out.png" },
    Writer { args: &["render", "a.tesdf", "--size", "32x32"], output: "out.png" },
    Writer { args: &["view", "run.tesrun"], output: "out.html" },
    Writer { args: &["export", "run.tesrun"], output: "out.glb" },
];

const KINDS: [&str; 10] =
    ["write", "read", "open", "create", "sync", "stat", "change", "remove", "map", "rights"];

fn workplace() -> Bench {
    let bench = Bench::new();
    let folder = &bench.folder;
    folder.write("cube.obj", block(1));
    folder.write("scene.toml", scene());
    folder.write("a.json", JSON);
    folder.good(&["encode", "cube.obj", "-o", "a.tesdf", "--preset", "fast"]);
    folder.good(&["import", "a.json", "-o", "json.tesdf"]);
    folder.good(&["simulate", "scene.toml", "-o", "run.tesrun"]);
    bench
}

#[test]
fn a_fault_while_encoding_leaves_the_old_file_or_the_new_file() {
    workplace().try_files(ENCODE, &KINDS);
}

#[test]
fn a_fault_in_a_run_leaves_its_steps_so_far() {
    workplace().try_files(SIMULATE, &KINDS);
}

#[test]
fn a_fault_in_any_command_leaves_the_old_file_or_the_new_file() {
    let bench = workplace();
    for writer in OTHERS {
        bench.try_files(writer, &["write", "open", "create", "sync", "map", "rights"]);
    }
}

/// Commands whose result is what they print.
#[test]
fn a_fault_while_reading_prints_nothing_wrong() {
    let bench = workplace();
    bench.folder.write("points.csv", "x,y,z\n0,0,0.1\n2,0,0\n");
    for args in [
        &["check", "cube.obj"][..],
        &["inspect", "a.tesdf"],
        &["query", "a.tesdf", "--points", "points.csv"],
        &["verify", "a.tesdf", "--samples", "100"],
        &["collide", "a.tesdf", "a.tesdf", "--pose-b", "0 0 0.9 0 0 0 1"],
        &["clearance", "a.tesdf", "a.tesdf", "--pose-b", "0 0 2 0 0 0 1"],
    ] {
        let whole = bench.folder.good(args);
        for kind in ["read", "open", "map", "thread", "write"] {
            for number in of_the_day(1..MOST) {
                let ended = bench.run(args, &format!("{kind} {number} from"));
                let same = String::from_utf8_lossy(&ended.out) == whole;
                assert!(
                    same || ended.code != Some(0) && !ended.err.is_empty(),
                    "{args:?}, {kind} {number}: {ended:?}"
                );
                if !ended.hit {
                    break;
                }
            }
        }
    }
}

/// The system refuses the first thread, the second one, and so on.
#[test]
fn a_thread_that_cannot_be_started_is_an_error_or_costs_time() {
    let bench = workplace();
    for writer in OTHERS.into_iter().chain([ENCODE, SIMULATE]) {
        let whole = bench.whole(writer);
        for how in ["once", "from"] {
            for number in 1..MOST {
                let ended = bench.try_fault(writer, &format!("thread {number} {how}"), &whole);
                let why = ["cannot start threads: ", "cannot handle Ctrl-C: "];
                let said = why.iter().any(|why| ended.err.contains(why));
                assert!(ended.code == Some(0) || said, "{:?}, thread {number}: {ended:?}", writer.args);
                if !ended.hit {
                    break;
                }
            }
        }
    }
}

/// The system refuses memory once, and from then on.
#[test]
fn memory_that_is_refused_is_an_error() {
    let bench = workplace();
    for writer in [ENCODE, SIMULATE, OTHERS[5]] {
        let whole = bench.whole(writer);
        let growing = std::iter::successors(Some(1_u32), |number| Some(number + number.div_ceil(12)));
        let numbers: Vec<u32> = growing.take_while(|&number| number < 10_000_000).collect();
        let mut misses = 0;
        for number in of_the_day(numbers) {
            for how in ["once", "from"] {
                misses +=
                    u32::from(!bench.try_fault(writer, &format!("allocate {number} {how}"), &whole).hit);
            }
            if misses > 2 {
                break;
            }
        }
        assert!(misses > 0, "{:?}", writer.args);
    }
}

/// The assets and the manifest in a folder; other files are unfinished writes.
fn encoded(folder: &Folder) -> BTreeMap<String, Vec<u8>> {
    let entries = fs::read_dir(folder.path("all")).into_iter().flatten().map(|entry| entry.unwrap().path());
    let files = entries
        .map(|path| (path.file_name().unwrap().to_string_lossy().into_owned(), fs::read(path).unwrap()));
    files.filter(|(name, _)| name != "times.json").collect()
}

const ALL: [&str; 8] = ["encode-all", "meshes", "-o", "all", "--preset", "fast", "--threads", "2"];

/// A folder with two meshes.
fn meshes() -> Bench {
    let bench = Bench::new();
    fs::create_dir(bench.folder.path("meshes")).unwrap();
    for name in ["a", "b"] {
        bench.folder.write(&format!("meshes/{name}.obj"), block(1) + "# " + name);
    }
    bench
}

#[test]
fn a_fault_in_one_of_many_meshes_is_in_the_manifest_or_an_error() {
    let bench = meshes();
    bench.folder.good(&ALL);
    let whole = encoded(&bench.folder);
    assert_eq!(whole.len(), 3);
    for kind in ["write", "read", "open", "create", "sync", "thread"] {
        for number in of_the_day(1..MOST) {
            fs::remove_dir_all(bench.folder.path("all")).unwrap();
            let fault = format!("{kind} {number} once");
            let ended = bench.run(&ALL, &fault);
            let found = encoded(&bench.folder);
            for (name, bytes) in found.iter().filter(|(name, _)| *name != "manifest.json") {
                assert!(whole.get(name) == Some(bytes), "{fault}: {name}");
            }
            match ended.code {
                Some(0) => assert!(found == whole, "{fault}: {ended:?}"),
                Some(1) => {
                    let manifest = String::from_utf8(found["manifest.json"].clone()).unwrap();
                    assert!(manifest.contains("\"error\": "), "{fault}: {manifest}");
                }
                _ => {}
            }
            bench.folder.good(&ALL);
            assert!(encoded(&bench.folder) == whole, "{fault}");
            if !ended.hit {
                break;
            }
        }
    }
}

/// Neither the clock nor the times of files tell what is up to date.
#[test]
fn a_clock_that_goes_back_changes_nothing() {
    let bench = meshes();
    bench.folder.good(&ALL);
    let whole = encoded(&bench.folder);
    let at = |mesh: &str, time| {
        let file = fs::File::options().append(true).open(bench.folder.path(mesh)).unwrap();
        file.set_times(FileTimes::new().set_modified(time)).unwrap();
    };
    let now = SystemTime::now();
    let year = Duration::from_secs(365 * 86_400);
    at("meshes/a.obj", now + year);
    let states = || {
        let times = fs::read_to_string(bench.folder.path("all/times.json")).unwrap();
        ["\"encoded\"", "\"present\""].map(|state| times.matches(state).count())
    };
    let ended = bench.run(&ALL, "clock 1 from");
    assert_eq!((ended.code, states()), (Some(0), [0, 2]), "{ended:?}");
    assert!(encoded(&bench.folder) == whole);
    // Another mesh, older than its asset.
    bench.folder.write("meshes/a.obj", block(1) + "# c");
    at("meshes/a.obj", now - year);
    let ended = bench.run(&ALL, "clock 1 from");
    assert_eq!((ended.code, states()), (Some(0), [1, 1]), "{ended:?}");
    assert_eq!(encoded(&bench.folder).len(), 4);
    // A run, whose steps are timed.
    bench.folder.write(
        "scene.toml",
        scene().replace("asset = \"a.tesdf\"", "mesh = \"meshes/b.obj\"").replace("cube.obj", "meshes/a.obj"),
    );
    let whole = bench.whole(SIMULATE);
    for number in of_the_day(1..20) {
        assert_eq!(bench.try_fault(SIMULATE, &format!("clock {number} from"), &whole).code, Some(0));
    }
}

/// Meshes that are kept from run to run: a fault costs time, or it is an error of the run.
#[test]
fn a_fault_in_the_cache_of_meshes_leaves_it_usable() {
    let mut bench = workplace();
    let whole = bench.whole(SIMULATE);
    bench.cache = "kept";
    let run = |fault: &str| {
        let ended = bench.run(&[SIMULATE.args, &["-o", "out.tesrun"]].concat(), fault);
        let right = ended.code == Some(0) && fs::read(bench.folder.path("out.tesrun")).unwrap() == whole;
        assert!(right || ended.code == Some(2), "{fault}: {ended:?}");
        ended
    };
    for kind in ["write", "read", "open", "create", "sync", "stat", "change", "map"] {
        for number in of_the_day(1..MOST) {
            let fault = format!("{kind} {number} once");
            let _ = fs::remove_dir_all(bench.folder.path("kept"));
            // The fault meets a cache that is made, one that is there, and none.
            let mut ended = run(&fault);
            for (fault, is_kept) in [("none", false), (&*fault, false), ("none", true)] {
                let next = run(fault);
                assert!(fault != "none" || next.code == Some(0), "{kind} {number}: {next:?}");
                assert!(!is_kept || !next.err.contains("encoded"), "{kind} {number}: {next:?}");
                ended.hit |= next.hit;
            }
            if !ended.hit {
                break;
            }
        }
    }
}

/// Two commands at once write one file: it is whole, of one or the other.
#[test]
fn two_writers_leave_one_whole_file() {
    let folder = Folder::new();
    let commands = |a: [&'static str; 4], b: [&'static str; 4]| {
        let whole = [a, b].map(|args| {
            folder.good(&args);
            fs::read(folder.path(args[3])).unwrap()
        });
        let before = folder.names();
        for round in 0..6 {
            let children = [a, b].map(|args| {
                folder.command(&args).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap()
            });
            let ended = children.map(|child| texts(child.wait_with_output().unwrap()));
            for (code, out, err) in &ended {
                let refused = *code == Some(2) && err.contains("another process is writing ");
                assert!(*code == Some(0) || refused, "{round}: {code:?} {out} {err}");
            }
            assert!(ended.iter().any(|ended| ended.0 == Some(0)), "{round}: {ended:?}");
            assert!(whole.contains(&fs::read(folder.path(a[3])).unwrap()), "{round}: {ended:?}");
            assert_eq!(folder.names(), before);
        }
    };
    folder.write("a.obj", block(1));
    folder.write("b.obj", block(2));
    commands(["encode", "a.obj", "-o", "f.tesdf"], ["encode", "b.obj", "-o", "f.tesdf"]);
    folder.write("cube.obj", block(1));
    folder.good(&["encode", "cube.obj", "-o", "a.tesdf", "--preset", "fast"]);
    folder.write("scene.toml", scene());
    folder.write("long.toml", scene().replace("duration = 0.02", "duration = 0.1"));
    commands(["simulate", "scene.toml", "-o", "run"], ["simulate", "long.toml", "-o", "run"]);
}
