//! Vectors of three `f32`.
use cubecl::prelude::*;

/// A point or a direction.
#[derive(CubeType, Clone, Copy, Debug, PartialEq)]
#[expand(derive(Clone, Copy))]
pub struct V3 {
    pub x: f32,
    pub y: f32,
    pub z: f32,
}

#[cube]
pub fn v3(x: f32, y: f32, z: f32) -> V3 {
    V3 { x, y, z }
}

#[cube]
pub fn plus(a: V3, b: V3) -> V3 {
    V3 { x: a.x + b.x, y: a.y + b.y, z: a.z + b.z }
}

#[cube]
pub fn minus(a: V3, b: V3) -> V3 {
    V3 { x: a.x - b.x, y: a.y - b.y, z: a.z - b.z }
}

/// `a + s · b`.
#[cube]
pub fn plus_scaled(a: V3, s: f32, b: V3) -> V3 {
    V3 { x: a.x + s * b.x, y: a.y + s * b.y, z: a.z + s * b.z }
}

#[cube]
pub fn scaled(s: f32, a: V3) -> V3 {
    V3 { x: s * a.x, y: s * a.y, z: s * a.z }
}

#[cube]
pub fn dot(a: V3, b: V3) -> f32 {
    a.x * b.x + a.y * b.y + a.z * b.z
}

#[cube]
pub fn cross(a: V3, b: V3) -> V3 {
    V3 { x: a.y * b.z - a.z * b.y, y: a.z * b.x - a.x * b.z, z: a.x * b.y - a.y * b.x }
}

#[cube]
pub fn length(a: V3) -> f32 {
    dot(a, a).sqrt()
}

/// `first` where the condition holds, else `second`.
#[cube]
pub fn pick(first: bool, a: V3, b: V3) -> V3 {
    V3 { x: select(first, a.x, b.x), y: select(first, a.y, b.y), z: select(first, a.z, b.z) }
}

/// Whether both hold or neither does; CubeCL's CUDA C++ cannot compare truth values.
#[cube]
pub fn same(a: bool, b: bool) -> bool {
    (a && b) || (!a && !b)
}
