//! A folder for each test, and the binary that runs in it.
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output};

use tesdf::save::{Destination, SaveOptions};
use tesdf_sim::scene_file::LoadedScene;
use tesdf_sim::{PartialRun, RunJournal, RunOrigin, simulate_from};

/// A ball that drops on a floor, in ten steps.
pub const DROP: &str = r#"
time_step = 2e-3
duration = 0.02

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

pub struct Folder(tempfile::TempDir);

impl Folder {
    pub fn new() -> Self {
        Self(tempfile::tempdir().unwrap())
    }

    pub fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    pub fn write(&self, name: &str, bytes: impl AsRef<[u8]>) {
        std::fs::write(self.path(name), bytes).unwrap();
    }

    /// The names of all files, sorted.
    pub fn names(&self) -> Vec<String> {
        let entries = std::fs::read_dir(self.0.path()).unwrap();
        let mut names: Vec<_> =
            entries.map(|e| e.unwrap().file_name().to_string_lossy().into_owned()).collect();
        names.sort();
        names
    }

    pub fn command(&self, args: &[&str]) -> Command {
        let mut command = Command::new(BINARY);
        command.env("TESDF_CACHE", "");
        command.args(args).current_dir(self.0.path());
        command
    }

    /// Runs the binary. Returns its exit code, stdout and stderr.
    pub fn tesdf(&self, args: &[&str]) -> (Option<i32>, String, String) {
        texts(self.command(args).output().unwrap())
    }

    /// As [`tesdf`](Self::tesdf), for a command that must succeed. Returns stdout.
    pub fn good(&self, args: &[&str]) -> String {
        let (code, out, err) = self.tesdf(args);
        assert_eq!(code, Some(0), "{args:?}: {out}{err}");
        out
    }
}

/// Exit code, stdout and stderr.
pub fn texts(out: Output) -> (Option<i32>, String, String) {
    let text = |bytes| String::from_utf8(bytes).unwrap();
    (out.status.code(), text(out.stdout), text(out.stderr))
}

/// Waits until the tool catches Ctrl-C. Without the handler the signal would end the process, which
/// would test nothing. A shell that becomes the tool may catch it, too, before it does.
#[cfg(target_os = "linux")]
pub fn wait_for_handler(child: &Child) {
    let catches = || {
        let status = std::fs::read_to_string(format!("/proc/{}/status", child.id())).unwrap();
        let caught = status.lines().find_map(|line| line.strip_prefix("SigCgt:")).unwrap().trim();
        status.starts_with("Name:\ttesdf\n") && u64::from_str_radix(caught, 16).unwrap() & 1 << (2 - 1) != 0
    };
    while !catches() {
        std::thread::sleep(std::time::Duration::from_millis(5));
    }
}

/// A path in the library's test data.
pub fn data(name: &str) -> String {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../tesdf/tests/data").join(name).display().to_string()
}

/// The tested binary.
pub const BINARY: &str = env!("CARGO_BIN_EXE_tesdf");

/// The surface of a block of `n` × `n` × `n` unit cubes.
pub fn block(n: u32) -> String {
    let mut text = String::new();
    let mut corners = 0;
    for axis in 0..3 {
        for (side, i, j) in (0..2 * n * n).map(|k| (k % 2, k / 2 % n, k / 2 / n)) {
            let corner = |u: u32, v: u32| {
                let mut p = [side * n; 3];
                (p[(axis + 1) % 3], p[(axis + 2) % 3]) = (i + u, j + v);
                format!("v {} {} {}\n", p[0], p[1], p[2])
            };
            let mut around = [corner(0, 0), corner(1, 0), corner(1, 1), corner(0, 1)];
            if side == 0 {
                around.reverse();
            }
            text += &around.concat();
            text += &format!("f {} {} {} {}\n", corners + 1, corners + 2, corners + 3, corners + 4);
            corners += 4;
        }
    }
    text
}

/// The file of a run that was killed after `steps` steps.
pub fn interrupted_run(folder: &Folder, scene: &str, steps: u64) -> Vec<u8> {
    let loaded = LoadedScene::read(folder.path(scene)).unwrap();
    let system = loaded.system().unwrap();
    let origin = RunOrigin::of(&system, "cpu").unwrap();
    let run = PartialRun::new(&loaded.scene, &system, folder.0.path().display().to_string());
    let mut engine = loaded.newton(system).unwrap();
    let path = folder.path("interrupted run");
    let destination = Destination::new(&path, &SaveOptions::default()).unwrap();
    let mut journal = None;
    let ended = simulate_from(&loaded.scene, &mut engine, run, |moment| {
        let begin = || RunJournal::begin(&destination, moment.record, &origin).unwrap().unwrap();
        journal.get_or_insert_with(begin).push(moment.record, &moment.report).unwrap();
        if moment.step == steps { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    });
    assert!(ended.is_err(), "the run ended before it was interrupted");
    let bytes = std::fs::read(&path).unwrap();
    std::fs::remove_file(path).unwrap();
    bytes
}
