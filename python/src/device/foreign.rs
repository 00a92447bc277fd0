//! Rows of numbers on a device: a `DeviceArray`, or memory of another library on a CUDA device, in place.
use dlpark::ffi::{DLDevice, DLDeviceType};
use dlpark::python::consumer::stream::{self, StreamArg};
use dlpark::python::{DlpackStream, ImportRequest, ImportedDlpack, dlpack_device};
use dlpark::{DlpackElement, TensorRef};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use tesdf_gpu::GpuError;

use super::array::{DeviceArray, Words};
use super::gpu::Device;
use crate::errors::{Error, argument};

/// An argument that is an array of float32, [N, columns].
#[derive(Clone, Copy)]
pub struct Named {
    pub name: &'static str,
    pub columns: usize,
}

impl Named {
    pub fn wrong(self, found: String) -> PyErr {
        argument(self.name, found, &self.shape())
    }

    fn shape(self) -> String {
        format!("float32 of shape (N, {}), row by row", self.columns)
    }
}

/// Rows that a kernel can read.
pub struct RowsThere {
    pub rows: usize,
    pub array: tesdf_gpu::DeviceArray<f32>,
    /// Keeps the memory, with the Python object from which it comes.
    _owner: Option<ImportedDlpack>,
}

impl RowsThere {
    /// A copy of numbers of the processor.
    ///
    /// # Errors
    /// The array is larger than the device can bind.
    pub fn upload(device: &Device, rows: usize, numbers: &[f32]) -> Result<Self, GpuError> {
        Ok(Self { rows, array: tesdf_gpu::DeviceArray::upload(device.inner(), numbers)?, _owner: None })
    }
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

/// The rows of an object on `device`; `None` for an object on the processor.
///
/// # Errors
/// `ValueError` for memory on another device, numbers other than float32, another shape, and rows
/// that are not one after the other.
pub fn rows_there(named: Named, any: &Bound<'_, PyAny>, device: &Device) -> PyResult<Option<RowsThere>> {
    if let Ok(array) = any.cast::<DeviceArray>() {
        return of_array(named, array.get(), device).map(Some);
    }
    if any.hasattr("__dlpack_device__")? {
        let on = dlpack_device(any.as_borrowed())?;
        return if on.device_type == DLDeviceType::CUDA {
            by_dlpack(named, any, on, device).map(Some)
        } else {
            Ok(None)
        };
    }
    match any.getattr_opt("__cuda_array_interface__")? {
        Some(interface) => by_interface(named, any.py(), interface.cast::<PyDict>()?, device).map(Some),
        None => Ok(None),
    }
}

fn of_array(named: Named, array: &DeviceArray, device: &Device) -> PyResult<RowsThere> {
    if !array.device.is(device) {
        return Err(elsewhere(named, array.device.name().to_owned(), device));
    }
    match (&array.words, array.shape.as_slice()) {
        (Words::F32(numbers), &[rows, columns]) if columns == named.columns => {
            Ok(RowsThere { rows, array: numbers.clone(), _owner: None })
        }
        (_, shape) => Err(named.wrong(format!("an array of shape {shape:?}"))),
    }
}

fn elsewhere(named: Named, found: String, device: &Device) -> PyErr {
    argument(
        named.name,
        format!("an array on {found}"),
        &format!("one on {}, or on the processor", device.name()),
    )
}

fn by_dlpack(named: Named, any: &Bound<'_, PyAny>, on: DLDevice, device: &Device) -> PyResult<RowsThere> {
    if device.inner().cuda_number() != usize::try_from(on.device_id).ok() {
        return Err(elsewhere(named, format!("cuda:{}", on.device_id), device));
    }
    let imported = ImportRequest::new(any.as_borrowed())?.import(Some(&LegacyDefaultStream), Some(false))?;
    let (rows, pointer) = {
        let refused = |e: dlpark::tensor::Error| PyValueError::new_err(format!("{}: {e}", named.name));
        let tensor = imported.validate().map_err(refused)?;
        let rows = rows(named, &tensor).filter(|_| tensor.is_compact().unwrap_or(false));
        let found = || format!("an array of shape {:?} of {:?}", tensor.shape(), tensor.dtype());
        let rows = rows.ok_or_else(|| named.wrong(found()))?;
        (rows, tensor.data_ptr() as u64 + tensor.byte_offset())
    };
    let array = wrapped(any.py(), device, pointer, rows * named.columns)?;
    Ok(RowsThere { rows, array, _owner: Some(imported) })
}

fn rows(named: Named, tensor: &TensorRef<'_>) -> Option<usize> {
    match tensor.shape() {
        &[rows, columns] if tensor.dtype() == f32::DTYPE && columns == named.columns as i64 => {
            usize::try_from(rows).ok()
        }
        _ => None,
    }
}

/// Memory by the protocol of numba, without the object that owns it: the caller's argument does.
fn by_interface(
    named: Named,
    py: Python<'_>,
    interface: &Bound<'_, PyDict>,
    device: &Device,
) -> PyResult<RowsThere> {
    let entry = |name: &str| Ok::<_, PyErr>(interface.get_item(name)?.filter(|any| !any.is_none()));
    let required = |name: &str| {
        entry(name)?
            .ok_or_else(|| argument(named.name, "a __cuda_array_interface__", &format!("the key {name:?}")))
    };
    let shape: Vec<usize> = required("shape")?.extract()?;
    let kind: String = required("typestr")?.extract()?;
    let strides: Option<Vec<isize>> = entry("strides")?.map(|any| any.extract()).transpose()?;
    let rows = match shape.as_slice() {
        &[rows, columns] if columns == named.columns => rows,
        _ => return Err(named.wrong(format!("an array of shape {shape:?}"))),
    };
    let row = 4 * named.columns as isize;
    let is_compact = rows <= 1 || strides.is_none_or(|strides| strides == [row, 4]);
    if kind != "<f4" || !is_compact {
        return Err(named.wrong(format!("numbers of the type {kind:?}")));
    }
    match entry("stream")?.map(|any| any.extract::<u64>()).transpose()? {
        None | Some(1) => {}
        Some(other) => {
            let expected = "the legacy default stream; give torch.from_dlpack(array) or the like";
            return Err(argument(named.name, format!("an array of the stream {other}"), expected));
        }
    }
    let (pointer, _): (u64, bool) = required("data")?.extract()?;
    Ok(RowsThere { rows, array: wrapped(py, device, pointer, rows * named.columns)?, _owner: None })
}

fn wrapped(
    py: Python<'_>,
    device: &Device,
    pointer: u64,
    numbers: usize,
) -> PyResult<tesdf_gpu::DeviceArray<f32>> {
    // SAFETY: the other library says that the memory has these numbers on this device. The owner
    // lives until the answers are there.
    let array = unsafe { tesdf_gpu::DeviceArray::from_raw_ptr(device.inner(), pointer, numbers) };
    array.map_err(|e| Error::Device(e).raise(py))
}
