//! `tesdf simulate --resume`, Ctrl-C, and how other commands read an interrupted run.

use std::fs;
use std::process::{Child, Command, Stdio};
use std::time::Duration;

use crate::folder::{Folder, interrupted_run, texts};
use tesdf_sim::RunRecord;

const CUBE: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nv 1 0 1\nv 1 1 1\nv 0 1 1\n\
f 4 3 2 1\nf 5 6 7 8\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n";

const SCENE: &str = r#"
time_step = 2e-3
duration = 0.04

[record]
contacts_every = 1

[[bodies]]
name = "floor"
shape = "plane"
fixed = true

[[bodies]]
name = "cube"
mesh = "cube.obj"
density = 1000
scale = 0.01
translation = [0, 0, 1e-4]
"#;

/// The scene with this number of steps, each of which takes some tenths of a millisecond.
fn long(steps: u64) -> String {
    let duration = format!("duration = {}", steps as f64 * 2e-3);
    let scene =
        SCENE.replace("duration = 0.04", &duration).replace("contacts_every = 1", "contacts_every = 0");
    // A cube that rests takes no time: it turns for ever, as there is no friction.
    format!("{scene}angular_velocity = [0, 0, 5]\n")
}

fn workplace() -> Folder {
    let folder = Folder::new();
    folder.write("cube.obj", CUBE);
    folder.write("scene.toml", SCENE);
    folder.good(&["simulate", "scene.toml", "-o", "whole"]);
    let cut = interrupted_run(&folder, "scene.toml", 7);
    folder.write("run", cut);
    folder
}

fn read(folder: &Folder, name: &str) -> Vec<u8> {
    fs::read(folder.path(name)).unwrap()
}

#[test]
fn an_interrupted_run_resumes_to_the_same_bytes() {
    let folder = workplace();
    let (whole, cut) = (read(&folder, "whole"), read(&folder, "run"));
    // With another output, the interrupted run stays as it is.
    let text = folder.good(&["simulate", "--resume", "run", "-o", "other"]);
    assert!(text.contains("other, 20 steps over 0.04 s"), "{text}");
    assert!(read(&folder, "other") == whole && read(&folder, "run") == cut);
    // The scene and options of the run may be given again.
    let same = [
        "simulate",
        "scene.toml",
        "--time-step",
        "2e-3",
        "--mode",
        "exact",
        "--resume",
        "run",
        "-o",
        "other",
    ];
    folder.good(&same);
    assert!(read(&folder, "other") == whole);
    // The last step is incomplete.
    folder.write("torn", &cut[..cut.len() - 5]);
    assert_eq!(RunRecord::open(folder.path("torn")).unwrap().steps(), 6);
    folder.good(&["simulate", "--resume", "torn"]);
    assert!(read(&folder, "torn") == whole);
    // The mesh has been moved.
    fs::rename(folder.path("cube.obj"), folder.path("moved.obj")).unwrap();
    let (code, _, err) = folder.tesdf(&["simulate", "--resume", "run"]);
    assert!(code == Some(2) && err.contains("cube.obj"), "{err}");
    folder.good(&["simulate", "--resume", "run", "--geometry", "cube=moved.obj"]);
    assert!(read(&folder, "run") == whole);
    assert_eq!(folder.names(), ["moved.obj", "other", "run", "scene.toml", "torn", "whole"]);
}

#[test]
fn the_summary_is_that_of_the_whole_run() {
    let folder = workplace();
    let summary = |args: &[&str]| {
        let json = folder.good(&[args, &["-o", "other", "--json"]].concat());
        let mut json: serde_json::Value = serde_json::from_str(&json).unwrap();
        // These values are wall times, and the name of the input file.
        for key in ["detection_ms", "solution_ms", "scene"] {
            json.as_object_mut().unwrap().remove(key).unwrap();
        }
        json
    };
    assert_eq!(summary(&["simulate", "--resume", "run"]), summary(&["simulate", "scene.toml"]));
}

#[test]
fn a_run_is_not_resumed_with_something_else() {
    let folder = workplace();
    folder.write("other.toml", SCENE.replace("density = 1000", "density = 1001"));
    let hint = "hint: resume with the scene, options and geometries of the run, or simulate the scene from its beginning\n";
    for (args, expected) in [
        (&["other.toml"][..], "bodies[1].density is 1001.0, but the run was made with 1000.0"),
        (&["--time-step", "1e-3"], "time_step is 0.001, but the run was made with 0.002"),
        (&["--duration", "1"], "duration is 1.0, but the run was made with 0.04"),
        (&["--mode", "node"], "detector.mode is \"node\", but the run was made with \"exact\""),
    ] {
        let (code, out, err) = folder.tesdf(&[&["simulate", "--resume", "run"], args].concat());
        assert_eq!((code, out.as_str()), (Some(2), ""), "{args:?}: {err}");
        assert_eq!(err, format!("error: cannot resume run: {expected}\n{hint}"), "{args:?}");
    }
    let before = read(&folder, "run");
    folder.write("cube.obj", CUBE.replace("v 1 1 1", "v 1.5 1 1"));
    let (code, _, err) = folder.tesdf(&["simulate", "--resume", "run"]);
    assert_eq!(code, Some(2));
    assert!(err.contains("the geometry of body cube is not the one that the run was made with"), "{err}");
    assert!(read(&folder, "run") == before);

    let (code, _, err) = folder.tesdf(&["simulate", "--resume", "whole"]);
    assert_eq!(code, Some(2));
    let expected = "error: whole: the run is complete: it has all of its 20 steps\n\
        hint: there is nothing to resume; for a longer run, simulate the scene with --duration\n";
    assert_eq!(err, expected);
    for (name, expected) in [("scene.toml", "not a run of tesdf"), ("none", "cannot read none")] {
        let (code, _, err) = folder.tesdf(&["simulate", "--resume", name]);
        assert!(code == Some(2) && err.contains(expected), "{err}");
    }
    let (code, _, err) = folder.tesdf(&["simulate"]);
    assert!(code == Some(2) && err.contains("--output <RUN>") && err.contains("SCENE"), "{err}");
}

#[test]
fn other_commands_read_an_interrupted_run_with_a_note() {
    let folder = workplace();
    let note = "note: run has 7 of 20 steps: it is still running, or it was interrupted; `tesdf simulate --resume run` continues it\n";
    let render = ["render", "--run", "run", "-o", "cut.png", "--size", "64x64", "--contacts"];
    let (code, _, err) = folder.tesdf(&render);
    assert_eq!((code, err.as_str()), (Some(0), note));
    let last = ["--time", "0.014"];
    folder.good(
        &[&["render", "--run", "whole", "-o", "whole.png", "--size", "64x64", "--contacts"], &last[..]]
            .concat(),
    );
    assert_ne!(read(&folder, "cut.png"), b"");
}

/// Starts the long scene and waits until it has made some steps.
fn start(folder: &Folder, steps: u64) -> Child {
    folder.write("long.toml", long(steps));
    let mut command = folder.command(&["simulate", "long.toml", "-o", "run"]);
    let child = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    // The run from the beginning of the test is shorter.
    while !RunRecord::open(folder.path("run"))
        .is_ok_and(|run| run.planned_steps() == Some(steps) && run.steps() > 2)
    {
        std::thread::sleep(Duration::from_millis(2));
    }
    child
}

#[cfg(unix)]
#[test]
fn ctrl_c_keeps_the_steps_and_says_how_to_continue() {
    let folder = workplace();
    let child = start(&folder, 2000);
    assert!(Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap().success());
    let (code, out, err) = texts(child.wait_with_output().unwrap());
    assert_eq!((code, out.as_str()), (Some(2), ""), "{err}");
    let steps = RunRecord::open(folder.path("run")).unwrap().steps();
    assert!((3..2000).contains(&steps));
    let expected = format!(
        "error: interrupted after {steps} of 2000 steps; run has them\nhint: `tesdf simulate --resume run` continues from there\n"
    );
    assert_eq!(err, expected);
    assert_eq!(folder.names(), ["cube.obj", "long.toml", "run", "scene.toml", "whole"]);
    folder.good(&["simulate", "--resume", "run"]);
    folder.good(&["simulate", "long.toml", "-o", "whole"]);
    assert!(read(&folder, "run") == read(&folder, "whole"));
}

#[test]
fn a_run_that_is_being_written_is_left_to_its_process() {
    let folder = workplace();
    let mut child = start(&folder, 100_000);
    let busy = "error: another process is writing run\n\
        hint: wait for that process, or give another file to -o\n";
    for args in [&["simulate", "--resume", "run"][..], &["simulate", "scene.toml", "-o", "run"]] {
        let (code, _, err) = folder.tesdf(args);
        assert_eq!((code, err.as_str()), (Some(2), busy), "{args:?}");
    }
    // Reading the run must not disturb it.
    folder.good(&["render", "--run", "run", "-o", "now.png", "--size", "32x32"]);
    assert!(child.try_wait().unwrap().is_none(), "the scene is too short for this test");
    child.kill().unwrap();
    child.wait().unwrap();
    folder.good(&["simulate", "scene.toml", "-o", "run"]);
    assert!(read(&folder, "run") == read(&folder, "whole"));
}

/// A run leaves an existing file unchanged until its first step is made.
#[test]
fn a_run_that_fails_before_its_first_step_leaves_the_old_file() {
    let folder = workplace();
    folder.write("run", "old");
    folder.write("bad.toml", SCENE.replace("scale = 0.01", "scale = -1"));
    let (code, _, err) = folder.tesdf(&["simulate", "bad.toml", "-o", "run"]);
    assert_eq!((code, read(&folder, "run")), (Some(2), b"old".into()), "{err}");
}
