use std::path::PathBuf;

/// Why a scene cannot be loaded.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SceneError {
    /// The file cannot be read.
    #[error("cannot read {}: {source}", .path.display())]
    Read {
        /// The scene file.
        path: PathBuf,
        /// Error of the operating system.
        source: std::io::Error,
    },
    /// The file is not a scene: it is not TOML, a field is unknown or missing, or a value has
    /// another type. The message names the line and column.
    #[error("{}: {message}", .path.display())]
    Parse {
        /// The scene file.
        path: PathBuf,
        /// Position and reason.
        message: String,
    },
    /// A value is out of range.
    #[error("{}{}: {key}: {reason}", .path.display(), .line.map(|line| format!(", line {line}")).unwrap_or_default())]
    Value {
        /// The scene file.
        path: PathBuf,
        /// Line of the field, from 1; `None` when the file does not have the field.
        line: Option<usize>,
        /// Name of the field, such as `solver.skin`.
        key: String,
        /// What was found and what was expected.
        reason: String,
    },
    /// A body is invalid.
    #[error("{}{}, body {name}: {reason}", .path.display(), .line.map(|line| format!(", line {line}")).unwrap_or_default())]
    Body {
        /// The scene file.
        path: PathBuf,
        /// Line where the body begins, from 1; `None` when the scene comes from JSON.
        line: Option<usize>,
        /// Name of the body.
        name: String,
        /// What was found and what was expected.
        reason: String,
    },
    /// The encoding was cancelled.
    #[error("cancelled")]
    Cancelled,
}
