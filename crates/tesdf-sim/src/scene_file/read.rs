use std::path::{Path, PathBuf};

use super::{SceneError, SceneFile};

/// A scene file with what its errors and paths refer to.
#[derive(Clone, Debug)]
pub struct LoadedScene {
    /// What it says.
    pub scene: SceneFile,
    /// Where it is.
    pub path: PathBuf,
    text: String,
}

impl LoadedScene {
    /// Reads a scene file.
    ///
    /// # Errors
    /// [`SceneError::Read`], [`SceneError::Parse`].
    pub fn read(path: &Path) -> Result<Self, SceneError> {
        let text = std::fs::read_to_string(path)
            .map_err(|source| SceneError::Read { path: path.to_path_buf(), source })?;
        Self::parse(text, path)
    }

    /// As [`read`](Self::read), from its text; paths in it are relative to the folder of `path`.
    ///
    /// # Errors
    /// [`SceneError::Parse`].
    pub fn parse(text: String, path: &Path) -> Result<Self, SceneError> {
        let scene = toml::from_str(&text).map_err(|e| SceneError::Parse {
            path: path.to_path_buf(),
            message: e.to_string().trim_end().to_string(),
        })?;
        Ok(Self { scene, path: path.to_path_buf(), text })
    }

    /// Line of a byte of the text, from 1.
    pub(super) fn line(&self, byte: usize) -> usize {
        1 + self.text.bytes().take(byte).filter(|&b| b == b'\n').count()
    }

    /// A path of the scene, relative to its folder.
    pub(super) fn resolve(&self, path: &Path) -> PathBuf {
        self.path.parent().map_or_else(|| path.to_path_buf(), |folder| folder.join(path))
    }

    pub(super) fn value(&self, key: &str, reason: impl std::fmt::Display) -> SceneError {
        SceneError::Value { path: self.path.clone(), key: key.into(), reason: reason.to_string() }
    }
}
