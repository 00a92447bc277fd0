//! Functions of kernels that read arrays of the device, launched on random and degenerate input and
//! compared with the functions of `tesdf`. Functions without such arrays are compared on the host,
//! in their own files.
//!
//! The kernels of this module exist only in tests. The catalog of kernels does not list them.
mod cells;
mod cut;
mod hull;
mod lists;

use bytemuck::Pod;
use cubecl::prelude::CubeCount;

use crate::device::{Buffer, Device, spread};
use crate::kernels::GROUP;

/// The device of the tests.
fn device() -> Device {
    Device::choose(None).expect("a device: `./test` makes the replacement of CUDA's driver")
}

/// Uploads an array. An empty array takes one element, because a buffer cannot be empty.
fn upload<T: Pod>(device: &Device, data: &[T]) -> Buffer {
    let one = [T::zeroed()];
    device.upload("input of a test", if data.is_empty() { &one } else { data }).expect("fits")
}

/// The groups that a thread for each of `count` items needs.
fn groups_of(count: usize) -> CubeCount {
    spread((count as u32).div_ceil(GROUP))
}

/// Reads an array back.
fn read<T: Pod>(device: &Device, buffer: &Buffer, count: usize) -> Vec<T> {
    device.read(buffer, count).expect("reads")
}
