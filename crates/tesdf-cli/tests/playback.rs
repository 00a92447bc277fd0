//! `tesdf export`
mod folder;

use folder::Folder;

/// A ball that drops on a plane, next to a ball that lies there: 20 steps.
const DROP: &str = r#"
time_step = 2e-3
duration = 0.04

[[bodies]]
name = "floor"
shape = "plane"
fixed = true

[[bodies]]
name = "ball"
shape = { sphere = { radius = 0.01 } }
density = 1000
translation = [0, 0, 0.0105]

[[bodies]]
name = "</script> & ball"
shape = { sphere = { radius = 0.01 } }
density = 1000
translation = [0.1, 0, 0.01]
"#;

fn simulated() -> Folder {
    let folder = Folder::new();
    folder.write("drop.toml", DROP);
    folder.good(&["simulate", "drop.toml", "-o", "run"]);
    folder
}

#[test]
fn a_run_becomes_a_glb_file() {
    let folder = simulated();
    let text = folder.good(&["export", "run", "-o", "run.glb"]);
    assert!(text.contains("21 of 21 states") && text.contains("bodies"), "{text}");
    let bytes = std::fs::read(folder.path("run.glb")).unwrap();
    assert_eq!(&bytes[..4], b"glTF");
    folder.good(&["export", "run", "-o", "again.glb"]);
    assert!(bytes == std::fs::read(folder.path("again.glb")).unwrap());

    let text = folder.good(&["export", "run", "-o", "few.glb", "--every", "7", "--speed", "0.1"]);
    assert!(text.contains("4 of 21 states"), "{text}");
    let text = folder.good(&["export", "run", "-o", "few.glb", "--fps", "100"]);
    assert!(text.contains("5 of 21 states"), "{text}");
}

#[test]
fn what_cannot_be_exported_is_refused() {
    let folder = simulated();
    folder.write("text", "no run");
    for (args, expected) in [
        (&["text", "-o", "a.glb"][..], "not a run of tesdf"),
        (&["run", "-o", "run"][..], "is the input run itself"),
        (&["run", "-o", "a.glb", "--every", "0"][..], "--every"),
        (&["run", "-o", "a.glb", "--fps", "0"][..], "greater than 0"),
        (&["run", "-o", "a.glb", "--speed", "-1"][..], "greater than 0"),
        (&["run", "-o", "a.glb", "--geometry", "cup=cup.stl"][..], "there is no body cup"),
        (&["run", "-o", "a.glb", "--geometry", "ball=none.tesdf"][..], "--geometry BODY=FILE"),
    ] {
        let (code, _, err) = folder.tesdf(&[&["export"], args].concat());
        assert_eq!(code, Some(2), "{args:?}: {err}");
        assert!(err.contains(expected), "{args:?}: {err}");
    }
    assert_eq!(folder.names(), ["drop.toml", "run", "text"]);
}
