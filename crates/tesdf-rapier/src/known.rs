//! Converts shapes of parry to shapes of the detector.
use glam::{DQuat, DVec3};
use rapier3d_f64::geometry::{Cylinder, Shape as ParryShape, TypedShape};
use rapier3d_f64::math::Pose as ParryPose;
use tesdf::collide::{Pose, Shape};

use crate::TesdfShape;

/// A shape of the detector, and its pose in the frame of parry's shape.
pub struct Known {
    pub shape: Shape,
    pub scale: f64,
    /// Pose of the detector's frame in parry's frame. A plane of the detector faces z, and a
    /// capsule or cylinder lies along z.
    pub pose: Pose,
}

impl Known {
    /// Converts an encoded mesh, half space, cuboid, ball, capsule or cylinder. Returns `None` for other
    /// shapes.
    pub fn new(shape: &dyn ParryShape) -> Option<Self> {
        if let Some(mesh) = shape.as_shape::<TesdfShape>() {
            return Some(Self {
                shape: mesh.asset().clone().into(),
                scale: mesh.scale(),
                pose: Pose::at(DVec3::ZERO),
            });
        }
        let rotation_to = |axis: DVec3| DQuat::from_rotation_arc(DVec3::Z, axis);
        let (shape, translation, rotation) = match shape.as_typed_shape() {
            TypedShape::HalfSpace(half_space) => (Shape::Plane, DVec3::ZERO, rotation_to(half_space.normal)),
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
                (shape, 0.5 * (segment.a + segment.b), rotation_to(axis.normalize_or(DVec3::Z)))
            }
            TypedShape::Cylinder(cylinder) => {
                let Cylinder { half_height, radius } = *cylinder;
                (Shape::Cylinder { half_height, radius }, DVec3::ZERO, rotation_to(DVec3::Y))
            }
            _ => return None,
        };
        Some(Self { shape, scale: 1.0, pose: Pose { translation, rotation } })
    }

    pub fn is_mesh(&self) -> bool {
        matches!(self.shape, Shape::Mesh(_))
    }
}

/// Converts a pose. Rounding may have changed the length of its rotation; the scene normalises it.
pub fn pose(pose: &ParryPose) -> Pose {
    Pose { translation: pose.translation, rotation: pose.rotation }
}

/// Converts a pose to parry's type.
pub fn parry_pose(pose: Pose) -> ParryPose {
    ParryPose::from_parts(pose.translation, pose.rotation)
}
