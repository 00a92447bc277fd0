//! Shared parts of the tests: the scenes of the repository, runs of them, scene files that tests write or
//! that are refused, and meshes.
pub mod bench;
pub mod meshes;

use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

use tesdf_sim::scene_file::LoadedScene;
use tesdf_sim::{RunRecord, Summary, System, simulate};

/// The file of a scene of the repository.
pub fn path_of(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenes").join(name).with_extension("toml")
}

/// A scene of the repository, changed, with its bodies. Tests keep it, because encoding takes time.
pub fn scene(name: &str, change: impl FnOnce(&mut LoadedScene)) -> (LoadedScene, System) {
    let mut loaded = LoadedScene::read(path_of(name)).unwrap();
    change(&mut loaded);
    let system = loaded.system().unwrap();
    (loaded, system)
}

/// Simulates a scene to its end.
pub fn run(loaded: &LoadedScene, system: System) -> (RunRecord, Summary) {
    let mut engine = loaded.newton(system).unwrap();
    simulate(&loaded.scene, &mut engine, |_| ControlFlow::Continue(())).unwrap()
}

/// For each `(from, to, expected)`: the scene with `to` in place of the first `from` is refused,
/// with a line number and `expected` in the message. Returns the messages.
pub fn refused(text: &str, path: &Path, cases: &[(&str, &str, &str)]) -> Vec<String> {
    let refuse = |&(from, to, expected): &(&str, &str, &str)| {
        assert!(text.contains(from), "{from}");
        let loaded = LoadedScene::parse(text.replacen(from, to, 1), path).unwrap();
        let message = loaded.system().expect_err(expected).to_string();
        assert!(message.contains(expected) && message.contains("line "), "{message}: expected {expected}");
        message
    };
    cases.iter().map(refuse).collect()
}
