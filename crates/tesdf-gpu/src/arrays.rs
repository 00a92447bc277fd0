//! Arrays that stay on the device: queries read points where they are, and leave answers there.
use std::marker::PhantomData;

use bytemuck::Pod;
use cubecl::prelude::CubeDim;
use tesdf::collide::{Placement, Shape};

use crate::device::{Buffer, Device, spread};
use crate::kernels::query::world_distances;
use crate::query::upload_instances;
use crate::{GpuError, Images};

/// An array on a device: its own memory, or that of others, such as a tensor of torch.
#[derive(Clone)]
pub struct DeviceArray<T> {
    buffer: Buffer,
    len: usize,
    elements: PhantomData<T>,
}

/// What numbers of 32 bits are.
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

    /// Of any contents.
    ///
    /// # Errors
    /// [`GpuError::TooLarge`].
    pub fn empty(device: &Device, len: usize) -> Result<Self, GpuError> {
        Ok(Self { buffer: device.empty("array", len * size_of::<T>())?, len, elements: PhantomData })
    }

    /// Memory that others own, of a CUDA device: `len` elements from `pointer` on (`tensor.data_ptr()` of torch, `array.ptr` of Warp). Nothing
    /// is copied. Work here is in order with the legacy default stream, which is torch's stream unless it was told otherwise; who works in
    /// further streams has to wait for them.
    ///
    /// # Safety
    /// That memory is on this device, begins at a multiple of 4 bytes, and stays until the array is dropped and a read or [`Device::wait`] has ended what was launched with it.
    ///
    /// # Errors
    /// [`GpuError::Unavailable`] for a device that is not of CUDA.
    #[cfg(feature = "cuda")]
    pub unsafe fn outside(device: &Device, pointer: u64, len: usize) -> Result<Self, GpuError> {
        // SAFETY: by the caller.
        let buffer = unsafe { device.outside("array of others", pointer, len * size_of::<T>()) }?;
        Ok(Self { buffer, len, elements: PhantomData })
    }

    /// Where it begins on a CUDA device, for others to read once [`Device::wait`] or the default stream says that it is written.
    ///
    /// # Errors
    /// [`GpuError::Unavailable`] for a device that is not of CUDA.
    #[cfg(feature = "cuda")]
    pub fn pointer(&self, device: &Device) -> Result<u64, GpuError> {
        device.pointer(&self.buffer)
    }

    /// Waits for what was launched, and reads.
    ///
    /// # Errors
    /// A device that failed.
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

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.len == 0
    }
}

/// Where answers go: for each instance all points, in order.
#[derive(Clone)]
pub struct DeviceAnswers {
    /// Distance to the nearest face, negative inside, in the world's unit.
    pub signed_distances: DeviceArray<f32>,
    /// Unit gradients, x y z each.
    pub gradients: DeviceArray<f32>,
    /// Nearest points of the surface, x y z each.
    pub closest_points: DeviceArray<f32>,
    /// Nearest faces, by their position in the asset: [`TeSdf::face_id`](tesdf::TeSdf::face_id) gives the id in the source mesh. `u32::MAX` for a point that
    /// is not finite, whose numbers are NaN.
    pub faces: DeviceArray<u32>,
}

impl DeviceAnswers {
    /// Room for `count` answers: instances × points.
    ///
    /// # Errors
    /// [`GpuError::TooLarge`].
    pub fn empty(device: &Device, count: usize) -> Result<Self, GpuError> {
        Ok(Self {
            signed_distances: DeviceArray::empty(device, count)?,
            gradients: DeviceArray::empty(device, 3 * count)?,
            closest_points: DeviceArray::empty(device, 3 * count)?,
            faces: DeviceArray::empty(device, count)?,
        })
    }

    fn room(&self) -> [(&'static str, usize, usize); 4] {
        [
            ("signed distances", self.signed_distances.len(), 1),
            ("gradients", self.gradients.len(), 3),
            ("closest points", self.closest_points.len(), 3),
            ("faces", self.faces.len(), 1),
        ]
    }
}

/// Threads of a group.
const GROUP: u32 = 64;

/// Signed distances as of [`query`](crate::query()), of points on the device, x y z each in the world. Answers are left there; nothing is waited
/// for. Points are of `f32` alone, so far from the origin answers are off by what rounding a point to it is.
///
/// # Errors
/// [`GpuError::Instance`] for an instance of a shape that is not there, [`GpuError::Length`] for arrays that do not fit.
pub fn query_arrays(
    device: &Device,
    images: &Images,
    shapes: &[&Shape],
    instances: &[(usize, Placement)],
    points: &DeviceArray<f32>,
    answers: &DeviceAnswers,
) -> Result<(), GpuError> {
    let placed = upload_instances(device, images, shapes, instances)?;
    if !points.len().is_multiple_of(3) {
        let expected = "a multiple of 3: x y z each".to_owned();
        return Err(GpuError::Length { array: "points", found: points.len(), expected });
    }
    let point_count = points.len() / 3;
    let count = point_count * instances.len();
    for (array, found, per) in answers.room() {
        if found < per * count {
            return Err(GpuError::Length { array, found, expected: format!("{} at least", per * count) });
        }
    }
    let words = |len: usize| u32::try_from(len).ok().filter(|&len| len <= u32::MAX / 3);
    let (Some(count), Some(point_count)) = (words(count), words(point_count)) else {
        let expected = format!("{} answers at most; split the points", u32::MAX / 3);
        return Err(GpuError::Length { array: "points", found: point_count, expected });
    };
    if count == 0 {
        return Ok(());
    }
    world_distances::launch(
        device.client(),
        spread(count.div_ceil(GROUP)),
        CubeDim::new_1d(GROUP),
        images.argument(),
        placed.rows.rows(),
        placed.shapes.words(),
        points.buffer.words(),
        answers.signed_distances.buffer.words(),
        answers.gradients.buffer.words(),
        answers.closest_points.buffer.words(),
        answers.faces.buffer.words(),
        point_count,
        count,
    );
    Ok(())
}
