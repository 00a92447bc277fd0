use glam::{DMat3, DQuat, DVec3};

use crate::collide::scene::error::CollideError;
use crate::geometry::Aabb;

/// A rigid motion from a body's frame to the world's frame: first rotate, then translate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pose {
    /// Position of the body's origin, in the world's unit.
    pub translation: DVec3,
    /// Unit quaternion, x y z w.
    pub rotation: DQuat,
}

/// A quaternion whose length deviates from 1 by at most this is normalised; the deviation counts as
/// rounding.
const UNIT: f64 = 1e-6;

impl Pose {
    /// The body's frame equals the world's.
    pub const IDENTITY: Self = Self { translation: DVec3::ZERO, rotation: DQuat::IDENTITY };

    /// Checks a pose. `rotation` is normalised when its length is within 1e-6 of 1.
    ///
    /// # Errors
    /// [`CollideError::NotAPose`] for other quaternions and for numbers that are not finite.
    pub fn new(translation: DVec3, rotation: DQuat) -> Result<Self, CollideError> {
        let length = rotation.length();
        if !translation.is_finite() || !length.is_finite() {
            return Err(CollideError::NotAPose {
                found: format!("translation {translation}, rotation {rotation}"),
                expected: "finite numbers",
            });
        }
        if (length - 1.0).abs() > UNIT {
            return Err(CollideError::NotAPose {
                found: format!("quaternion {rotation} of length {length}"),
                expected: "length 1, up to 1e-6: divide the quaternion (x y z w) by its length",
            });
        }
        // A quaternion of exactly unit length is kept bit for bit.
        let rotation = if length == 1.0 { rotation } else { rotation / length };
        Ok(Self { translation, rotation })
    }

    /// The pose of a matrix of 4 × 4, given row by row. Its rotation may deviate from an orthonormal
    /// one by 1e-6, which counts as rounding.
    ///
    /// # Errors
    /// [`CollideError::NotAPose`] for other matrices.
    pub fn from_matrix(m: &[f64; 16]) -> Result<Self, CollideError> {
        let refuse = |found: String, expected| Err(CollideError::NotAPose { found, expected });
        if !m.iter().all(|x| x.is_finite()) {
            return refuse(format!("matrix {m:?}"), "finite numbers");
        }
        let [column_x, column_y, column_z, translation] =
            [0, 1, 2, 3].map(|c| DVec3::new(m[c], m[4 + c], m[8 + c]));
        if m[12..] != [0.0, 0.0, 0.0, 1.0] {
            return refuse(
                format!("last row {:?}", &m[12..]),
                "[0, 0, 0, 1]: the translation is the last column",
            );
        }
        let rotation = DMat3::from_cols(column_x, column_y, column_z);
        let deviation = rotation.transpose() * rotation - DMat3::IDENTITY;
        let deviation = deviation.to_cols_array().into_iter().map(f64::abs).fold(0.0, f64::max);
        if deviation > UNIT || rotation.determinant() < 0.0 {
            return refuse(
                format!("a matrix that deforms or mirrors: columns {column_x}, {column_y}, {column_z}"),
                "three unit vectors, at right angles up to 1e-6 and right-handed; `scale` is an argument of its own",
            );
        }
        Self::new(translation, DQuat::from_mat3(&rotation).normalize())
    }

    /// A pose without rotation.
    pub fn at(translation: DVec3) -> Self {
        Self { translation, rotation: DQuat::IDENTITY }
    }

    /// From the body's frame to the world's frame.
    pub fn to_world(self, p: DVec3) -> DVec3 {
        self.rotation * p + self.translation
    }

    /// From the world's frame to the body's frame.
    pub fn to_body(self, p: DVec3) -> DVec3 {
        self.rotation.inverse() * (p - self.translation)
    }

    /// The motion that first applies `other`, then `self`.
    pub fn after(self, other: Self) -> Self {
        Self { translation: self.to_world(other.translation), rotation: self.rotation * other.rotation }
    }
}

/// A pose and a uniform scale: `world = rotation · (scale · p) + translation`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Placement {
    /// Rotation and translation.
    pub pose: Pose,
    /// World units per unit of the shape; positive.
    pub scale: f64,
}

impl Placement {
    /// From the shape's frame to the world's frame.
    pub fn to_world(self, p: DVec3) -> DVec3 {
        self.pose.to_world(self.scale * p)
    }

    /// From the world's frame to the shape's frame.
    pub fn to_shape(self, p: DVec3) -> DVec3 {
        self.pose.to_body(p) / self.scale
    }

    /// The smallest box in the world around a box of the shape's frame.
    pub fn bounds(self, shape: Aabb) -> Aabb {
        let (center, half) = (self.to_world(shape.center()), 0.5 * self.scale * shape.extent());
        let axes = glam::DMat3::from_quat(self.pose.rotation);
        let reach = axes.x_axis.abs() * half.x + axes.y_axis.abs() * half.y + axes.z_axis.abs() * half.z;
        Aabb { min: center - reach, max: center + reach }
    }
}
