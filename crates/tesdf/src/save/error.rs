use std::io;
use std::path::{Path, PathBuf};

/// Why an output is refused or cannot be written. A regular file at its path is then unchanged.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SaveError {
    /// The operating system refused.
    #[error("cannot {action} {}: {source}", path.display())]
    Io {
        /// The attempted action: `write`, `replace`, …
        action: &'static str,
        /// The file or folder.
        path: PathBuf,
        /// The error of the operating system.
        source: io::Error,
    },
    /// The output is one of the inputs, possibly under another name.
    #[error("the output {} is the input {} itself: writing it would destroy the input", output.display(), input.display())]
    Input {
        /// The output as it was given.
        output: PathBuf,
        /// The input as it was given.
        input: PathBuf,
    },
    /// The output exists and is read-only.
    #[error("{} is read-only", path.display())]
    ReadOnly {
        /// The output.
        path: PathBuf,
    },
    /// The folder of the output does not exist.
    #[error("cannot write {}: there is no folder {}", path.display(), folder.display())]
    NoFolder {
        /// The output.
        path: PathBuf,
        /// Its folder.
        folder: PathBuf,
    },
    /// The output is a folder.
    #[error("cannot write {}: it is a folder; expected the name of a file", path.display())]
    IsFolder {
        /// The output.
        path: PathBuf,
    },
    /// Another process holds a lock on the output. `tesdf simulate` holds one while it appends to a
    /// run.
    #[error("another process is writing {}", path.display())]
    Busy {
        /// The output.
        path: PathBuf,
    },
}

impl SaveError {
    /// For `map_err`: adds the attempted action and the file.
    pub(super) fn io(action: &'static str, path: &Path) -> impl Fn(io::Error) -> Self {
        move |source| Self::Io { action, path: path.to_path_buf(), source }
    }
}
