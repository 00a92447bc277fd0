//! `tesdf.DeviceArray`
use std::ffi::c_void;

use dlpark::ffi::{DLDataType, DLDevice, DLManagedTensor, DLManagedTensorVersioned};
use dlpark::metadata::Dynamic;
use dlpark::python::{DlpackExporter, ExportRequest, export_dlpack};
use dlpark::{DlpackElement, DlpackFlags, Managed, ManagedTensorBase};
use numpy::{
    PyArray1, PyArrayDescrMethods, PyArrayDyn, PyArrayMethods, PyUntypedArray, PyUntypedArrayMethods,
};
use pyo3::exceptions::{PyAttributeError, PyBufferError};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyTuple};
use tesdf_gpu::Word;

use super::gpu::Device;
use super::{chosen, open};
use crate::arrays;
use crate::errors::{Error, argument};

/// An array of 32-bit numbers on a device: the points or the answers of a query that does not copy
/// them to the processor.
///
/// - array: float32 or uint32, [N] or [N, C]; it is copied to the device. float64 becomes float32.
/// - device: "gpu", or the number or name of a device.
///
/// numpy() copies the numbers back. On a CUDA device other libraries use the memory in place:
/// torch.from_dlpack(array), warp.from_dlpack(array), cupy.asarray(array), … Its contents are
/// complete.
#[pyclass(frozen, module = "tesdf")]
pub struct DeviceArray {
    pub(super) device: Device,
    pub(super) words: Words,
    pub(super) shape: Vec<usize>,
}

/// The numbers of an array. A clone refers to the same memory.
#[derive(Clone)]
pub(super) enum Words {
    F32(tesdf_gpu::DeviceArray<f32>),
    U32(tesdf_gpu::DeviceArray<u32>),
}

/// The number of the legacy default stream in `__cuda_array_interface__`.
const LEGACY_DEFAULT_STREAM: u8 = 1;

impl DeviceArray {
    fn pointer(&self) -> PyResult<u64> {
        let device = self.device.inner();
        let pointer = match &self.words {
            Words::F32(array) => array.pointer(device),
            Words::U32(array) => array.pointer(device),
        };
        pointer.map_err(|e| PyBufferError::new_err(format!("{e}, or copy the array with numpy()")))
    }

    /// A view of this memory, which keeps it. Only for CUDA devices.
    fn managed<M: ManagedTensorBase>(&self) -> PyResult<Managed<M>> {
        let refused = |e: dlpark::metadata::Error| PyBufferError::new_err(e.to_string());
        let pointer = self.pointer()?;
        let metadata = Dynamic::compact(self.shape.as_slice()).prepare_as::<M>().map_err(refused)?;
        let mut tensor = metadata.initialize(Box::new(self.words.clone()));
        tensor
            .set_data(pointer as *mut c_void)
            .set_device(DlpackExporter::device(self))
            .set_dtype(self.kind());
        // SAFETY: the words, which the tensor owns, keep the memory at this pointer, which has a
        // number of this type for each element of the shape.
        Ok(unsafe { tensor.finish() })
    }

    fn kind(&self) -> DLDataType {
        match self.words {
            Words::F32(_) => f32::DTYPE,
            Words::U32(_) => u32::DTYPE,
        }
    }
}

impl DlpackExporter for DeviceArray {
    /// Called for CUDA devices only.
    fn device(&self) -> DLDevice {
        DLDevice::cuda(self.device.inner().cuda_number().unwrap_or(0) as i32)
    }

    fn flags(&self) -> DlpackFlags {
        DlpackFlags::empty()
    }

    /// Queries wait for their answers, so every stream may read them.
    fn prepare_export(&self, _: Python<'_>, _: &ExportRequest<'_>) -> PyResult<()> {
        Ok(())
    }

    fn export_legacy(&self, _: Python<'_>) -> PyResult<Managed<DLManagedTensor>> {
        self.managed()
    }

    fn export_versioned(&self, _: Python<'_>) -> PyResult<Managed<DLManagedTensorVersioned>> {
        self.managed()
    }
}

fn uploaded<T: Word + numpy::Element>(
    device: &Device,
    given: &Bound<'_, PyAny>,
) -> PyResult<tesdf_gpu::DeviceArray<T>> {
    let py = given.py();
    let numbers = given.call_method1("astype", (numpy::dtype::<T>(py), "C"))?;
    let numbers = numbers.cast_into::<PyArrayDyn<T>>()?.try_readonly()?;
    let uploaded = tesdf_gpu::DeviceArray::upload(device.inner(), numbers.as_slice()?);
    uploaded.map_err(|e| Error::Device(e).raise(py))
}

fn downloaded<'py, T: Word + numpy::Element>(
    py: Python<'py>,
    device: &Device,
    array: &tesdf_gpu::DeviceArray<T>,
    shape: &[usize],
) -> PyResult<Bound<'py, PyAny>> {
    let numbers = py.detach(|| array.read(device.inner())).map_err(|e| Error::Device(e).raise(py))?;
    Ok(PyArray1::from_vec(py, numbers).reshape(shape.to_vec())?.into_any())
}

#[pymethods]
impl DeviceArray {
    #[new]
    #[pyo3(signature = (array, device = None), text_signature = "(array, device=\"gpu\")")]
    fn new(py: Python<'_>, array: &Bound<'_, PyAny>, device: Option<&Bound<'_, PyAny>>) -> PyResult<Self> {
        let device = match device {
            Some(_) => chosen(device)?
                .ok_or_else(|| argument("device", "\"cpu\"", "a device other than the processor"))?,
            None => open(py, None)?,
        };
        let given = py.import("numpy")?.call_method1("asarray", (arrays::on_host(array)?,))?;
        let untyped = given.cast::<PyUntypedArray>()?;
        let shape = untyped.shape().to_vec();
        if !matches!(shape.len(), 1 | 2) {
            let found = format!("an array of shape {}", given.getattr("shape")?);
            return Err(argument("array", found, "shape (N,) or (N, C)"));
        }
        let words = match (untyped.dtype().kind(), untyped.dtype().itemsize()) {
            (b'f', _) => Words::F32(uploaded(&device, &given)?),
            (b'u', 4) => Words::U32(uploaded(&device, &given)?),
            _ => {
                return Err(argument(
                    "array",
                    format!("an array of {}", untyped.dtype()),
                    "float32 or uint32",
                ));
            }
        };
        Ok(Self { device, words, shape })
    }

    /// A copy on the processor.
    fn numpy<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        match &self.words {
            Words::F32(array) => downloaded(py, &self.device, array, &self.shape),
            Words::U32(array) => downloaded(py, &self.device, array, &self.shape),
        }
    }

    /// The name of the device.
    #[getter]
    fn device(&self) -> &str {
        self.device.name()
    }

    /// The numbers of rows and columns.
    #[getter]
    fn shape<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyTuple>> {
        PyTuple::new(py, &self.shape)
    }

    /// The type of the numbers, as numpy has it.
    #[getter]
    fn dtype<'py>(&self, py: Python<'py>) -> Bound<'py, PyAny> {
        match self.words {
            Words::F32(_) => numpy::dtype::<f32>(py).into_any(),
            Words::U32(_) => numpy::dtype::<u32>(py).into_any(),
        }
    }

    /// The memory on a CUDA device, by the protocol of numba, cupy, torch and warp. On another
    /// device there is no such attribute.
    #[getter]
    fn __cuda_array_interface__<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let pointer = self.pointer().map_err(|e| PyAttributeError::new_err(e.to_string()))?;
        let kind = match self.words {
            Words::F32(_) => "<f4",
            Words::U32(_) => "<u4",
        };
        let found = PyDict::new(py);
        found.set_item("shape", self.shape(py)?)?;
        found.set_item("typestr", kind)?;
        found.set_item("data", (pointer, false))?;
        found.set_item("strides", py.None())?;
        found.set_item("version", 3)?;
        found.set_item("stream", LEGACY_DEFAULT_STREAM)?;
        Ok(found)
    }

    /// The memory as a capsule of DLPack: on a CUDA device in place, or with dl_device = (1, 0) a
    /// copy on the processor. Raises BufferError otherwise.
    #[pyo3(signature = (*, stream = None, max_version = None, dl_device = None, copy = None))]
    fn __dlpack__<'py>(
        &self,
        py: Python<'py>,
        stream: Option<&Bound<'py, PyAny>>,
        max_version: Option<(u32, u32)>,
        dl_device: Option<(u32, i32)>,
        copy: Option<bool>,
    ) -> PyResult<Py<PyAny>> {
        let host: (u32, i32) = DLDevice::CPU.into();
        if dl_device == Some(host) {
            if copy == Some(false) {
                return Err(PyBufferError::new_err("the array is on a device, so it has to be copied"));
            }
            let named = PyDict::new(py);
            named.set_item("max_version", max_version)?;
            let copied = self.numpy(py)?.call_method("__dlpack__", (), Some(&named))?;
            return Ok(copied.unbind());
        }
        self.pointer()?;
        export_dlpack(self, py, ExportRequest::parse(stream, max_version, dl_device, copy)?)
    }

    /// (2, number) on a CUDA device. Raises BufferError on another one, whose memory other
    /// libraries cannot use.
    fn __dlpack_device__(&self) -> PyResult<(u32, i32)> {
        self.pointer()?;
        Ok(DlpackExporter::device(self).into())
    }

    fn __len__(&self) -> usize {
        self.shape[0]
    }

    fn __repr__(&self, py: Python<'_>) -> PyResult<String> {
        Ok(format!(
            "<tesdf.DeviceArray: {} of {} on {}>",
            self.shape(py)?,
            self.dtype(py),
            self.device.name()
        ))
    }
}
