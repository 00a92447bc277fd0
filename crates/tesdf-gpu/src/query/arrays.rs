//! Queries whose points and answers stay on the device.
use cubecl::prelude::CubeDim;
use tesdf::collide::Placement;

use super::GROUP;
use crate::GpuError;
use crate::collide::scene::{GpuShapeId, GpuShapes};
use crate::device::{Device, DeviceArray, spread};
use crate::kernels::query::batch::{WorldAnswersLaunch, world_distances};

/// Arrays for answers on a device. The answers of the first instance to all points come first, then
/// those of the second instance, and so on.
#[derive(Clone)]
pub struct DeviceAnswers {
    /// Distance to the nearest face, negative inside, in the world's unit. One number per answer.
    pub signed_distances: DeviceArray<f32>,
    /// Unit gradients in the world frame: x, y, z of each answer.
    pub gradients: DeviceArray<f32>,
    /// Nearest points of the surface in the world frame: x, y, z of each answer.
    pub closest_points: DeviceArray<f32>,
    /// Index of the nearest face in the asset; [`TeSdf::face_id`](tesdf::TeSdf::face_id) gives its
    /// id in the source mesh. For a point that is not finite the index is `u32::MAX`, and all other
    /// numbers are NaN.
    pub faces: DeviceArray<u32>,
}

impl DeviceAnswers {
    /// Allocates arrays for `count` answers, the number of instances times the number of points.
    ///
    /// # Errors
    /// [`GpuError::TooLarge`] when an array is larger than the device can bind.
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

impl GpuShapes {
    /// Computes the signed distances of [`signed_distances`](Self::signed_distances) for points on
    /// the device: x, y, z of each point, in the world frame. The answers stay on the device. The
    /// call returns without waiting for the result.
    ///
    /// Points are `f32`. So far from the origin of the world the answers have the rounding error of
    /// the points. A distance beyond `f32` is the largest `f32`.
    ///
    /// # Errors
    /// [`GpuError::Instance`] for an instance of a shape that was not uploaded here;
    /// [`GpuError::Length`] when the length of `points` is not a multiple of 3, or an array of
    /// answers is too short; [`GpuError::TooLarge`] for more instances than a buffer holds.
    pub fn signed_distances_into(
        &self,
        points: &DeviceArray<f32>,
        instances: &[(GpuShapeId, Placement)],
        answers: &DeviceAnswers,
    ) -> Result<(), GpuError> {
        let placed = self.place(instances)?;
        if !points.len().is_multiple_of(3) {
            let expected = "a multiple of 3: x y z each".to_owned();
            return Err(GpuError::Length { array: "points", found: points.len(), expected });
        }
        let point_count = points.len() / 3;
        let count = point_count * instances.len();
        for (array, found, per) in answers.room() {
            if found < per * count {
                let expected = format!("{} at least", per * count);
                return Err(GpuError::Length { array, found, expected });
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
            self.device().client(),
            spread(count.div_ceil(GROUP)),
            CubeDim::new_1d(GROUP),
            self.argument(),
            placed.argument(),
            points.buffer().words(),
            WorldAnswersLaunch::new(
                answers.signed_distances.buffer().words(),
                answers.gradients.buffer().words(),
                answers.closest_points.buffer().words(),
                answers.faces.buffer().words(),
            ),
            point_count,
            count,
        );
        Ok(())
    }
}
