//! The scenes of the laboratory, and runs of them.
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

use tesdf_lab::scenes::criteria;
use tesdf_sim::scene_file::{LoadedScene, SceneError};
use tesdf_sim::{RunRecord, Summary, simulate};

/// The file of a scene of the laboratory.
pub fn path_of(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes").join(name).with_extension("toml")
}

/// The text of a scene of the laboratory.
pub fn text_of(name: &str) -> String {
    std::fs::read_to_string(path_of(name)).unwrap()
}

/// The scene of `text` in the place of the scene `name`.
pub fn parse(text: String, name: &str) -> Result<LoadedScene, SceneError> {
    LoadedScene::parse_with(text, path_of(name), &criteria())
}

/// Simulates a scene to its end. The summary has no times.
pub fn run(loaded: &LoadedScene) -> (RunRecord, Summary) {
    let mut engine = loaded.newton(loaded.system().unwrap()).unwrap();
    let (record, mut summary) = simulate(&loaded.scene, &mut engine, |_| ControlFlow::Continue(())).unwrap();
    (summary.detection_ms, summary.solution_ms) = (0.0, 0.0);
    (record, summary)
}

/// For each `(from, to, expected)`: the scene with `to` in place of the first `from` is refused,
/// with a line number and `expected` in the message.
pub fn refused(text: &str, name: &str, cases: &[(&str, &str, &str)]) {
    for &(from, to, expected) in cases {
        assert!(text.contains(from), "{from}");
        let loaded = parse(text.replacen(from, to, 1), name).unwrap();
        let message = loaded.system().expect_err(expected).to_string();
        assert!(message.contains(expected) && message.contains("line "), "{message}: expected {expected}");
    }
}

/// The text with balls of 1 mm in place of meshes.
pub fn balls(text: &str) -> String {
    let line = |line: &str| match line.starts_with("mesh = ") {
        true => "shape = { sphere = { radius = 0.001 } }\n".into(),
        false => format!("{line}\n"),
    };
    text.lines().map(line).collect()
}
