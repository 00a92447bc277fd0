//! The outlines of the built-in font are those of the font.
use std::path::PathBuf;
use std::process::Command;

#[test]
fn the_kept_outlines_equal_those_of_the_font() {
    let test = std::env::current_exe().expect("a test is a program");
    let folder = test.parent().and_then(|deps| deps.parent()).expect("it lies in target/PROFILE/deps");
    let program = folder.join("examples").join("outlines").with_extension(std::env::consts::EXE_EXTENSION);
    assert!(program.exists(), "{} is not built: run `cargo test -p tesdf-cli`", program.display());
    let made = Command::new(program).output().expect("it starts").stdout;
    let kept = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("assets/DejaVuSans-outlines.txt");
    let kept = std::fs::read(&kept).expect("the outlines are there");
    assert!(made == kept, "the outlines are not those of the font: make them as examples/outlines.rs says");
}
