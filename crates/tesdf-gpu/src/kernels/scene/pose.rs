//! Poses of instances in the world.
//!
//! Mirrors `collide/scene/pose.rs` of `tesdf`.
use cubecl::prelude::*;

use crate::kernels::geometry::vector::{Row, V3, last, xyz};

/// Rows of a pose, in the layout of [`Placed::rows`](crate::collide::scene::placed::Placed::rows).
pub const ROWS: u32 = 3;

/// A rotation as a unit quaternion.
#[derive(CubeType, Clone, Copy)]
#[expand(derive(Clone, Copy))]
pub struct Rotation {
    /// The vector part.
    pub axis: V3,
    pub scalar: f32,
}

#[cube]
impl Rotation {
    pub fn rotate(self, v: V3) -> V3 {
        let once = self.axis.cross(v) * 2.0f32;
        (v + once * self.scalar) + self.axis.cross(once)
    }

    pub fn rotate_back(self, v: V3) -> V3 {
        let back = Rotation { axis: self.axis.negated(), scalar: self.scalar };
        back.rotate(v)
    }
}

/// A point as the sum of a high and a low `f32`, which keeps precision far from zero.
#[derive(CubeType, Clone, Copy)]
#[expand(derive(Clone, Copy))]
pub struct FarPoint {
    pub high: V3,
    pub low: V3,
}

#[cube]
impl FarPoint {
    /// The vector from `origin` to this point.
    pub fn from(self, origin: FarPoint) -> V3 {
        (self.high - origin.high) + (self.low - origin.low)
    }
}

/// Farther out than this in the frame of a field, a point is looked at from nearer. Squares of
/// distances stay below [`FAR`](crate::kernels::query::nearest::FAR).
const OUT: f32 = 1e14;

/// A point in the frame of a field, on the way from its origin to the point that is meant.
#[derive(CubeType, Clone, Copy)]
#[expand(derive(Clone, Copy))]
pub struct Seen {
    pub local: V3,
    /// How many times as far out the point that is meant is: 1 up to [`OUT`]. Farther out, so is
    /// its distance, up to the share of the body in it.
    pub farther: f32,
}

/// The frame of an instance's field in the world.
#[derive(CubeType, Clone, Copy)]
#[expand(derive(Clone, Copy))]
pub struct Pose {
    pub origin: FarPoint,
    pub rotation: Rotation,
    /// Length of one unit of the frame, in world units.
    pub unit: f32,
}

/// Reads pose `number`.
#[cube]
pub fn pose(rows: &[Row], number: u32) -> Pose {
    let at = (number * ROWS) as usize;
    let (p, q, r) = (rows[at], rows[at + 1], rows[at + 2]);
    Pose {
        origin: FarPoint { high: xyz(p), low: xyz(q) },
        rotation: Rotation { axis: xyz(r), scalar: last(r) },
        unit: last(p),
    }
}

#[cube]
impl Pose {
    /// Transforms a point from the world to the frame.
    pub fn to_local(self, p: FarPoint) -> V3 {
        self.rotation.rotate_back(p.from(self.origin)) * (1.0f32 / self.unit)
    }

    /// Looks at a point of the world from the frame.
    pub fn see(self, p: FarPoint) -> Seen {
        let away = p.from(self.origin);
        let farther = (away.abs().greatest() / (OUT * self.unit)).max(1.0f32);
        let near = away * (1.0f32 / farther);
        Seen { local: self.rotation.rotate_back(near) * (1.0f32 / self.unit), farther }
    }

    /// Transforms a point from the frame to the world, rounded to `f32`.
    pub fn to_world(self, p: V3) -> V3 {
        (self.rotation.rotate(p * self.unit) + self.origin.low) + self.origin.high
    }
}

#[cfg(test)]
mod tests {
    use glam::{DQuat, DVec3, Vec3};

    use super::*;
    use crate::collide::scene::placed::split;
    use crate::kernels::geometry::vector::v3;

    fn of(p: Vec3) -> V3 {
        v3(p.x, p.y, p.z)
    }

    fn f64_of(p: V3) -> DVec3 {
        Vec3::new(p.x, p.y, p.z).as_dvec3()
    }

    /// Points agree with those of the processor, also where `f32` alone would have errors as large
    /// as bodies.
    #[test]
    fn poses_far_from_zero_keep_their_precision() {
        let mut random = fastrand::Rng::with_seed(2);
        let mut point = || DVec3::from_array(std::array::from_fn(|_| random.f64() - 0.5));
        let far = |p: DVec3| {
            let (high, low) = split(p);
            FarPoint { high: of(high), low: of(low) }
        };
        for k in 0..2000 {
            let rotation = DQuat::from_scaled_axis(4.0 * point());
            let origin = 10f64.powi(k % 6) * point();
            let unit = 2.0 * point().length() + 0.1;
            let q = rotation.as_quat();
            let pose = Pose {
                origin: far(origin),
                rotation: Rotation { axis: v3(q.x, q.y, q.z), scalar: q.w },
                unit: unit as f32,
            };
            let local = point();
            let world = origin + rotation * (unit * local);
            let found = f64_of(pose.to_local(far(world)));
            // Two `f32` leave an error of 2^-48 of the distance from zero.
            let bound = 2e-6 + 1e-13 * origin.length() / unit;
            assert!(found.distance(local) < bound, "{found} instead of {local}, {origin} away");
            let back = f64_of(pose.to_world(of(local.as_vec3())));
            assert!(back.distance(world) < 1e-6 * (1.0 + world.length()), "{back} instead of {world}");
        }
    }
}
