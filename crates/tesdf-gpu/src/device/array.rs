//! Arrays that stay on the device.
use std::marker::PhantomData;

use bytemuck::Pod;

use super::{Buffer, Device};
use crate::GpuError;

/// An array on a device: in its own memory, or in memory that others allocated, such as a tensor of torch.
#[derive(Clone)]
pub struct DeviceArray<T> {
    buffer: Buffer,
    len: usize,
    elements: PhantomData<T>,
}

/// Numbers of 32 bits.
pub trait Word: Pod {}
impl Word for f32 {}
impl Word for u32 {}

impl<T: Word> DeviceArray<T> {
    /// A copy of `data`.
    ///
    /// # Errors
    /// [`GpuError::TooLarge`].
    pub fn upload(device: &Device, data: &[T]) -> Result<Self, GpuError> {
        Ok(Self { buffer: device.upload("array", data)?, len: data.len(), elements: PhantomData })
    }

    /// An array of any contents.
    ///
    /// # Errors
    /// [`GpuError::TooLarge`].
    pub fn empty(device: &Device, len: usize) -> Result<Self, GpuError> {
        Ok(Self { buffer: device.empty("array", len * size_of::<T>())?, len, elements: PhantomData })
    }

    /// An array in memory that others own, on a CUDA device: `len` elements from `pointer` on (`tensor.data_ptr()` of
    /// torch, `array.ptr` of Warp). Nothing is copied. Work here is in order with the legacy default stream, which is
    /// torch's stream by default; work in further streams has to wait for it.
    ///
    /// # Safety
    /// That memory is on this device, begins at a multiple of 4 bytes, and stays until the array is dropped and a read or
    /// [`Device::wait`] has ended all launches with it.
    ///
    /// # Errors
    /// [`GpuError::Unavailable`] for a device that is not of CUDA.
    #[cfg(feature = "cuda")]
    pub unsafe fn from_raw_ptr(device: &Device, pointer: u64, len: usize) -> Result<Self, GpuError> {
        // SAFETY: by the caller.
        let buffer = unsafe { device.adopt("array of others", pointer, len * size_of::<T>()) }?;
        Ok(Self { buffer, len, elements: PhantomData })
    }

    /// Where it begins on a CUDA device, for others to read after [`Device::wait`] or in order with the default stream.
    ///
    /// # Errors
    /// [`GpuError::Unavailable`] for a device that is not of CUDA.
    #[cfg(feature = "cuda")]
    pub fn pointer(&self, device: &Device) -> Result<u64, GpuError> {
        device.pointer(&self.buffer)
    }

    /// Waits for all launches, and reads.
    ///
    /// # Errors
    /// [`GpuError::Device`] for a launch that failed.
    pub fn read(&self, device: &Device) -> Result<Vec<T>, GpuError> {
        device.read(&self.buffer, self.len)
    }

    /// For kernels.
    pub(crate) fn buffer(&self) -> &Buffer {
        &self.buffer
    }

    /// Number of elements.
    pub fn len(&self) -> usize {
        self.len
    }

    /// Whether there is no element.
    pub fn is_empty(&self) -> bool {
        self.len == 0
    }
}
