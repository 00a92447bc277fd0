//! Files and options that need too much memory or time cause an error that names the value, never
//! an abort.

use std::process::Command;

use crate::folder::{DROP, Folder, texts};

/// Runs the binary with a memory limit in kB.
fn within(kilobytes: u32, folder: &Folder, args: &[&str]) -> (Option<i32>, String, String) {
    let script = format!("ulimit -v {kilobytes}; exec \"$0\" \"$@\"");
    let mut shell = Command::new("sh");
    shell.env("TESDF_CACHE", "");
    shell.args(["-c", &script, crate::folder::BINARY]).args(args).current_dir(folder.path(""));
    texts(shell.output().unwrap())
}

#[test]
fn scenes_over_a_limit_are_refused_with_key_and_line() {
    let folder = Folder::new();
    for (from, to, expected) in [
        ("duration = 0.02", "duration = 1e318", "line 3"),
        (
            "time_step = 2e-3",
            "time_step = 1e-318",
            "s.toml, line 3: duration: 0.02 s in steps of 1e-318 s; expected at most",
        ),
        (
            "duration = 0.02",
            "duration = 1e300",
            "s.toml, line 3: duration: 1e300 s in steps of 0.002 s; expected at most",
        ),
        (
            "\n[[bodies]]\nname = \"floor\"",
            "[solver]\nredetections = 1000000000\n[[bodies]]\nname = \"floor\"",
            "s.toml, line 5: solver.redetections: 1000000000; expected 0 to 8",
        ),
    ] {
        assert!(DROP.contains(from));
        folder.write("s.toml", DROP.replacen(from, to, 1));
        let (code, out, err) = within(1 << 21, &folder, &["simulate", "s.toml", "-o", "run"]);
        assert_eq!((code, out.as_str()), (Some(2), ""), "{err}");
        assert!(err.starts_with("error: s.toml") && err.contains(expected), "{err}");
    }
    folder.write("s.toml", DROP);
    let (code, _, err) = folder.tesdf(&["simulate", "s.toml", "-o", "run", "--duration", "1e300"]);
    assert!(code == Some(2) && err.starts_with("error: --duration 1e300: "), "{err}");
    assert_eq!(folder.names(), ["s.toml"]);
}

#[test]
fn a_run_that_does_not_fit_the_memory_is_refused_before_its_first_step() {
    let folder = Folder::new();
    folder.write("s.toml", DROP);
    let long = ["simulate", "s.toml", "-o", "run", "--duration", "40000"];
    let (code, out, err) = within(1 << 21, &folder, &long);
    assert_eq!((code, out.as_str()), (Some(2), ""), "{err}");
    assert!(err.contains("no memory is left for 20000000 steps of 2 bodies"), "{err}");
    assert_eq!(folder.names(), ["s.toml"]);
}

#[test]
fn a_picture_that_does_not_fit_the_memory_is_refused() {
    let folder = Folder::new();
    let render = ["render", "sphere:1", "-o", "p.png", "--size", "8192x8192"];
    let (code, out, err) = within(1 << 21, &folder, &render);
    assert_eq!((code, out.as_str()), (Some(2), ""), "{err}");
    assert!(err.contains("no memory is left for a picture of 8192x8192 pixels"), "{err}");
    assert_eq!(folder.names(), Vec::<String>::new());
}

/// The memory grows with the content of the file, and no single allocation is too large.
#[test]
fn lack_of_memory_exits_with_2() {
    let folder = Folder::new();
    folder.write("s.toml", format!("{DROP}\nx = [{}]\n", "[],".repeat(15_000_000)));
    let (code, out, err) = within(1 << 20, &folder, &["simulate", "s.toml", "-o", "run"]);
    assert_eq!((code, out.as_str()), (Some(2), ""), "{err}");
    assert!(err.contains("memory allocation of ") && err.contains("hint: if memory is short"), "{err}");
}

#[test]
fn options_that_ask_for_too_much_are_bad_usage() {
    let folder = Folder::new();
    for (args, expected) in [
        (&["verify", "f.tesdf", "--samples", "0"][..], "invalid value '0' for '--samples <N>'"),
        (&["encode", "m.stl", "-o", "f", "--threads", "1000000000"], "--threads <N>"),
    ] {
        let (code, out, err) = folder.tesdf(args);
        assert_eq!((code, out.as_str()), (Some(2), ""), "{args:?}: {err}");
        assert!(err.contains(expected), "{args:?}: {err}");
    }
}

/// Runs a command that must end by itself within 20 s.
#[cfg(unix)]
fn ends(folder: &Folder, args: &[&str]) -> (Option<i32>, String, String) {
    let mut command = Command::new("timeout");
    command.args(["20", crate::folder::BINARY]).args(args);
    texts(command.env("TESDF_CACHE", "").current_dir(folder.path("")).output().unwrap())
}

/// A pipe that nobody writes to, beside a file that names it.
#[cfg(unix)]
#[test]
fn a_pipe_or_device_that_a_file_names_is_refused() {
    let folder = Folder::new();
    folder.good(&["part", "peg", "-o", "peg.stl"]);
    for pipe in ["pipe.bin", "pipe.stl", "pipe.tesdf", "package.xml"] {
        assert!(Command::new("mkfifo").arg(folder.path(pipe)).status().unwrap().success());
    }
    let buffer = r#"{"asset":{"version":"2.0"},"buffers":[{"byteLength":9,"uri":"pipe.bin"}]}"#;
    folder.write("m.gltf", buffer);
    let body = |geometry: &str| format!("{DROP}\n[[bodies]]\nname = \"b\"\ndensity = 1\n{geometry}\n");
    folder.write("mesh.toml", body("mesh = \"pipe.stl\""));
    folder.write("asset.toml", body("asset = \"pipe.tesdf\""));
    folder.write("zero.toml", body("asset = \"/dev/zero\""));
    folder.write("part.toml", body("parts = [{ mesh = \"pipe.stl\" }]"));
    let geometry = "<geometry><mesh filename='package://p/peg.stl'/></geometry>";
    let link = format!("<link name='a'><collision>{geometry}</collision></link>");
    folder.write("r.urdf", format!("<robot name='r'>{link}</robot>"));
    folder.write("m.xml", "<mujoco><include file='pipe.bin'/></mujoco>");
    let run = |scene| ["simulate", scene, "-o", "run"];
    for args in [
        &["check", "m.gltf"][..],
        &["encode", "m.gltf", "-o", "m.tesdf"],
        &["encode", "m.xml", "-o", "m"],
        &run("mesh.toml"),
        &run("asset.toml"),
        &run("zero.toml"),
        &run("part.toml"),
    ] {
        let (code, _, err) = ends(&folder, args);
        assert_eq!(code, Some(2), "{args:?}: {err}");
        assert!(err.contains("it is not a regular file"), "{args:?}: {err}");
    }
    let (code, _, err) = ends(&folder, &["encode", "r.urdf", "-o", "r"]);
    assert!(code == Some(1) && err.contains("the package p was not found"), "{err}");
}

#[cfg(unix)]
#[test]
fn a_device_that_never_ends_is_refused() {
    let folder = Folder::new();
    folder.good(&["part", "peg", "-o", "peg.stl"]);
    folder.good(&["encode", "peg.stl", "-o", "peg.tesdf", "--preset", "fast"]);
    for args in [
        &["query", "peg.tesdf", "--points", "/dev/zero"][..],
        &["view", "/dev/zero", "-o", "p.html"],
        &["export", "/dev/zero", "-o", "p.glb"],
        &["simulate", "/dev/zero", "-o", "run"],
        &["encode-all", "/dev/zero", "-o", "all"],
    ] {
        let (code, _, err) = within(1 << 19, &folder, args);
        assert_eq!(code, Some(2), "{args:?}: {err}");
        assert!(err.contains("it is a device, and more than 16777216 bytes came from it"), "{err}");
    }
}

/// A scene of some kilobytes can name a robot any number of times.
#[test]
fn robots_with_too_many_bodies_together_are_refused() {
    let folder = Folder::new();
    let mass = "<mass value='1'/><inertia ixx='1' iyy='1' izz='1' ixy='0' ixz='0' iyz='0'/>";
    let link = |k| format!("<link name='l{k}'><inertial>{mass}</inertial></link>");
    let ends = |k| format!("<parent link='l0'/><child link='l{k}'/><axis xyz='0 0 1'/>");
    let joint = |k| format!("<joint name='j{k}' type='continuous'>{}</joint>", ends(k));
    let links: String = (0..900).map(link).chain((1..900).map(joint)).collect();
    folder.write("r.urdf", format!("<robot name='r'>{links}</robot>"));
    let robots: String =
        (0..20_000).map(|k| format!("[[robots]]\nfile = \"r.urdf\"\nprefix = \"r{k}\"\n")).collect();
    folder.write("s.toml", format!("{DROP}\n{robots}"));
    let (code, _, err) = within(1 << 21, &folder, &["simulate", "s.toml", "-o", "run"]);
    assert_eq!(code, Some(2), "{err}");
    assert!(err.contains("with this robot there are"), "{err}");
}
