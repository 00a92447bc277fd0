//! Signed distances of many points to many instances.
//!
//! Mirrors `query/batch.rs` of `tesdf`.
use cubecl::prelude::*;

use crate::kernels::geometry::vector::{Row, V3, from_bits, pick, row_of, to_bits, v3, xyz, zero};
use crate::kernels::scene::pose::{FarPoint, pose};
use crate::kernels::scene::shape::Shapes;

/// Rows of an answer in the field's frame: gradient and distance; closest point, and the number by
/// which the distance is to be multiplied.
pub const ANSWER_ROWS: u32 = 2;

/// The instances of a query.
#[derive(CubeType, CubeLaunch)]
pub struct Instances {
    /// The poses of the instances.
    pub poses: Box<[Row]>,
    /// The index of each instance's shape.
    pub shapes: Box<[u32]>,
}

/// The answers of a launch.
#[derive(CubeType, CubeLaunch)]
pub struct Answers {
    /// [`ANSWER_ROWS`] rows for each answer.
    pub rows: Box<[Row]>,
    /// Index of the nearest face for each answer.
    pub faces: Box<[u32]>,
}

/// The answers of a launch, as a range of all pairs of an instance and a point. The pairs are
/// ordered by instance, then by point.
#[derive(CubeType, CubeLaunch)]
pub struct Batch {
    pub points: u32,
    pub first: u32,
    pub count: u32,
}

/// Computes one answer per thread. `points` has two rows for each point: the high and the low
/// `f32`.
#[cube(launch, create_dummy_kernel)]
pub fn signed_distances(
    shapes: &Shapes,
    instances: &Instances,
    points: &[Row],
    answers: &mut Answers,
    batch: &Batch,
) {
    let index = ABSOLUTE_POS as u32;
    if index < batch.count {
        let pair = batch.first + index;
        let instance = pair / batch.points;
        let at = (2u32 * (pair % batch.points)) as usize;
        let p = FarPoint { high: xyz(points[at]), low: xyz(points[at + 1]) };
        let seen = pose(&instances.poses, instance).see(p);
        let v = shapes.field(instances.shapes[instance as usize]).answer(seen.local);
        let out = (index * ANSWER_ROWS) as usize;
        answers.rows[out] = row_of(v.gradient, v.distance);
        answers.rows[out + 1] = row_of(v.point, seen.farther);
        answers.faces[index as usize] = v.face;
    }
}

/// Points with a greater coordinate are looked at from there, because differences and products of
/// it may not be `f32`.
pub const FARTHEST: f32 = 1e37;
/// The largest `f32`, for distances that are larger.
const LARGEST: f32 = f32::MAX;

/// Answers in the world frame. A vector takes three numbers.
#[derive(CubeType, CubeLaunch)]
pub struct WorldAnswers {
    pub distances: Box<[f32]>,
    pub gradients: Box<[f32]>,
    pub closest: Box<[f32]>,
    pub faces: Box<[u32]>,
}

/// Computes one answer per thread, in `f32`. `points` has three numbers for each point, in the
/// world frame.
#[cube(launch, create_dummy_kernel)]
pub fn world_distances(
    shapes: &Shapes,
    instances: &Instances,
    points: &[f32],
    answers: &mut WorldAnswers,
    point_count: u32,
    count: u32,
) {
    let index = ABSOLUTE_POS as u32;
    if index < count {
        let instance = index / point_count;
        let at = (3u32 * (index % point_count)) as usize;
        let (x, y, z) = (points[at], points[at + 1], points[at + 2]);
        let finite = is_finite(x) && is_finite(y) && is_finite(z);
        let p = pick(finite, v3(x, y, z), zero());
        let farther = (p.abs().greatest() / FARTHEST).max(1.0f32);
        let frame = pose(&instances.poses, instance);
        let seen = frame.see(FarPoint { high: p * (1.0f32 / farther), low: zero() });
        let v = shapes.field(instances.shapes[instance as usize]).answer(seen.local);
        let distance = ((v.distance * frame.unit) * seen.farther) * farther;
        answers.distances[index as usize] = or_nan(finite, distance.clamp(-LARGEST, LARGEST));
        put(&mut answers.gradients, index, finite, frame.rotation.rotate(v.gradient));
        put(&mut answers.closest, index, finite, frame.to_world(v.point));
        answers.faces[index as usize] = select(finite, v.face, u32::MAX);
    }
}

#[cube]
fn put(numbers: &mut [f32], index: u32, finite: bool, v: V3) {
    let at = (3u32 * index) as usize;
    numbers[at] = or_nan(finite, v.x);
    numbers[at + 1] = or_nan(finite, v.y);
    numbers[at + 2] = or_nan(finite, v.z);
}

const EXPONENT: u32 = 0x7F80_0000;
const NAN: u32 = 0x7FC0_0000;

/// Tests the bits, because a shader may assume that all numbers are finite.
#[cube]
pub fn is_finite(x: f32) -> bool {
    to_bits(x) & EXPONENT != EXPONENT
}

/// The number `x`, or NaN when `is_number` is false.
#[cube]
fn or_nan(is_number: bool, x: f32) -> f32 {
    from_bits(select(is_number, to_bits(x), NAN))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_that_are_not_finite_have_no_answer() {
        for x in [0.0, -1.5, f32::MIN_POSITIVE / 2.0, f32::MAX] {
            assert!(is_finite(x) && is_finite(-x));
            assert_eq!(or_nan(true, x), x);
        }
        for x in [f32::INFINITY, f32::NEG_INFINITY, f32::NAN, -f32::NAN] {
            assert!(!is_finite(x));
        }
        assert!(or_nan(false, 1.0).is_nan());
    }
}
