//! Makes objects of the package's Python classes from results of the library.
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::sync::PyOnceLock;
use pyo3::types::PyType;
use serde::Serialize;
use tesdf::collide::{Clearance, TimeOfImpact};
use tesdf::mesh::CheckReport;

/// `Answers` of `tesdf.results`.
pub fn answers(py: Python<'_>) -> PyResult<&Bound<'_, PyType>> {
    static CLASS: PyOnceLock<Py<PyType>> = PyOnceLock::new();
    CLASS.import(py, "tesdf.results", "Answers")
}

/// `DeviceAnswers` of `tesdf.results`.
#[cfg(feature = "gpu")]
pub fn device_answers(py: Python<'_>) -> PyResult<&Bound<'_, PyType>> {
    static CLASS: PyOnceLock<Py<PyType>> = PyOnceLock::new();
    CLASS.import(py, "tesdf.results", "DeviceAnswers")
}

/// `RayHits` of `tesdf.results`.
pub fn ray_hits(py: Python<'_>) -> PyResult<&Bound<'_, PyType>> {
    static CLASS: PyOnceLock<Py<PyType>> = PyOnceLock::new();
    CLASS.import(py, "tesdf.results", "RayHits")
}

/// `Moved` of `tesdf.results`.
pub fn moved(py: Python<'_>) -> PyResult<&Bound<'_, PyType>> {
    static CLASS: PyOnceLock<Py<PyType>> = PyOnceLock::new();
    CLASS.import(py, "tesdf.results", "Moved")
}

/// `Reencoded` of `tesdf.results`.
pub fn reencoded(py: Python<'_>) -> PyResult<&Bound<'_, PyType>> {
    static CLASS: PyOnceLock<Py<PyType>> = PyOnceLock::new();
    CLASS.import(py, "tesdf.results", "Reencoded")
}

/// `Repaired` of `tesdf.results`.
pub fn repaired(py: Python<'_>) -> PyResult<&Bound<'_, PyType>> {
    static CLASS: PyOnceLock<Py<PyType>> = PyOnceLock::new();
    CLASS.import(py, "tesdf.results", "Repaired")
}

/// An object of class `name` of `tesdf.reports` with the fields of `found`.
pub fn report<'py>(py: Python<'py>, name: &str, found: &impl Serialize) -> PyResult<Bound<'py, PyAny>> {
    static FROM_JSON: PyOnceLock<Py<PyAny>> = PyOnceLock::new();
    FROM_JSON.import(py, "tesdf.reports", "from_json")?.call1((name, json(found)?))
}

/// A `dict` with the fields of `found`.
pub fn dict<'py>(py: Python<'py>, found: &impl Serialize) -> PyResult<Bound<'py, PyAny>> {
    static LOADS: PyOnceLock<Py<PyAny>> = PyOnceLock::new();
    LOADS.import(py, "json", "loads")?.call1((json(found)?,))
}

fn json(found: &impl Serialize) -> PyResult<String> {
    serde_json::to_string(found)
        .map_err(|e| PyValueError::new_err(format!("the report cannot be handed to Python: {e}")))
}

/// Fields of `tesdf.Impact`.
#[derive(Serialize)]
pub struct Impact<'a> {
    #[serde(flatten)]
    clearance: &'a Clearance,
    verdict: &'static str,
    time: Option<f64>,
    free_until: f64,
    iterations: u32,
    touches: bool,
}

impl<'a> Impact<'a> {
    /// The fields, with the clearance at the impact, or at the time up to which bodies are known
    /// to be apart.
    pub fn of(found: &TimeOfImpact, clearance: &'a Clearance) -> Self {
        Self {
            clearance,
            verdict: found.verdict(),
            time: found.impact().map(|impact| impact.time),
            free_until: found.free_until(),
            iterations: found.iterations(),
            touches: found.impact().is_some(),
        }
    }
}

/// Fields of `tesdf.CheckReport`.
#[derive(Serialize)]
pub struct Checked<'a> {
    #[serde(flatten)]
    report: &'a CheckReport,
    notes: &'a [String],
    text: String,
}

impl<'a> Checked<'a> {
    /// The fields, with the notes from reading the file.
    pub fn of(report: &'a CheckReport, notes: &'a [String]) -> Self {
        Self { report, notes, text: report.to_string() }
    }
}
