//! `tesdf.InstancePairs`
use std::sync::{Mutex, PoisonError};

use numpy::{IntoPyArray, PyArray2, PyArrayMethods};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use tesdf::collide::{self, CollideError, CollideOptions, InstanceId, detect_pairs};

use crate::detection::Keywords;
use crate::errors::Error;
use crate::scene::Scene;
use crate::{arrays, contacts, pool};

/// The pairs of instances that can touch, kept from detection to detection, for scenes whose
/// instances move a little in between.
///
/// detect finds the contacts of Scene.detect, bit for bit. Only instances that have moved are
/// compared with others, and those that stay within a wider box only with their neighbours. So it
/// saves time in scenes of thousands of bodies of which most rest or move slowly; otherwise
/// contacts take nearly all of the time.
///
/// Any scene is accepted; another one than the last begins anew. Threads may share this object;
/// they detect one after the other.
#[pyclass(frozen, module = "tesdf")]
pub struct InstancePairs {
    kept: Mutex<collide::InstancePairs>,
}

#[pymethods]
impl InstancePairs {
    /// No pairs; the first detection finds them.
    #[new]
    fn new() -> Self {
        Self { kept: Mutex::default() }
    }

    /// The contacts of a scene: Contacts. The options are those of Scene.detect.
    ///
    /// moved: ids [N] of the instances that have changed since the last call. Other instances are
    /// then not looked at, so leaving one out misses its contacts. None looks at all.
    #[pyo3(signature = (scene, *, moved = None, **options), text_signature = "($self, scene, *, moved=None, mode='exact', contacts_per='face', contact_distance=0.0, speculative_time=0.0, cos_theta=None, iterations=None, tolerance=None, reduce=None, spread=None, precision='f64', threads=None)")]
    fn detect<'py>(
        &self,
        scene: &Bound<'py, Scene>,
        moved: Option<&Bound<'py, PyAny>>,
        options: Option<&Bound<'py, PyDict>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let py = scene.py();
        let Keywords { options, threads } = Keywords::new("detect", options)?;
        let moved = moved.map(|any| arrays::ids("moved", any)).transpose()?;
        let moved = moved.map(|ids| ids.into_iter().map(InstanceId).collect::<Vec<_>>());
        let (scene, pool) = (scene.get().now(), pool::of(threads).map_err(|e| e.raise(py))?);
        let work = || {
            let mut kept = self.kept.lock().unwrap_or_else(PoisonError::into_inner);
            update(&mut kept, &scene, &options, moved.as_deref())?;
            detect_pairs(kept.pairs(), &scene, &options)
        };
        let found = py.detach(|| pool.install(work));
        contacts::contacts(py, &found.map_err(|e| Error::Collide(e).raise(py))?)
    }

    /// The pairs [P, 2] of the last detection, uint32: sorted by world and ids, the lower id first.
    #[getter]
    fn pairs<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<u32>>> {
        let pairs: Vec<u32> = py.detach(|| {
            let kept = self.kept.lock().unwrap_or_else(PoisonError::into_inner);
            kept.pairs().iter().flat_map(|pair| [pair.first.0, pair.second.0]).collect()
        });
        let shape = [pairs.len() / 2, 2];
        pairs.into_pyarray(py).reshape(shape)
    }

    fn __repr__(&self, py: Python<'_>) -> String {
        let count = py.detach(|| self.kept.lock().unwrap_or_else(PoisonError::into_inner).pairs().len());
        format!("<tesdf.InstancePairs: {count} pairs>")
    }
}

fn update(
    kept: &mut collide::InstancePairs,
    scene: &collide::Scene,
    options: &CollideOptions,
    moved: Option<&[InstanceId]>,
) -> Result<(), CollideError> {
    options.validate()?;
    match moved {
        Some(moved) => kept.update_moved(scene, options, moved),
        None => kept.update(scene, options),
    }
}
