//! A folder for each test, and the binary that runs in it.
use std::path::{Path, PathBuf};
use std::process::Command;

use serde_json::Value;

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

    pub fn read(&self, name: &str) -> String {
        std::fs::read_to_string(self.path(name)).unwrap()
    }

    pub fn json(&self, name: &str) -> Value {
        serde_json::from_str(&self.read(name)).unwrap()
    }

    /// Runs the binary. Returns its exit code, stdout and stderr.
    pub fn lab(&self, args: &[&str]) -> (Option<i32>, String, String) {
        let binary = env!("CARGO_BIN_EXE_tesdf-lab");
        let out = Command::new(binary).env("TESDF_CACHE", "").args(args).current_dir(self.0.path()).output().unwrap();
        let text = |bytes| String::from_utf8(bytes).unwrap();
        (out.status.code(), text(out.stdout), text(out.stderr))
    }

    /// As [`lab`](Self::lab), for a command that must succeed. Returns stdout.
    pub fn good(&self, args: &[&str]) -> String {
        let (code, out, err) = self.lab(args);
        assert_eq!(code, Some(0), "{args:?}: {out}{err}");
        out
    }
}

fn beside(folder: &str, name: &str) -> String {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..").join(folder).join(name).display().to_string()
}

/// A path in the folder `data` of the repository.
pub fn data(name: &str) -> String {
    beside("data", name)
}

/// A path in the folder `scenes` of the repository.
pub fn scene(name: &str) -> String {
    beside("scenes", name)
}
