use glam::DVec3;

use crate::collide::scene::shape::Shape;
use crate::collide::scene::simple::Simple;
use crate::geometry::length_and_direction;

/// A point with a larger coordinate is farther out than any shape is large.
const FAR: f64 = 1e100;

impl Shape {
    /// Signed distance from `p` to the surface, negative inside; in the shape's frame and unit. NaN
    /// for a point that is not finite, [`f64::MAX`] for a larger distance.
    pub fn signed_distance(&self, p: DVec3) -> f64 {
        match *self {
            Self::Mesh(ref asset) => asset.signed_distance(p),
            _ if !p.is_finite() => f64::NAN,
            // Squares would overflow. From so far out, every shape except a plane is a point.
            _ if p.abs().max_element() > FAR && !matches!(self, Self::Plane) => length_and_direction(p).0,
            ref simple => Simple::from(simple).value(p).distance,
        }
    }

    /// As [`signed_distance`](Self::signed_distance), but an encoded mesh answers in `f32`
    /// ([`TeSdf::signed_distance_f32`](crate::TeSdf::signed_distance_f32)). The other shapes use
    /// formulas.
    pub fn signed_distance_f32(&self, p: DVec3) -> f64 {
        match self {
            Self::Mesh(asset) => asset.signed_distance_f32(p),
            _ => self.signed_distance(p),
        }
    }

    /// Whether `p`, in the shape's frame and unit, lies inside. Points on the surface may count as
    /// either.
    pub fn contains(&self, p: DVec3) -> bool {
        match self {
            Self::Mesh(asset) => asset.is_inside(p),
            _ => self.signed_distance(p) < 0.0,
        }
    }
}
