//! Queries whose points and answers stay on the device.
use cubecl::prelude::CubeDim;
use tesdf::collide::Placement;

use super::super::scene::{GpuShapeId, GpuShapes};
use super::GROUP;
use crate::GpuError;
use crate::device::{Device, DeviceArray, spread};
use crate::kernels::field::query::{WorldAnswersLaunch, world_distances};

/// Arrays for answers: for each instance all points, in order.
#[derive(Clone)]
pub struct DeviceAnswers {
    /// Distance to the nearest face, negative inside, in the world's unit.
    pub signed_distances: DeviceArray<f32>,
    /// Unit gradients, x y z each.
    pub gradients: DeviceArray<f32>,
    /// Nearest points of the surface, x y z each.
    pub closest_points: DeviceArray<f32>,
    /// Nearest faces, by their position in the asset: [`TeSdf::face_id`](tesdf::TeSdf::face_id) gives the id in the source
    /// mesh. `u32::MAX` for a point that is not finite, whose numbers are NaN.
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

impl GpuShapes {
    /// Signed distances as of [`signed_distances`](Self::signed_distances), of points on the device, x y z each in the
    /// world. Answers are left there, and nothing is waited for. Points are of `f32`, so far from the origin answers are off
    /// by the rounding of a point.
    ///
    /// # Errors
    /// [`GpuError::Instance`] for an instance of a shape that is not among these, [`GpuError::Length`] for arrays that do
    /// not fit.
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
