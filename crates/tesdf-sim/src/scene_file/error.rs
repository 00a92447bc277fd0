use std::path::PathBuf;

/// Why a scene cannot be loaded.
#[derive(Debug, thiserror::Error)]
pub enum SceneError {
    /// The file cannot be read.
    #[error("cannot read {}: {source}", .path.display())]
    Read {
        /// The scene file.
        path: PathBuf,
        /// What the operating system said.
        source: std::io::Error,
    },
    /// It is no scene: not TOML, a field unknown or missing, a value of another type. The message has line and column.
    #[error("{}: {message}", .path.display())]
    Parse {
        /// The scene file.
        path: PathBuf,
        /// Where and what.
        message: String,
    },
    /// A value that makes no sense.
    #[error("{}{}: {key}: {reason}", .path.display(), .line.map(|line| format!(", line {line}")).unwrap_or_default())]
    Value {
        /// The scene file.
        path: PathBuf,
        /// Where the field is, from 1; `None` when the file does not have it.
        line: Option<usize>,
        /// The field.
        key: String,
        /// What was found and what was expected.
        reason: String,
    },
    /// A body that cannot be.
    #[error("{}, line {line}, body {name}: {reason}", .path.display())]
    Body {
        /// The scene file.
        path: PathBuf,
        /// Where the body begins, from 1.
        line: usize,
        /// Its name.
        name: String,
        /// What was found and what was expected.
        reason: String,
    },
    /// Encoding was cancelled.
    #[error("cancelled")]
    Cancelled,
}
