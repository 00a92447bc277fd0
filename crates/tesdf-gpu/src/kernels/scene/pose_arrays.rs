//! Places instances by arrays of poses and velocities on the device.
use cubecl::prelude::*;

use crate::kernels::counters::{BADLY_PLACED, Counters};
use crate::kernels::geometry::vector::{Row, V3, last, row_of, v3, xyz, zero};
use crate::kernels::pairs::ahead::ROWS as MOTION_ROWS;
use crate::kernels::query::batch::is_finite;
use crate::kernels::query::nearest::FAR;
use crate::kernels::scene::pose::{ROWS as POSE_ROWS, Rotation};

/// Numbers of a pose: translation, and a unit quaternion with its real part last.
pub const POSE: u32 = 7;
/// Numbers of a velocity: linear, angular.
pub const VELOCITY: u32 = 6;
/// Rows of what stays the same when an instance moves: origin of its field in the world's unit,
/// relative to that of the body and in its frame, with the field's unit; the greatest distance of a
/// point from the body's origin.
pub const FIXED_ROWS: u32 = 2;
/// A quaternion whose length deviates by more is refused: some ten times the rounding of `f32`.
pub const UNIT_LENGTH: f32 = 1e-5;

/// The poses and velocities of all instances.
#[derive(CubeType, CubeLaunch)]
pub struct PoseArrays {
    /// [`POSE`] numbers for each instance.
    pub poses: Box<[f32]>,
    /// [`VELOCITY`] numbers for each instance, unless all are at rest.
    pub velocities: Box<[f32]>,
    /// [`FIXED_ROWS`] rows for each instance, in the order of the kernels.
    pub fixed: Box<[Row]>,
    /// The row of each instance in the arrays.
    pub rows: Box<[u32]>,
    pub count: u32,
    /// 1 when there are velocities.
    pub moves: u32,
    /// The time for which the detection looks ahead.
    pub time: f32,
}

#[cube]
fn vector(numbers: &[f32], at: u32) -> V3 {
    let at = at as usize;
    v3(numbers[at], numbers[at + 1], numbers[at + 2])
}

#[cube]
fn are_finite(v: V3) -> bool {
    is_finite(v.x) && is_finite(v.y) && is_finite(v.z)
}

/// Writes the pose and the motion of one instance per thread, as
/// [`Placed::rows`](crate::collide::scene::placed::Placed::rows) and
/// [`crate::kernels::pairs::ahead::rows`] do on the host. Counts poses and velocities that are not
/// finite, and quaternions of other lengths.
#[cube(launch, create_dummy_kernel)]
pub fn place(given: &PoseArrays, counters: &Counters, rows: &mut [Row]) {
    let i = ABSOLUTE_POS as u32;
    if i < given.count {
        let row = given.rows[i as usize];
        let at = row * POSE;
        let origin = vector(&given.poses, at);
        let axis = vector(&given.poses, at + 3u32);
        let scalar = given.poses[(at + 6u32) as usize];
        let length = (axis.dot(axis) + scalar * scalar).sqrt();
        let mut way = zero();
        let mut turn = zero();
        if given.moves == 1u32 {
            way = vector(&given.velocities, row * VELOCITY) * given.time;
            turn = vector(&given.velocities, row * VELOCITY + 3u32) * given.time;
        }
        let is_pose = are_finite(origin) && is_finite(length) && (length - 1.0f32).abs() <= UNIT_LENGTH;
        let is_good = is_pose && are_finite(way) && are_finite(turn);
        if !is_good {
            counters.append(BADLY_PLACED);
        }
        let divisor = select(is_pose, length, 1.0f32);
        let rotation = Rotation { axis: axis * (1.0f32 / divisor), scalar: scalar / divisor };
        let fixed = (i * FIXED_ROWS) as usize;
        let unit = last(given.fixed[fixed]);
        let reach = given.fixed[fixed + 1].extract(0usize);
        let to_field = rotation.rotate(xyz(given.fixed[fixed]));
        let to = (i * POSE_ROWS) as usize;
        rows[to] = row_of(origin, unit);
        rows[to + 1] = row_of(to_field, 0.0f32);
        rows[to + 2] = row_of(rotation.axis, rotation.scalar);
        let angle = turn.length();
        let arc = select(angle > 0.0f32, angle * reach, 0.0f32);
        let motion = (way.length() + arc).min(FAR.runtime());
        let to = (given.count * POSE_ROWS + i * MOTION_ROWS) as usize;
        rows[to] = row_of(way, reach);
        rows[to + 1] = row_of(turn, motion);
        rows[to + 2] = row_of(to_field.negated(), 0.0f32);
    }
}
