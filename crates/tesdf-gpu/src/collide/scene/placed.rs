//! The poses of instances, as kernels read them.
use glam::{DQuat, DVec3, Vec3};
use tesdf::collide::{Placement, Shape};

/// The frame that a shape's field is computed in: the local frame of a mesh relative to the middle of its cube; of all
/// others the shape's own frame.
#[derive(Clone, Copy, Debug)]
pub struct FieldFrame {
    /// Where its origin is, in the shape's frame.
    origin: DVec3,
    /// The shape's unit per unit of the field's.
    unit: f64,
}

impl FieldFrame {
    pub fn new(shape: &Shape) -> Self {
        match shape {
            Shape::Mesh(asset) => {
                let arrays = asset.arrays();
                Self {
                    origin: arrays.frame.to_world(arrays.cube.middle()),
                    unit: arrays.frame.inverse_scale(),
                }
            }
            _ => Self { origin: DVec3::ZERO, unit: 1.0 },
        }
    }

    /// The shape's unit per unit of the field's.
    pub fn unit(&self) -> f64 {
        self.unit
    }
}

/// A field's frame, placed in the world.
#[derive(Clone, Copy, Debug)]
pub struct Placed {
    /// Where its origin is.
    pub origin: DVec3,
    /// Its rotation.
    pub rotation: DQuat,
    /// World units per unit of the field.
    pub unit: f64,
}

impl Placed {
    pub fn new(frame: FieldFrame, placement: Placement) -> Self {
        Self {
            origin: placement.to_world(frame.origin),
            rotation: placement.pose.rotation,
            unit: placement.scale * frame.unit,
        }
    }

    /// From the field's frame to the world.
    pub fn to_world(self, p: Vec3) -> DVec3 {
        self.rotation * (self.unit * p.as_dvec3()) + self.origin
    }

    /// A direction, likewise.
    pub fn rotate(self, v: Vec3) -> DVec3 {
        self.rotation * v.as_dvec3()
    }

    /// Rows for the device, as `kernels::math::pose` reads them: origin rounded to `f32` and the unit, the rest of the
    /// origin, the quaternion x y z w.
    pub fn rows(self) -> [[f32; 4]; 3] {
        let (high, low) = split(self.origin);
        [
            [high.x, high.y, high.z, self.unit as f32],
            [low.x, low.y, low.z, 0.0],
            self.rotation.as_quat().to_array(),
        ]
    }
}

/// A point as high + low `f32`, which keeps precision far from zero.
pub fn split(p: DVec3) -> (Vec3, Vec3) {
    let high = p.as_vec3();
    (high, (p - high.as_dvec3()).as_vec3())
}
