//! Scenes of simulations: files and dicts, opened.
use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::Arc;

use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use tesdf::{Progress, TeSdf};
use tesdf_sim::newton::Newton;
use tesdf_sim::scene_file::{AssetCache, DetectorMode, LoadedScene, SceneError, SceneFile};

use crate::asset::Asset;
use crate::device::Device;
use crate::errors::{Error, argument, kind_of};

/// Where a scene comes from.
pub enum Source {
    File(PathBuf),
    /// The text of a dict, and the assets that its bodies name.
    Json(serde_json::Value, BTreeMap<PathBuf, Arc<TeSdf>>),
}

impl Source {
    pub fn new(any: &Bound<'_, PyAny>) -> PyResult<Self> {
        if let Ok(path) = any.extract() {
            return Ok(Self::File(path));
        }
        let expected = "a path, or a dict with the keys of a scene file";
        let Ok(dict) = any.cast::<PyDict>() else {
            return Err(PyTypeError::new_err(format!("scene: {}; expected {expected}", kind_of(any))));
        };
        let found = dict.py().import("tesdf.scenes")?.getattr("to_json")?.call1((dict,))?;
        let (text, assets): (String, BTreeMap<PathBuf, Py<Asset>>) = found.extract()?;
        let json = serde_json::from_str(&text).map_err(|e| argument("scene", e, "finite numbers"))?;
        Ok(Self::Json(json, assets.into_iter().map(|(path, asset)| (path, asset.get().shared())).collect()))
    }

    fn read(self) -> Result<LoadedScene, SceneError> {
        match self {
            Self::File(path) => LoadedScene::read(path),
            Self::Json(json, memory) => {
                let mut loaded = LoadedScene::of_json(json, "<scene>")?;
                loaded.memory = memory;
                Ok(loaded)
            }
        }
    }
}

/// What replaces values of a scene.
#[derive(Default)]
pub struct Replaced {
    pub mode: Option<DetectorMode>,
    pub time_step: Option<f64>,
    pub duration: Option<f64>,
}

/// A scene with its engine.
pub struct Opened {
    pub scene: SceneFile,
    /// The folder that the scene's paths are relative to, absolute.
    pub folder: String,
    pub engine: Newton,
}

impl Opened {
    /// Reads the scene and encodes its meshes.
    pub fn new(
        source: Source,
        replaced: &Replaced,
        device: Option<Device>,
        progress: &Progress,
    ) -> Result<Self, Error> {
        let scene_error = Error::Scene;
        let mut loaded = source.read().map_err(scene_error)?;
        let file = &mut loaded.scene;
        file.detector.choose(replaced.mode.unwrap_or(file.detector.name()));
        file.time_step = replaced.time_step.unwrap_or(file.time_step);
        file.duration = replaced.duration.unwrap_or(file.duration);
        file.steps().map_err(|e| Error::Simulate(e.into()))?;
        loaded.assets = AssetCache::of_user();
        let system = loaded.system_watched(progress).map_err(scene_error)?;
        // A run stores the scene's folder, so its meshes are found from any folder.
        loaded.path = std::path::absolute(&loaded.path)
            .map_err(|source| scene_error(SceneError::Read { path: loaded.path.clone(), source }))?;
        let folder = loaded.path.parent().unwrap_or(&loaded.path).to_string_lossy().into_owned();
        let engine = match device {
            Some(device) => loaded.newton_with(system, device.into_detector()),
            None => loaded.newton(system),
        };
        Ok(Self { engine: engine.map_err(scene_error)?, scene: loaded.scene, folder })
    }
}
