//! Signed distances of many points to many instances.
use cubecl::prelude::*;

use super::assets::Assets;
use super::field::value;
use super::pose::{ROWS, difference, pose, turn, turn_back};
use super::vector::{pick, plus, scaled, v3};

/// Rows of an answer: distance and gradient, closest point; in the field's frame.
pub const ANSWER_ROWS: usize = 2;

/// A thread for each point of each instance. `points` are two rows each, sums of two.
#[cube(launch, create_dummy_kernel)]
pub fn signed_distances(
    assets: &Assets,
    instances: &[Vector<f32, Const<4>>],
    shapes: &[u32],
    points: &[Vector<f32, Const<4>>],
    answers: &mut [Vector<f32, Const<4>>],
    faces: &mut [u32],
    point_count: u32,
    first: u32,
    count: u32,
) {
    let index = ABSOLUTE_POS as u32;
    if index < count {
        let pair = first + index;
        let instance = pair / point_count;
        let at = (2u32 * (pair % point_count)) as usize;
        let (p, q) = (points[at], points[at + 1]);
        let frame = pose(instances, (instance * comptime!(ROWS as u32)) as usize);
        let from_origin = difference(
            v3(p.extract(0usize), p.extract(1usize), p.extract(2usize)),
            v3(q.extract(0usize), q.extract(1usize), q.extract(2usize)),
            frame.high,
            frame.low,
        );
        let local = scaled(1.0f32 / frame.unit, turn_back(frame.axis, frame.scalar, from_origin));
        let v = value(assets, shapes[instance as usize], local);
        let out = (index * comptime!(ANSWER_ROWS as u32)) as usize;
        let mut row = Vector::<f32, Const<4>>::empty();
        row.insert(0usize, v.distance);
        row.insert(1usize, v.gradient.x);
        row.insert(2usize, v.gradient.y);
        row.insert(3usize, v.gradient.z);
        answers[out] = row;
        let mut row = Vector::<f32, Const<4>>::empty();
        row.insert(0usize, v.point.x);
        row.insert(1usize, v.point.y);
        row.insert(2usize, v.point.z);
        row.insert(3usize, 0.0f32);
        answers[out + 1] = row;
        faces[index as usize] = v.face;
    }
}

/// A thread for each point of each instance: the same in the world, in `f32` alone. `points`, `gradients` and `closest` are three numbers each.
#[cube(launch, create_dummy_kernel)]
pub fn world_distances(
    assets: &Assets,
    instances: &[Vector<f32, Const<4>>],
    shapes: &[u32],
    points: &[f32],
    distances: &mut [f32],
    gradients: &mut [f32],
    closest: &mut [f32],
    faces: &mut [u32],
    point_count: u32,
    count: u32,
) {
    let index = ABSOLUTE_POS as u32;
    if index < count {
        let instance = index / point_count;
        let at = (3u32 * (index % point_count)) as usize;
        let (x, y, z) = (points[at], points[at + 1], points[at + 2]);
        let finite = is_finite(x) && is_finite(y) && is_finite(z);
        let p = pick(finite, v3(x, y, z), v3(0.0f32, 0.0f32, 0.0f32));
        let frame = pose(instances, (instance * comptime!(ROWS as u32)) as usize);
        let from_origin = difference(p, v3(0.0f32, 0.0f32, 0.0f32), frame.high, frame.low);
        let local = scaled(1.0f32 / frame.unit, turn_back(frame.axis, frame.scalar, from_origin));
        let v = value(assets, shapes[instance as usize], local);
        let gradient = turn(frame.axis, frame.scalar, v.gradient);
        let from_middle = turn(frame.axis, frame.scalar, scaled(frame.unit, v.point));
        let on = plus(plus(from_middle, frame.low), frame.high);
        let out = (3u32 * index) as usize;
        distances[index as usize] = or_nan(finite, v.distance * frame.unit);
        gradients[out] = or_nan(finite, gradient.x);
        gradients[out + 1] = or_nan(finite, gradient.y);
        gradients[out + 2] = or_nan(finite, gradient.z);
        closest[out] = or_nan(finite, on.x);
        closest[out + 1] = or_nan(finite, on.y);
        closest[out + 2] = or_nan(finite, on.z);
        faces[index as usize] = select(finite, v.face, u32::MAX);
    }
}

const EXPONENT: u32 = 0x7F80_0000;

/// By bits: a shader may assume that there is nothing else.
#[cube]
fn is_finite(x: f32) -> bool {
    u32::reinterpret(x) & EXPONENT != EXPONENT
}

/// The number, or none.
#[cube]
fn or_nan(is_number: bool, x: f32) -> f32 {
    f32::reinterpret(select(is_number, u32::reinterpret(x), 0x7FC0_0000u32))
}
