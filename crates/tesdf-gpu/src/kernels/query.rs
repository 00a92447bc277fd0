//! Signed distances of many points to many instances.
use cubecl::prelude::*;

use super::assets::Assets;
use super::field::value;
use super::pose::{ROWS, difference, pose, turn_back};
use super::vector::{scaled, v3};

/// Rows of an answer: distance and gradient, closest point; in the field's frame.
pub const ANSWER_ROWS: usize = 2;

/// A thread for each point of each instance. `points` are two rows each, sums of two.
#[cube(launch)]
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
