//! The axes along which faces and boxes can be apart from a convex polygon.
use glam::{DVec3, Vec3};

use crate::geometry::Aabb;

/// Error of a height over a plane in `f32`, relative to the largest coordinate of the polygon and
/// of the mesh, which is 1. A height is a sum of three products, each rounded once or twice; the
/// axis and the point are rounded before.
pub const ROUNDING: f32 = 2e-6;

/// Largest number of points of a polygon.
pub const MAX_POINTS: usize = 12;

/// A convex polygon with the axes along which a face or a box may be apart from it. In `f32`,
/// relative to the middle of the cube.
pub struct PolygonAxes {
    /// Lowest corner of the bounds.
    pub low: Vec3,
    /// Highest corner of the bounds.
    pub high: Vec3,
    points: [Vec3; MAX_POINTS],
    count: usize,
    /// The normal of the plane, or zero.
    pub normal: Vec3,
    /// The height of the plane along the normal.
    pub height: f32,
    /// For a triangle, the directions out of its sides within its plane; zero for other polygons.
    pub outward: [Vec3; 3],
    /// The heights of the sides along these directions.
    pub sides: [f32; 3],
    /// Error of a bound.
    pub rounding: f32,
}

impl PolygonAxes {
    /// `points` are those of the polygon, from one to [`MAX_POINTS`], relative to the middle of the
    /// cube; `normal` is that of its plane, or zero.
    pub fn new(points: &[DVec3], normal: DVec3) -> Self {
        let bounds = Aabb::of(points);
        let reach = bounds.min.abs().max(bounds.max.abs()).max_element() as f32;
        let mut outward = [DVec3::ZERO; 3];
        if let [a, b, c] = *points {
            outward = [b - a, c - b, a - c].map(|edge| edge.cross(normal).normalize_or_zero());
        }
        let at = |k: usize| points[k.min(points.len() - 1)];
        Self {
            low: bounds.min.as_vec3(),
            high: bounds.max.as_vec3(),
            points: std::array::from_fn(|k| at(k).as_vec3()),
            count: points.len().min(MAX_POINTS),
            normal: normal.as_vec3(),
            height: normal.dot(at(0)) as f32,
            outward: outward.map(|u| u.as_vec3()),
            sides: [0, 1, 2].map(|k| outward[k].dot(at(k)) as f32),
            rounding: ROUNDING * (1.0 + reach),
        }
    }

    /// The points.
    #[inline]
    pub fn points(&self) -> &[Vec3] {
        &self.points[..self.count]
    }

    /// Bounds up to this value belong to distances up to `limit`. Rounded up, as the slack is more
    /// than a rounding of it.
    #[inline]
    pub fn with_slack(&self, limit: f64) -> f32 {
        limit as f32 * (1.0 + ROUNDING) + self.rounding
    }

    /// Lower bound of the distance to a box, up to `rounding`.
    #[inline]
    pub fn to_box(&self, b: &[f32]) -> f32 {
        let (low, high) = (Vec3::from_slice(b), Vec3::from_slice(&b[3..]));
        let (center, half) = (0.5 * (low + high), 0.5 * (high - low));
        let apart = (low - self.high).max(self.low - high).max(Vec3::ZERO).length();
        let mut bound =
            apart.max((self.normal.dot(center) - self.height).abs() - self.normal.abs().dot(half));
        for (outward, side) in self.outward.iter().zip(self.sides) {
            bound = bound.max(outward.dot(center) - side - outward.abs().dot(half));
        }
        bound
    }
}
