//! Assets of meshes that are encoded once: in a process, and in the folder of the user for caches.
use std::collections::VecDeque;
use std::path::PathBuf;
use std::sync::{Mutex, PoisonError};

use pyo3::prelude::*;
use tesdf::base::Inside;
use tesdf::encode::{EncodeOptions, Encoder, Preset};
use tesdf::mesh::{RepairMode, source_blake3};
use tesdf::{Progress, TeSdf};
use tesdf_sim::scene_file::AssetCache;

use crate::asset::Asset;
use crate::errors::Error;
use crate::interrupt::cancellable;
use crate::mesh::{Loaded, MeshInput, is_path};
use crate::pool;

/// Number of assets that a process keeps.
const KEPT: usize = 32;

/// The assets of this process with the hashes of their meshes, the last used first.
static ASSETS: Mutex<VecDeque<(String, Py<Asset>)>> = Mutex::new(VecDeque::new());

/// The asset of a mesh: an Asset as it is, that of a file .tesdf, or what encode makes with the
/// preset "fast" of any other argument of it. A mesh that was encoded before is found by its content,
/// among the last 32 of this process or in the user's folder for caches (TESDF_CACHE).
///
/// Errors are those of encode and Asset.open.
#[pyfunction]
pub fn asset_of<'py>(mesh: &Bound<'py, PyAny>) -> PyResult<Bound<'py, Asset>> {
    if let Ok(asset) = mesh.cast::<Asset>() {
        return Ok(asset.clone());
    }
    let py = mesh.py();
    if let Some(path) = path_of_asset(mesh)? {
        return Bound::new(py, Asset::open(py, path)?);
    }
    let input = MeshInput::new(mesh)?;
    let key = py.detach(|| key(&input)).map_err(|e| e.raise(py))?;
    if let Some(asset) = kept(py, &key) {
        return Ok(asset);
    }
    let pool = pool::shared().map_err(|e| e.raise(py))?;
    let state = Progress::default();
    let work = || pool.install(|| encoded(input, &state));
    let found = cancellable(py, work, || state.cancel(), || Ok(()))?.map_err(|e| e.raise(py))?;
    let asset = Bound::new(py, Asset::new(found))?;
    let mut assets = ASSETS.lock().unwrap_or_else(PoisonError::into_inner);
    assets.push_front((key, asset.clone().unbind()));
    let kept = assets.len().min(KEPT);
    let dropped = assets.split_off(kept);
    drop(assets);
    drop(dropped);
    Ok(asset)
}

fn path_of_asset(mesh: &Bound<'_, PyAny>) -> PyResult<Option<PathBuf>> {
    if !is_path(mesh)? {
        return Ok(None);
    }
    let path: PathBuf = mesh.extract()?;
    Ok(path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("tesdf")).then_some(path))
}

fn kept<'py>(py: Python<'py>, key: &str) -> Option<Bound<'py, Asset>> {
    let mut assets = ASSETS.lock().unwrap_or_else(PoisonError::into_inner);
    let at = assets.iter().position(|(of, _)| of == key)?;
    let found = assets.remove(at)?;
    let asset = found.1.bind(py).clone();
    assets.push_front(found);
    Some(asset)
}

fn key(input: &MeshInput) -> Result<String, Error> {
    match input {
        MeshInput::Arrays(mesh) => Ok(AssetCache::blake3_of(mesh)),
        MeshInput::Usd(loaded) => Ok(AssetCache::blake3_of(&loaded.mesh)),
        MeshInput::File(path) => {
            let content = source_blake3(path).map_err(|e| Error::Read(path.clone(), e))?;
            // The asset tells the name of its file.
            Ok(format!("{content} {}", path.display()))
        }
    }
}

fn encoded(input: MeshInput, state: &Progress) -> Result<TeSdf, Error> {
    let Some(cache) = AssetCache::of_user() else { return encode(input.load()?, state) };
    match input {
        MeshInput::File(path) => {
            let file = path.clone();
            let encode = || encode(MeshInput::File(file).load()?, state);
            cache.get(&path, Inside::default(), RepairMode::Never, encode)
        }
        in_memory => {
            let mesh = in_memory.load()?.mesh;
            // Without its source, which is no part of the key.
            let encode = || encode(MeshInput::Arrays(mesh.clone()).load()?, state);
            cache.of_mesh("a mesh in memory", &mesh, Inside::default(), encode)
        }
    }
}

fn encode(loaded: Loaded, state: &Progress) -> Result<TeSdf, Error> {
    let unit = loaded.unit.clone();
    let (solid, path, source) = loaded.solid(Inside::default(), RepairMode::Never)?;
    let options = EncodeOptions::preset(Preset::Fast).or_unit(unit.as_deref());
    let encoder = Encoder::new().options(options).source(source).progress(state);
    encoder.encode(&solid).map_err(|e| Error::Encode(path, e))
}
