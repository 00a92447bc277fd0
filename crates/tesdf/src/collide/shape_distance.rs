use glam::DVec3;

use super::Shape;
use super::simple::Simple;
use crate::query::Precision;

impl Shape {
    /// Distance from `p` to the surface, negative inside; in the shape's frame and unit. NaN for a point that is not finite.
    ///
    /// `precision` is that of an encoded mesh; the others are formulas.
    pub fn signed_distance(&self, p: DVec3, precision: Precision) -> f64 {
        match *self {
            Self::Mesh(ref asset) => asset.signed_distance(p, precision),
            _ if !p.is_finite() => f64::NAN,
            ref simple => Simple::new(simple).value(p).distance,
        }
    }

    /// Whether `p`, in the shape's frame and unit, lies inside. Points on the surface may go either way.
    pub fn contains(&self, p: DVec3) -> bool {
        match self {
            Self::Mesh(asset) => asset.is_inside(p),
            _ => self.signed_distance(p, Precision::F64) < 0.0,
        }
    }
}
