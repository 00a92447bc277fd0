//! The examples run, and their assertions hold. `cargo test` builds them; `cargo test --test …`
//! does not.
use std::path::PathBuf;
use std::process::Command;

/// Runs an example with these arguments and returns its output.
fn run(name: &str, arguments: &[&str]) -> String {
    let test = std::env::current_exe().expect("a test is a program");
    let folder = test.parent().and_then(|deps| deps.parent()).expect("it lies in target/PROFILE/deps");
    let program = folder.join("examples").join(name).with_extension(std::env::consts::EXE_EXTENSION);
    assert!(
        program.exists(),
        "{} is not built: run `cargo test -p tesdf` or build it first",
        program.display()
    );
    let output = Command::new(program).args(arguments).output().expect("it starts");
    let error = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{name} {arguments:?}: {}: {error}", output.status);
    String::from_utf8(output.stdout).expect("UTF-8")
}

fn mesh(file: &str) -> String {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../data").join(file).to_string_lossy().into_owned()
}

#[test]
fn encode_then_hostile_file() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("l_bracket.tesdf");
    let file = file.to_str().expect("UTF-8");
    let printed = run("encode", &[&mesh("procedural/l_bracket.obj"), file]);
    assert!(printed.contains("960 faces"), "{printed}");
    for arguments in [vec![], vec![file]] {
        let printed = run("hostile_file", &arguments);
        assert!(printed.contains("led astray: section domain.nodes"), "{printed}");
        assert!(printed.contains("bent: section mesh.vertices"), "{printed}");
    }
}

#[test]
fn query() {
    let printed = run("query", &[]);
    assert!(printed.contains("gradient [0, 0, 1]"), "{printed}");
    run("query", &[&mesh("public/torus_quads.obj")]);
}

#[test]
fn batch() {
    let printed = run("batch", &[]);
    assert!(printed.contains("262144 points"), "{printed}");
}
