//! Poses of instances, in the layout of the kernels.
use glam::{DQuat, DVec3, Vec3};
use tesdf::collide::{Placement, Shape};

/// The frame in which a shape's field is computed. For a mesh it is the local frame, moved to the
/// center of the cube. For other shapes it is the shape's own frame.
#[derive(Clone, Copy, Debug)]
pub struct FieldFrame {
    /// Its origin in the shape's frame.
    origin: DVec3,
    /// Length of one unit of the field, in the shape's unit.
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

    /// Length of one unit of the field, in the shape's unit.
    pub fn unit(&self) -> f64 {
        self.unit
    }
}

/// The frame of a field with its pose in the world.
#[derive(Clone, Copy, Debug)]
pub struct Placed {
    /// Its origin in the world.
    pub origin: DVec3,
    /// Its rotation.
    pub rotation: DQuat,
    /// Length of one unit of the field, in the world's unit.
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

    /// Transforms a point from the field's frame to the world.
    pub fn to_world(self, p: Vec3) -> DVec3 {
        self.rotation * (self.unit * p.as_dvec3()) + self.origin
    }

    /// Rotates a direction from the field's frame to the world.
    pub fn rotate(self, v: Vec3) -> DVec3 {
        self.rotation * v.as_dvec3()
    }

    /// The rows that `kernels::scene::pose` reads: the origin rounded to `f32`, with the unit; the
    /// remainder of the origin; the quaternion x, y, z, w.
    pub fn rows(self) -> [[f32; 4]; 3] {
        let (high, low) = split(self.origin);
        [
            [high.x, high.y, high.z, self.unit as f32],
            [low.x, low.y, low.z, 0.0],
            self.rotation.as_quat().to_array(),
        ]
    }
}

/// Splits a point into a high and a low `f32`, which together keep the precision far from zero.
pub fn split(p: DVec3) -> (Vec3, Vec3) {
    let high = p.as_vec3();
    (high, (p - high.as_dvec3()).as_vec3())
}
