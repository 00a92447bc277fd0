//! Arrays that stay on the device.
use std::marker::PhantomData;

use bytemuck::Pod;

use super::{Buffer, Device};
use crate::GpuError;

/// An array on a device. Its memory belongs to this crate, or to another library, such as the
/// memory of a torch tensor.
#[derive(Clone)]
pub struct DeviceArray<T> {
    buffer: Buffer,
    len: usize,
    elements: PhantomData<T>,
}

/// The 32-bit element types of a [`DeviceArray`]: `f32` and `u32`.
pub trait Word: Pod {}
impl Word for f32 {}
impl Word for u32 {}

impl<T: Word> DeviceArray<T> {
    /// Copies `data` to a new array on the device.
    ///
    /// # Errors
    /// [`GpuError::TooLarge`] when the array is larger than the device can bind.
    pub fn upload(device: &Device, data: &[T]) -> Result<Self, GpuError> {
        Ok(Self { buffer: device.upload("array", data)?, len: data.len(), elements: PhantomData })
    }

    /// Allocates an array of `len` elements with arbitrary contents.
    ///
    /// # Errors
    /// [`GpuError::TooLarge`] when the array is larger than the device can bind.
    pub fn empty(device: &Device, len: usize) -> Result<Self, GpuError> {
        Ok(Self { buffer: device.empty("array", len * size_of::<T>())?, len, elements: PhantomData })
    }

    /// Wraps memory of another library on a CUDA device: `len` elements that begin at `pointer`
    /// (`tensor.data_ptr()` of torch, `array.ptr` of Warp). Nothing is copied.
    ///
    /// This crate's work is ordered with the legacy default stream, which is torch's stream by
    /// default. Work in other streams must be synchronized with the default stream by the caller.
    ///
    /// # Safety
    /// The memory is on this device and begins at a multiple of 4 bytes. It must stay allocated
    /// until the array has been dropped and, after the last launch with it, a read or
    /// [`Device::wait`] has returned.
    ///
    /// # Errors
    /// [`GpuError::Unavailable`] when the device is not a CUDA device.
    #[cfg(feature = "cuda")]
    pub unsafe fn from_raw_ptr(device: &Device, pointer: u64, len: usize) -> Result<Self, GpuError> {
        // SAFETY: the caller guarantees the conditions above.
        let buffer = unsafe { device.adopt("array of others", pointer, len * size_of::<T>()) }?;
        Ok(Self { buffer, len, elements: PhantomData })
    }

    /// Address of the first element on a CUDA device. Other libraries may read the memory after
    /// [`Device::wait`], or in the legacy default stream.
    ///
    /// # Errors
    /// [`GpuError::Unavailable`] when the device is not a CUDA device.
    #[cfg(feature = "cuda")]
    pub fn pointer(&self, device: &Device) -> Result<u64, GpuError> {
        device.pointer(&self.buffer)
    }

    /// Waits for all earlier launches, and copies the elements to the host.
    ///
    /// # Errors
    /// [`GpuError::Device`] when a launch or the copy failed.
    pub fn read(&self, device: &Device) -> Result<Vec<T>, GpuError> {
        device.read(&self.buffer, self.len)
    }

    /// The memory, as an argument for kernels.
    pub(crate) fn buffer(&self) -> &Buffer {
        &self.buffer
    }

    /// Number of elements.
    pub fn len(&self) -> usize {
        self.len
    }

    /// Whether the array has no elements.
    pub fn is_empty(&self) -> bool {
        self.len == 0
    }
}
