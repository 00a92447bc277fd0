//! Files and options that need too much memory or time cause an error that names the value, never
//! an abort.

use std::process::Command;

use crate::folder::{Folder, texts};

const DROP: &str = r#"
time_step = 1e-3
duration = 0.01

[[bodies]]
name = "floor"
shape = "plane"
fixed = true

[[bodies]]
name = "ball"
shape = { sphere = { radius = 0.01 } }
density = 1000
translation = [0, 0, 0.011]
"#;

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
        ("duration = 0.01", "duration = 1e318", "line 3"),
        (
            "time_step = 1e-3",
            "time_step = 1e-318",
            "s.toml, line 3: duration: 0.01 s in steps of 1e-318 s; expected at most",
        ),
        (
            "duration = 0.01",
            "duration = 1e300",
            "s.toml, line 3: duration: 1e300 s in steps of 0.001 s; expected at most",
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
    let long = ["simulate", "s.toml", "-o", "run", "--duration", "20000"];
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
