//! Vectors of three `f32`, and the rows of four in which buffers hold them.
use std::ops::{Add, Mul, Sub};

use cubecl::prelude::*;

/// Four `f32`, which a kernel reads and writes together.
pub type Row = Vector<f32, Const<4>>;

/// Smallest divisor. Smaller numbers count as zero, because a shader may flush tiny numbers to
/// zero.
pub const LEAST_DIVISOR: f32 = 1e-30;

/// A point or a direction.
#[derive(CubeType, CubeTypeMut, Clone, Copy, Debug, PartialEq)]
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

/// A vector of zeros.
#[cube]
pub fn zero() -> V3 {
    v3(0.0f32, 0.0f32, 0.0f32)
}

/// The operators `+`, `-` and `*` in kernels expand to the first three methods.
#[cube]
impl V3 {
    pub fn add(self, other: V3) -> V3 {
        v3(self.x + other.x, self.y + other.y, self.z + other.z)
    }

    pub fn sub(self, other: V3) -> V3 {
        v3(self.x - other.x, self.y - other.y, self.z - other.z)
    }

    pub fn mul(self, factor: f32) -> V3 {
        v3(factor * self.x, factor * self.y, factor * self.z)
    }

    pub fn negated(self) -> V3 {
        v3(-self.x, -self.y, -self.z)
    }

    pub fn dot(self, other: V3) -> f32 {
        self.x * other.x + self.y * other.y + self.z * other.z
    }

    pub fn cross(self, other: V3) -> V3 {
        v3(
            self.y * other.z - self.z * other.y,
            self.z * other.x - self.x * other.z,
            self.x * other.y - self.y * other.x,
        )
    }

    pub fn length(self) -> f32 {
        self.dot(self).sqrt()
    }

    pub fn min(self, other: V3) -> V3 {
        v3(self.x.min(other.x), self.y.min(other.y), self.z.min(other.z))
    }

    pub fn max(self, other: V3) -> V3 {
        v3(self.x.max(other.x), self.y.max(other.y), self.z.max(other.z))
    }

    pub fn abs(self) -> V3 {
        v3(self.x.abs(), self.y.abs(), self.z.abs())
    }

    /// The smallest coordinate.
    pub fn least(self) -> f32 {
        self.x.min(self.y).min(self.z)
    }

    /// The largest coordinate.
    pub fn greatest(self) -> f32 {
        self.x.max(self.y).max(self.z)
    }

    /// Coordinate `axis`.
    pub fn at(self, axis: u32) -> f32 {
        select(axis == 0u32, self.x, select(axis == 1u32, self.y, self.z))
    }

    /// Whether each coordinate is at most that of `other`.
    pub fn is_at_most(self, other: V3) -> bool {
        self.x <= other.x && self.y <= other.y && self.z <= other.z
    }
}

impl Add for V3 {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        V3::add(self, other)
    }
}

impl Sub for V3 {
    type Output = Self;

    fn sub(self, other: Self) -> Self {
        V3::sub(self, other)
    }
}

impl Mul<f32> for V3 {
    type Output = Self;

    fn mul(self, factor: f32) -> Self {
        V3::mul(self, factor)
    }
}

/// Returns `first` when the condition is true, otherwise `second`. This needs no branch.
#[cube]
pub fn pick(condition: bool, first: V3, second: V3) -> V3 {
    v3(
        select(condition, first.x, second.x),
        select(condition, first.y, second.y),
        select(condition, first.z, second.z),
    )
}

/// A third.
pub const THIRD: f32 = 0.333_333_34;

/// The mean of three points.
#[cube]
pub fn centroid(a: V3, b: V3, c: V3) -> V3 {
    ((a + b) + c) * THIRD
}

/// Whether both conditions are equal. CubeCL's CUDA C++ cannot compare truth values.
#[cube]
pub fn same(a: bool, b: bool) -> bool {
    (a && b) || (!a && !b)
}

/// Distance of a point from a box along each axis; 0 where the point is within.
#[cube]
pub fn outside_box(p: V3, low: V3, high: V3) -> V3 {
    (low - p).max(p - high).max(zero())
}

/// A row of four numbers.
#[cube]
pub fn row(x: f32, y: f32, z: f32, w: f32) -> Row {
    let mut row = Row::empty();
    row.insert(0usize, x);
    row.insert(1usize, y);
    row.insert(2usize, z);
    row.insert(3usize, w);
    row
}

/// A row of a vector and a number.
#[cube]
pub fn row_of(v: V3, w: f32) -> Row {
    row(v.x, v.y, v.z, w)
}

/// The first three numbers of a row.
#[cube]
pub fn xyz(row: Row) -> V3 {
    v3(row.extract(0usize), row.extract(1usize), row.extract(2usize))
}

/// The last number of a row.
#[cube]
pub fn last(row: Row) -> f32 {
    row.extract(3usize)
}

/// The bits of a number. CubeCL's `u32::reinterpret` has no implementation on the host.
pub fn to_bits(x: f32) -> u32 {
    x.to_bits()
}

/// The implementation on the device.
pub mod to_bits {
    use super::*;

    pub fn expand(scope: &Scope, x: NativeExpand<f32>) -> NativeExpand<u32> {
        u32::__expand_reinterpret(scope, x)
    }
}

/// The number with these bits.
pub fn from_bits(bits: u32) -> f32 {
    f32::from_bits(bits)
}

/// The implementation on the device.
pub mod from_bits {
    use super::*;

    pub fn expand(scope: &Scope, bits: NativeExpand<u32>) -> NativeExpand<f32> {
        f32::__expand_reinterpret(scope, bits)
    }
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;

    #[test]
    fn vectors_are_those_of_glam() {
        let mut random = fastrand::Rng::with_seed(1);
        let mut number = || random.f32() - 0.5;
        let glam = |v: V3| Vec3::new(v.x, v.y, v.z);
        for _ in 0..1000 {
            let [a, b] = [(); 2].map(|()| v3(number(), number(), number()));
            let (p, q) = (glam(a), glam(b));
            let found = [a + b, a - b, a * b.x, a.negated(), a.cross(b), a.min(b), a.max(b), a.abs()];
            let expected = [p + q, p - q, p * q.x, -p, p.cross(q), p.min(q), p.max(q), p.abs()];
            assert_eq!(found.map(glam), expected);
            assert_eq!([a.dot(b), a.least(), a.greatest()], [p.dot(q), p.min_element(), p.max_element()]);
            assert_eq!([0, 1, 2].map(|axis| a.at(axis)), p.to_array());
            assert_eq!(a.is_at_most(b), p.cmple(q).all());
            let outside = (p - q.abs()).max(-q.abs() - p).max(Vec3::ZERO);
            assert_eq!(glam(outside_box(a, b.abs().negated(), b.abs())), outside);
            assert_eq!(from_bits(to_bits(a.x)), a.x);
        }
    }
}
