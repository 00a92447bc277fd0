//! The device of a package without the feature `gpu`: a type without values.
use std::sync::Arc;

use pyo3::prelude::*;
use tesdf::TeSdf;
use tesdf::collide::{CollideError, CollideOptions, Contacts, Scene};
use tesdf_sim::newton::Detect;

use crate::errors::Error;

/// A device. No value of this type exists.
#[derive(Clone, Copy)]
pub enum Device {}

/// Always an error, because no device can be opened.
///
/// # Errors
/// The message says how to build the package with the feature `gpu`.
pub fn open(py: Python<'_>, name: Option<&str>) -> PyResult<Device> {
    let asked = format!("device {:?}: ", name.unwrap_or("gpu"));
    Err(Error::BuiltWithoutGpu(asked).raise(py))
}

/// The devices of this machine, the best first: a list of Device, whose number or a part of whose
/// name is an argument device. Empty where the package was built without the GPU.
#[pyfunction]
pub fn devices() -> Vec<Py<PyAny>> {
    Vec::new()
}

impl Device {
    pub fn into_detector(self) -> impl Detect {
        self
    }
}

impl Detect for Device {
    fn detect(&self, _: &Scene, _: &CollideOptions) -> Result<Contacts, CollideError> {
        match *self {}
    }
}

/// Holds nothing.
#[derive(Default)]
pub struct HeldDetector(());

impl HeldDetector {
    pub fn detect(&self, device: &Device, _: &Scene, _: &CollideOptions) -> Result<Contacts, Error> {
        match *device {}
    }
}

/// Holds nothing.
#[derive(Default)]
pub struct HeldShapes(());

/// An array on a device. This package was built without devices.
#[pyclass(frozen, module = "tesdf")]
pub struct DeviceArray;

#[pymethods]
impl DeviceArray {
    #[new]
    #[pyo3(signature = (array, device = None), text_signature = "(array, device=\"gpu\")")]
    fn new(py: Python<'_>, array: &Bound<'_, PyAny>, device: Option<&Bound<'_, PyAny>>) -> PyResult<Self> {
        let _ = (array, device);
        Err(Error::BuiltWithoutGpu("DeviceArray: ".into()).raise(py))
    }
}

/// The device of an array; here there is none.
pub fn of_array(_: &Bound<'_, PyAny>) -> Option<Device> {
    None
}

/// Never called.
pub fn detect_on_device<'py>(
    _: Python<'py>,
    _: &HeldDetector,
    device: &Device,
    _: &Scene,
    _: Option<&Bound<'py, PyAny>>,
    _: Option<&Bound<'py, PyAny>>,
    _: &CollideOptions,
) -> PyResult<Bound<'py, PyAny>> {
    match *device {}
}

/// Never called.
pub fn query<'py>(
    _: &HeldShapes,
    _: &Arc<TeSdf>,
    _: &Bound<'py, PyAny>,
    device: &Device,
) -> PyResult<Bound<'py, PyAny>> {
    match *device {}
}
