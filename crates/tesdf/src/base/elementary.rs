//! Elementary functions that have the same bits on every platform.
//!
//! Those of the standard library, and of glam, are those of the platform: glibc, macOS, Windows and
//! browsers differ in the last bits. So whatever reaches the bytes of an asset, of contacts or of a
//! run takes them from here; a test of the structure of the crates sees to it. They are those of the
//! crate `libm`, a translation of musl's, with errors below 1 ulp. Square roots, roundings and
//! `mul_add` are exact in IEEE 754, and so the same everywhere.
use std::f64::consts::PI;

use glam::{DQuat, DVec2, DVec3};

/// The sine and the cosine.
pub use libm::sincos as sin_cos;
pub use libm::{acos, asin, atan2, cos, exp, exp2, hypot, log as ln, log2, log10, pow as powf, sin, tan};

/// An integer power, by squaring. That of the standard library has no promised precision.
#[inline]
pub fn powi(x: f64, n: i32) -> f64 {
    let (mut square, mut left, mut power) = (x, n.unsigned_abs(), 1.0);
    while left > 0 {
        if left & 1 == 1 {
            power *= square;
        }
        left >>= 1;
        square *= square;
    }
    if n < 0 { 1.0 / power } else { power }
}

/// The direction at an angle from x towards y, in radians: `DVec2::from_angle`.
#[inline]
pub fn from_angle(angle: f64) -> DVec2 {
    let (sin, cos) = sin_cos(angle);
    DVec2::new(cos, sin)
}

/// The rotation by an angle, in radians, around an axis of length 1: `DQuat::from_axis_angle`.
#[inline]
pub fn from_axis_angle(axis: DVec3, angle: f64) -> DQuat {
    let (sin, cos) = sin_cos(angle * 0.5);
    let v = axis * sin;
    DQuat::from_xyzw(v.x, v.y, v.z, cos)
}

/// The rotation by the length of a vector, in radians, around it: `DQuat::from_scaled_axis`.
#[inline]
pub fn from_scaled_axis(v: DVec3) -> DQuat {
    let length = v.length();
    if length == 0.0 { DQuat::IDENTITY } else { from_axis_angle(v / length, length) }
}

/// The vector of a rotation, as [`from_scaled_axis`] takes it: `DQuat::to_scaled_axis`.
#[inline]
pub fn to_scaled_axis(rotation: DQuat) -> DVec3 {
    let v = rotation.xyz();
    let length = v.length();
    if length < 1e-8 { DVec3::ZERO } else { v / length * (2.0 * atan2(length, rotation.w)) }
}

/// The least rotation from one direction, of length 1, to another one:
/// `DQuat::from_rotation_arc`.
pub fn from_rotation_arc(from: DVec3, to: DVec3) -> DQuat {
    match from.dot(to) {
        dot if dot < 2.0 * f64::EPSILON - 1.0 => from_axis_angle(from.any_orthonormal_vector(), PI),
        _ => DQuat::from_rotation_arc(from, to),
    }
}

/// The angle between two directions, in radians: `DVec3::angle_between`.
pub fn angle_between(a: DVec3, b: DVec3) -> f64 {
    acos((a.dot(b) / (a.length_squared() * b.length_squared()).sqrt()).clamp(-1.0, 1.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rotations_are_those_of_glam_up_to_rounding() {
        let vectors = [
            DVec3::ZERO,
            DVec3::new(1e-12, 0.0, 0.0),
            DVec3::new(0.3, -1.2, 0.7),
            DVec3::new(0.0, 0.0, 3.1),
            DVec3::new(5.0, 4.0, -3.0),
        ];
        for v in vectors {
            let rotation = from_scaled_axis(v);
            assert!((rotation - DQuat::from_scaled_axis(v)).length() < 1e-15, "{v}");
            let back = to_scaled_axis(rotation);
            assert!((back - rotation.to_scaled_axis()).length() < 1e-15, "{v}: {back}");
        }
        let u = DVec3::new(0.6, 0.0, 0.8);
        for to in [u, -u, DVec3::Y, DVec3::NEG_X, DVec3::new(-0.8, 0.0, 0.6)] {
            let turned = from_rotation_arc(u, to) * u;
            assert!((turned - to).length() < 1e-15, "{to}: {turned}");
        }
    }

    #[test]
    fn integer_powers_are_products() {
        for x in [0.0, -0.0, 1.5, -2.25, 1e-160, 1e160, f64::INFINITY] {
            let square: f64 = x * x;
            assert_eq!(powi(x, 0), 1.0);
            assert_eq!(powi(x, 1).to_bits(), f64::to_bits(x));
            assert_eq!(powi(x, 3).to_bits(), (x * square).to_bits());
            assert_eq!(powi(x, 8).to_bits(), ((square * square) * (square * square)).to_bits());
            assert_eq!(powi(x, -2).to_bits(), (1.0 / square).to_bits());
        }
        assert_eq!(powi(2.0, -1000), f64::from_bits(23 << 52));
    }
}
