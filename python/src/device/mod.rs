//! The argument `device`: the processor, or a device of the crate `tesdf-gpu`.
//!
//! A package that was built without the feature `gpu` has the same arguments. Each device except
//! "cpu" is then an error that says how to build the package with the feature.
use pyo3::prelude::*;
use pyo3::types::PyString;

use crate::errors::{argument, kind_of};

#[cfg(feature = "gpu")]
mod array;
#[cfg(feature = "gpu")]
mod contacts;
#[cfg(feature = "gpu")]
mod foreign;
#[cfg(feature = "gpu")]
mod gpu;
#[cfg(not(feature = "gpu"))]
mod no_gpu;
#[cfg(feature = "gpu")]
mod queries;

#[cfg(feature = "gpu")]
pub use array::DeviceArray;
#[cfg(feature = "gpu")]
pub use contacts::detect_on_device;
#[cfg(feature = "gpu")]
pub use gpu::{Device, HeldDetector, devices, open};
#[cfg(not(feature = "gpu"))]
pub use no_gpu::{
    Device, DeviceArray, HeldDetector, HeldShapes, detect_on_device, devices, of_array, open, query,
};
#[cfg(feature = "gpu")]
pub use queries::{HeldShapes, of_array, query};

/// Opens the device that an argument names; `None` for the processor.
///
/// # Errors
/// `ValueError` for an object of another type. `DeviceError` if there is no such device, or if the
/// package was built without the feature `gpu`.
pub fn chosen(any: Option<&Bound<'_, PyAny>>) -> PyResult<Option<Device>> {
    let Some(any) = any.filter(|any| !any.is_none()) else { return Ok(None) };
    let text = match (any.cast::<PyString>(), any.extract::<usize>()) {
        (Ok(text), _) => text.to_string(),
        (_, Ok(number)) => number.to_string(),
        _ => {
            return Err(argument(
                "device",
                kind_of(any),
                "\"cpu\", \"gpu\", or the number or name of a device",
            ));
        }
    };
    match text.as_str() {
        "cpu" => Ok(None),
        "gpu" => open(any.py(), None).map(Some),
        name => open(any.py(), Some(name)).map(Some),
    }
}
