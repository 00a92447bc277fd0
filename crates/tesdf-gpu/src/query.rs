use cubecl::prelude::*;
use glam::{DVec3, Vec3};
use tesdf::collide::{Placement, Shape};

use crate::device::{Buffer, Device};
use crate::kernels::query::{ANSWER_ROWS, signed_distances};
use crate::placed::{FieldFrame, Placed, split};
use crate::{GpuError, Images};

/// The answer to a query, in the world.
///
/// A point that is not finite has no answer: the numbers are NaN and the face is [`NO_FACE`](tesdf::query::Answer::NO_FACE).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WorldAnswer {
    /// Distance to the nearest face, negative inside; within 2e-6 of the instance's diagonal.
    pub signed_distance: f64,
    /// Unit gradient of the signed distance.
    pub gradient: DVec3,
    /// The nearest point of the surface.
    pub closest_point: DVec3,
    /// The nearest face, by its id in the source mesh; of a box its side, −x +x −y +y −z +z.
    pub face: u32,
}

/// Threads of a group.
const GROUP: u32 = 64;
/// Answers of one launch: 4 MiB.
const LAUNCH: usize = 1 << 17;

/// Signed distances of points to placed shapes: for each instance, a shape of `shapes` by its number and where it is, the answers to all
/// points, which are in the world.
///
/// `images` holds the same shapes.
///
/// # Errors
/// A device that refuses, [`GpuError::Instance`] for an instance of a shape that is not there.
pub fn query(
    device: &Device,
    images: &Images,
    shapes: &[&Shape],
    instances: &[(usize, Placement)],
    points: &[DVec3],
) -> Result<Vec<Vec<WorldAnswer>>, GpuError> {
    let OnDevice { placed, rows, shapes: numbers } = upload_instances(device, images, shapes, instances)?;
    let split_rows = |p: &DVec3| {
        let (high, low) = split(if p.is_finite() { *p } else { DVec3::ZERO });
        [high.extend(0.0).to_array(), low.extend(0.0).to_array()]
    };
    let point_rows: Vec<[f32; 4]> = points.iter().flat_map(split_rows).collect();
    let point_rows = device.upload("points", &point_rows)?;
    let all = instances.len() * points.len();
    let answers = device.empty("answers", LAUNCH.min(all) * ANSWER_ROWS * 16)?;
    let nearest = device.empty("nearest faces", LAUNCH.min(all) * 4)?;
    let mut found: Vec<[[f32; 4]; ANSWER_ROWS]> = Vec::with_capacity(all);
    let mut faces: Vec<u32> = Vec::with_capacity(all);
    for first in (0..all).step_by(LAUNCH) {
        let count = LAUNCH.min(all - first);
        signed_distances::launch(
            device.client(),
            CubeCount::Static((count as u32).div_ceil(GROUP), 1, 1),
            CubeDim::new_1d(GROUP),
            images.argument(),
            rows.rows(),
            numbers.words(),
            point_rows.rows(),
            answers.rows(),
            nearest.words(),
            points.len() as u32,
            first as u32,
            count as u32,
        );
        found.extend(device.read::<[[f32; 4]; ANSWER_ROWS]>(&answers, count)?);
        faces.extend(device.read::<u32>(&nearest, count)?);
    }
    let answer = |k: usize, instance: usize| {
        let (at, point) = (&placed[instance], points[k % points.len()]);
        if !point.is_finite() {
            return WorldAnswer {
                signed_distance: f64::NAN,
                gradient: DVec3::NAN,
                closest_point: DVec3::NAN,
                face: tesdf::query::Answer::NO_FACE,
            };
        }
        let [first, second] = found[k];
        let face = faces[k];
        WorldAnswer {
            signed_distance: f64::from(first[0]) * at.unit,
            gradient: at.turn(Vec3::from_slice(&first[1..])),
            closest_point: at.to_world(Vec3::from_slice(&second)),
            face: match shapes[instances[instance].0] {
                Shape::Mesh(asset) => asset.face_id(face as usize),
                _ => face,
            },
        }
    };
    Ok((0..instances.len())
        .map(|i| (i * points.len()..(i + 1) * points.len()).map(|k| answer(k, i)).collect())
        .collect())
}

/// Instances, and their buffers.
pub(crate) struct OnDevice {
    pub placed: Vec<Placed>,
    pub rows: Buffer,
    pub shapes: Buffer,
}

/// Uploads where instances are, and of what shapes they are.
pub(crate) fn upload_instances(
    device: &Device,
    images: &Images,
    shapes: &[&Shape],
    instances: &[(usize, Placement)],
) -> Result<OnDevice, GpuError> {
    if let Some(i) = instances.iter().position(|(shape, _)| *shape >= images.len().min(shapes.len())) {
        let reason = format!("shape {}; expected one of {}", instances[i].0, images.len().min(shapes.len()));
        return Err(GpuError::Instance { instance: i, reason });
    }
    let placed: Vec<Placed> =
        instances.iter().map(|&(shape, at)| Placed::new(FieldFrame::new(shapes[shape]), at)).collect();
    let rows: Vec<[f32; 4]> = placed.iter().flat_map(|at| at.rows()).collect();
    let numbers: Vec<u32> = instances.iter().map(|&(shape, _)| shape as u32).collect();
    let rows = device.upload("instances", &rows)?;
    let shapes = device.upload("shapes of instances", &numbers)?;
    Ok(OnDevice { placed, rows, shapes })
}
