//! From the frame of one instance to that of another, and from the world to an instance.
use cubecl::prelude::*;

use super::vector::{V3, cross, minus, plus, plus_scaled, scaled, v3};

/// Rows of four `f32` that [`Placed`](crate::placed::Placed) writes.
pub const ROWS: usize = 3;

/// A placed frame.
#[derive(CubeType, Clone, Copy)]
#[expand(derive(Clone, Copy))]
pub struct Pose {
    /// The origin is the sum of two: what far away differences are small as exact as near.
    pub high: V3,
    pub low: V3,
    /// Vector part and scalar part of the quaternion.
    pub axis: V3,
    pub scalar: f32,
    /// World units per unit of the frame.
    pub unit: f32,
}

/// Reads a pose; `at` is its first row.
#[cube]
pub fn pose(rows: &[Vector<f32, Const<4>>], at: usize) -> Pose {
    let (p, q, r) = (rows[at], rows[at + 1], rows[at + 2]);
    Pose {
        high: v3(p.extract(0usize), p.extract(1usize), p.extract(2usize)),
        low: v3(q.extract(0usize), q.extract(1usize), q.extract(2usize)),
        axis: v3(r.extract(0usize), r.extract(1usize), r.extract(2usize)),
        scalar: r.extract(3usize),
        unit: p.extract(3usize),
    }
}

/// Turns a direction.
#[cube]
pub fn turn(axis: V3, scalar: f32, v: V3) -> V3 {
    let once = scaled(2.0f32, cross(axis, v));
    plus(plus_scaled(v, scalar, once), cross(axis, once))
}

/// Turns it back.
#[cube]
pub fn turn_back(axis: V3, scalar: f32, v: V3) -> V3 {
    turn(scaled(-1.0f32, axis), scalar, v)
}

/// Two sums of two, subtracted.
#[cube]
pub fn difference(high: V3, low: V3, of_high: V3, of_low: V3) -> V3 {
    plus(minus(high, of_high), minus(low, of_low))
}
