//! From shapes of parry to those of the detector.
use glam::{DQuat, DVec3};
use rapier3d_f64::geometry::{Shape as ParryShape, TypedShape};
use rapier3d_f64::math::Pose as ParryPose;
use tesdf::collide::{Pose, Shape};

use crate::TesdfShape;

/// A shape that the detector knows, in the frame of parry's.
pub struct Known {
    pub shape: Shape,
    pub scale: f64,
    /// The detector's frame in parry's: its plane faces z, its capsule lies along z.
    pub pose: Pose,
}

impl Known {
    /// Of an encoded mesh, half space, cuboid, ball or capsule.
    pub fn new(shape: &dyn ParryShape) -> Option<Self> {
        if let Some(mesh) = shape.as_shape::<TesdfShape>() {
            return Some(Self {
                shape: mesh.asset().clone().into(),
                scale: mesh.scale(),
                pose: Pose::at(DVec3::ZERO),
            });
        }
        let turn = |axis: DVec3| DQuat::from_rotation_arc(DVec3::Z, axis);
        let (shape, translation, rotation) = match shape.as_typed_shape() {
            TypedShape::HalfSpace(half_space) => (Shape::Plane, DVec3::ZERO, turn(half_space.normal)),
            TypedShape::Cuboid(cuboid) => {
                (Shape::Box { half_extents: cuboid.half_extents }, DVec3::ZERO, DQuat::IDENTITY)
            }
            TypedShape::Ball(ball) => (Shape::Sphere { radius: ball.radius }, DVec3::ZERO, DQuat::IDENTITY),
            TypedShape::Capsule(capsule) => {
                let (segment, radius) = (capsule.segment, capsule.radius);
                let axis = segment.b - segment.a;
                let shape = match 0.5 * axis.length() {
                    0.0 => Shape::Sphere { radius },
                    half_height => Shape::Capsule { half_height, radius },
                };
                (shape, 0.5 * (segment.a + segment.b), turn(axis.normalize_or(DVec3::Z)))
            }
            _ => return None,
        };
        Some(Self { shape, scale: 1.0, pose: Pose { translation, rotation } })
    }

    pub fn is_mesh(&self) -> bool {
        matches!(self.shape, Shape::Mesh(_))
    }
}

/// The same pose. Its rotation has drifted from unit length by rounding at most, which the scene normalises.
pub fn pose(pose: &ParryPose) -> Pose {
    Pose { translation: pose.translation, rotation: pose.rotation }
}

/// The same pose.
pub fn parry_pose(pose: Pose) -> ParryPose {
    ParryPose::from_parts(pose.translation, pose.rotation)
}
