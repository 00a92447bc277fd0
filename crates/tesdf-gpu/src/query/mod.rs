//! Signed distances of many points to many instances.
mod arrays;

use cubecl::prelude::*;
use glam::{DVec3, Vec3};
use tesdf::collide::{Placement, Shape};

pub use arrays::DeviceAnswers;

use crate::GpuError;
use crate::collide::scene::placed::{FieldFrame, Placed, split};
use crate::collide::scene::{GpuShapeId, GpuShapes};
use crate::device::{Buffer, spread};
use crate::kernels::query::batch::{
    ANSWER_ROWS, AnswersLaunch, BatchLaunch, FARTHEST, InstancesLaunch, signed_distances,
};

/// The answer to a query, in the world frame.
///
/// For a point that is not finite, all numbers are NaN, and the face is
/// [`NO_FACE`](tesdf::query::Answer::NO_FACE).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WorldAnswer {
    /// Distance to the nearest face, negative inside, in the world's unit. The error is at most
    /// 2e-6 of the instance's diagonal, or of the distance where that is larger.
    pub signed_distance: f64,
    /// Unit gradient of the signed distance.
    pub gradient: DVec3,
    /// The nearest point of the surface.
    pub closest_point: DVec3,
    /// The nearest face, by its id in the source mesh. A box numbers its sides −x, +x, −y, +y, −z,
    /// +z.
    pub face: u32,
}

impl WorldAnswer {
    const NONE: Self = Self {
        signed_distance: f64::NAN,
        gradient: DVec3::NAN,
        closest_point: DVec3::NAN,
        face: tesdf::query::Answer::NO_FACE,
    };
}

pub use crate::kernels::GROUP;

/// Answers per launch; they take 4 MiB.
const LAUNCH: usize = 1 << 17;

/// How many times as far out a point is as the point that the kernel looks from.
fn farther(p: DVec3) -> f64 {
    (p.abs().max_element() / f64::from(FARTHEST)).max(1.0)
}

/// The rows of an answer, as the kernel writes them.
type AnswerRows = [[f32; 4]; ANSWER_ROWS as usize];

impl GpuShapes {
    /// Computes the signed distances of points to instances of shapes. The points are in the world
    /// frame. The result has a list for each instance, with an answer for each point.
    ///
    /// # Errors
    /// [`GpuError::Instance`] for an instance of a shape that was not uploaded here;
    /// [`GpuError::TooLarge`] when a buffer is larger than the device can bind;
    /// [`GpuError::Device`] when the device fails.
    pub fn signed_distances(
        &self,
        points: &[DVec3],
        instances: &[(GpuShapeId, Placement)],
    ) -> Result<Vec<Vec<WorldAnswer>>, GpuError> {
        let device = self.device();
        let placed = self.place(instances)?;
        let split_rows = |p: &DVec3| {
            let (high, low) = split(if p.is_finite() { *p / farther(*p) } else { DVec3::ZERO });
            [high.extend(0.0).to_array(), low.extend(0.0).to_array()]
        };
        let rows: Vec<[f32; 4]> = points.iter().flat_map(split_rows).collect();
        let rows = device.upload("points", &rows)?;
        let all = instances.len() * points.len();
        let answers = device.empty("answers", LAUNCH.min(all) * size_of::<AnswerRows>())?;
        let nearest = device.empty("nearest faces", LAUNCH.min(all) * 4)?;
        let mut found: Vec<(AnswerRows, u32)> = Vec::with_capacity(all);
        for first in (0..all).step_by(LAUNCH) {
            let count = LAUNCH.min(all - first);
            signed_distances::launch(
                device.client(),
                spread((count as u32).div_ceil(GROUP)),
                CubeDim::new_1d(GROUP),
                self.argument(),
                placed.argument(),
                rows.rows(),
                AnswersLaunch::new(answers.rows(), nearest.words()),
                BatchLaunch::new(points.len() as u32, first as u32, count as u32),
            );
            let rows = device.read::<AnswerRows>(&answers, count)?;
            found.extend(rows.into_iter().zip(device.read::<u32>(&nearest, count)?));
        }
        let of_instance = |(i, (shape, _)): (usize, &(GpuShapeId, Placement))| {
            let answer = |(k, point): (usize, &DVec3)| match point.is_finite() {
                true => {
                    let found = found[i * points.len() + k];
                    let answer = self.world_answer(*shape, &placed.placed[i], found);
                    let signed_distance =
                        (answer.signed_distance * farther(*point)).clamp(f64::MIN, f64::MAX);
                    WorldAnswer { signed_distance, ..answer }
                }
                false => WorldAnswer::NONE,
            };
            points.iter().enumerate().map(answer).collect()
        };
        Ok(instances.iter().enumerate().map(of_instance).collect())
    }

    fn world_answer(&self, shape: GpuShapeId, at: &Placed, (rows, face): (AnswerRows, u32)) -> WorldAnswer {
        let [[x, y, z, distance], [u, v, w, farther]] = rows;
        WorldAnswer {
            signed_distance: f64::from(distance) * f64::from(farther) * at.unit,
            gradient: at.rotate(Vec3::new(x, y, z)),
            closest_point: at.to_world(Vec3::new(u, v, w)),
            face: match &self.shapes[shape.0 as usize] {
                Shape::Mesh(asset) => asset.face_id(face as usize),
                _ => face,
            },
        }
    }

    /// Uploads the poses and shape numbers of instances.
    fn place(&self, instances: &[(GpuShapeId, Placement)]) -> Result<PlacedShapes, GpuError> {
        let field = |(instance, (shape, at)): (usize, &(GpuShapeId, Placement))| {
            let known = self.shapes.get(shape.0 as usize).ok_or_else(|| GpuError::Instance {
                instance,
                reason: format!("shape {}; expected one of {}", shape.0, self.len()),
            })?;
            Ok(Placed::new(FieldFrame::new(known), *at))
        };
        let placed = instances.iter().enumerate().map(field).collect::<Result<Vec<Placed>, GpuError>>()?;
        let rows: Vec<[f32; 4]> = placed.iter().flat_map(|at| at.rows()).collect();
        let numbers: Vec<u32> = instances.iter().map(|(shape, _)| shape.0).collect();
        let poses = self.device().upload("instances", &rows)?;
        let shapes = self.device().upload("shapes of instances", &numbers)?;
        Ok(PlacedShapes { placed, poses, shapes })
    }
}

/// Instances on the device.
struct PlacedShapes {
    placed: Vec<Placed>,
    poses: Buffer,
    shapes: Buffer,
}

impl PlacedShapes {
    fn argument(&self) -> InstancesLaunch {
        InstancesLaunch::new(self.poses.rows(), self.shapes.words())
    }
}
