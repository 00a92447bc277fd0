//! Points on a device: a `DeviceArray`, or memory of another library on a CUDA device, in place.
use dlpark::ffi::{DLDevice, DLDeviceType};
use dlpark::python::consumer::stream::{self, StreamArg};
use dlpark::python::{DlpackStream, ImportRequest, ImportedDlpack, dlpack_device};
use dlpark::{DlpackElement, TensorRef};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use super::array::{DeviceArray, Words};
use super::gpu::Device;
use crate::errors::{Error, argument};

/// Points that a kernel can read.
pub struct PointsThere {
    pub rows: usize,
    pub array: tesdf_gpu::DeviceArray<f32>,
    /// Keeps the memory, with the Python object from which it comes.
    _owner: Option<ImportedDlpack>,
}

/// The stream with which all work of tesdf is in order.
struct LegacyDefaultStream;

// SAFETY: the legacy default stream of CUDA always exists.
unsafe impl DlpackStream for LegacyDefaultStream {
    fn as_python_arg(&self, _: Python<'_>, device: DLDevice) -> PyResult<StreamArg> {
        let is_cuda = device.device_type == DLDeviceType::CUDA;
        Ok(if is_cuda { stream::cuda(std::ptr::null_mut()) } else { stream::none() })
    }
}

/// The points of an object on `device`; `None` for an object on the processor.
///
/// # Errors
/// `ValueError` for memory on another device, numbers other than float32, another shape, and rows
/// that are not one after the other.
pub fn points_there(points: &Bound<'_, PyAny>, device: &Device) -> PyResult<Option<PointsThere>> {
    if let Ok(array) = points.cast::<DeviceArray>() {
        return of_array(array.get(), device).map(Some);
    }
    if points.hasattr("__dlpack_device__")? {
        let on = dlpack_device(points.as_borrowed())?;
        return if on.device_type == DLDeviceType::CUDA {
            by_dlpack(points, on, device).map(Some)
        } else {
            Ok(None)
        };
    }
    match points.getattr_opt("__cuda_array_interface__")? {
        Some(interface) => by_interface(points.py(), interface.cast::<PyDict>()?, device).map(Some),
        None => Ok(None),
    }
}

const SHAPE: &str = "float32 of shape (N, 3), row by row";

fn of_array(array: &DeviceArray, device: &Device) -> PyResult<PointsThere> {
    if !array.device.is(device) {
        return Err(elsewhere(array.device.name().to_owned(), device));
    }
    match (&array.words, array.shape.as_slice()) {
        (Words::F32(numbers), &[rows, 3]) => Ok(PointsThere { rows, array: numbers.clone(), _owner: None }),
        (_, shape) => Err(argument("points", format!("an array of shape {shape:?}"), SHAPE)),
    }
}

fn elsewhere(found: String, device: &Device) -> PyErr {
    argument(
        "points",
        format!("an array on {found}"),
        &format!("one on {}, or on the processor", device.name()),
    )
}

fn by_dlpack(points: &Bound<'_, PyAny>, on: DLDevice, device: &Device) -> PyResult<PointsThere> {
    if device.inner().cuda_number() != usize::try_from(on.device_id).ok() {
        return Err(elsewhere(format!("cuda:{}", on.device_id), device));
    }
    let imported =
        ImportRequest::new(points.as_borrowed())?.import(Some(&LegacyDefaultStream), Some(false))?;
    let (rows, pointer) = {
        let refused = |e: dlpark::tensor::Error| PyValueError::new_err(format!("points: {e}"));
        let tensor = imported.validate().map_err(refused)?;
        let rows = rows(&tensor).filter(|_| tensor.is_compact().unwrap_or(false));
        let found = || format!("an array of shape {:?} of {:?}", tensor.shape(), tensor.dtype());
        let rows = rows.ok_or_else(|| argument("points", found(), SHAPE))?;
        (rows, tensor.data_ptr() as u64 + tensor.byte_offset())
    };
    Ok(PointsThere { rows, array: wrapped(points.py(), device, pointer, rows)?, _owner: Some(imported) })
}

fn rows(tensor: &TensorRef<'_>) -> Option<usize> {
    match tensor.shape() {
        &[rows, 3] if tensor.dtype() == f32::DTYPE => usize::try_from(rows).ok(),
        _ => None,
    }
}

/// Memory by the protocol of numba, without the object that owns it: the caller's argument does.
fn by_interface(py: Python<'_>, interface: &Bound<'_, PyDict>, device: &Device) -> PyResult<PointsThere> {
    let entry = |name: &str| Ok::<_, PyErr>(interface.get_item(name)?.filter(|any| !any.is_none()));
    let required = |name: &str| {
        entry(name)?
            .ok_or_else(|| argument("points", "a __cuda_array_interface__", &format!("the key {name:?}")))
    };
    let shape: Vec<usize> = required("shape")?.extract()?;
    let kind: String = required("typestr")?.extract()?;
    let strides: Option<Vec<isize>> = entry("strides")?.map(|any| any.extract()).transpose()?;
    let &[rows, 3] = shape.as_slice() else {
        return Err(argument("points", format!("an array of shape {shape:?}"), SHAPE));
    };
    let is_compact = rows <= 1 || strides.is_none_or(|strides| strides == [12, 4]);
    if kind != "<f4" || !is_compact {
        return Err(argument("points", format!("numbers of the type {kind:?}"), SHAPE));
    }
    match entry("stream")?.map(|any| any.extract::<u64>()).transpose()? {
        None | Some(1) => {}
        Some(other) => {
            let expected = "the legacy default stream; give torch.from_dlpack(array) or the like";
            return Err(argument("points", format!("an array of the stream {other}"), expected));
        }
    }
    let (pointer, _): (u64, bool) = required("data")?.extract()?;
    Ok(PointsThere { rows, array: wrapped(py, device, pointer, rows)?, _owner: None })
}

fn wrapped(
    py: Python<'_>,
    device: &Device,
    pointer: u64,
    rows: usize,
) -> PyResult<tesdf_gpu::DeviceArray<f32>> {
    // SAFETY: the other library says that the memory has these numbers on this device. The owner
    // lives until the answers are there.
    let array = unsafe { tesdf_gpu::DeviceArray::from_raw_ptr(device.inner(), pointer, 3 * rows) };
    array.map_err(|e| Error::Device(e).raise(py))
}
