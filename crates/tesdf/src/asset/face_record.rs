use glam::{DVec3, Vec3};

use super::layout::SignHints;
use crate::geometry::{Triangle, is_flat};

/// A face in `f32`, relative to the middle of the cube, in one cache line.
///
/// Its numbers are: corner a, b − a, c − a, the unit normal, the inverse squared lengths of b − a,
/// c − a and c − b, and the bits of the sign hints.
///
/// The normal of a face with no area, or nearly none, is NaN. NaN fails the test for the prism over
/// the face, so only the edges count. The inverse of a length of zero is 0, so the closest point of
/// that edge is its start.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
pub struct FaceRecord(Record);

type Record = [f32; 16];
const HINTS: usize = 15;

impl FaceRecord {
    /// A face with a height below this (local frame) counts as its edges alone: rounding may have
    /// turned it over, and then no prism stands on it. Half of this height is within the promise of
    /// `f32`, 1e-6 × diagonal.
    pub const LEAST_HEIGHT: f64 = 7e-7;

    /// Rounds a triangle of the local frame to `f32`.
    pub fn new(triangle: &Triangle, middle: DVec3, hints: SignHints) -> Self {
        let [a, b, c] = triangle.corners.map(|p| (p - middle).as_vec3());
        let (u, v) = ((b - a).as_dvec3(), (c - a).as_dvec3());
        let longest = u.length().max(v.length()).max((u - v).length());
        let flat = is_flat(u.cross(v).dot(triangle.normal), longest, Self::LEAST_HEIGHT);
        let n = if flat { Vec3::NAN } else { triangle.normal.as_vec3() };
        let inverse = |v: Vec3| {
            let inverse = 1.0 / v.as_dvec3().length_squared();
            if inverse < f64::from(f32::MAX) { inverse as f32 } else { 0.0 }
        };
        let inverses = Vec3::new(inverse(b - a), inverse(c - a), inverse(c - b));
        let mut record = [f32::from_bits(hints.0.into()); 16];
        for (k, v) in [a, b - a, c - a, n, inverses].into_iter().enumerate() {
            record[3 * k..3 * k + 3].copy_from_slice(&v.to_array());
        }
        Self(record)
    }

    /// The numbers, in the order that the documentation of the type gives.
    #[inline(always)]
    pub fn as_array(&self) -> &[f32; 16] {
        &self.0
    }

    /// The face in `f64`, relative to the middle of the cube.
    #[inline]
    pub fn triangle(&self) -> Triangle {
        let v = |k: usize| Vec3::from_slice(&self.0[3 * k..]).as_dvec3();
        let normal = v(3);
        let normal = if normal.is_nan() { DVec3::ZERO } else { normal };
        Triangle::with_normal([v(0), v(0) + v(1), v(0) + v(2)], normal)
    }

    /// Clears the hints, so that only the winding number tells the sign.
    pub fn forget_hints(&mut self) {
        self.0[HINTS] = f32::from_bits(SignHints::default().0.into());
    }

    /// How the sign follows from the closest feature.
    #[inline]
    pub fn hints(&self) -> SignHints {
        SignHints(self.0[HINTS].to_bits() as u16)
    }
}
