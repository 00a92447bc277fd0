//! The side of a part of a surface where the sign of a field changes without a face: in the holes of
//! an open mesh, where the generalised winding number passes through 1/2 (`docs/math.md`, section
//! 14).
use glam::DVec3;

use crate::geometry::GeneralizedWinding;

/// The side of a convex set of points that no face passes through.
pub enum Side {
    /// All points are outside.
    Outside,
    /// All points are inside.
    Inside,
    /// Some may be inside and some outside, as a linear function tells.
    Across(Cut),
    /// Nothing is known.
    Unknown,
}

/// Where a set of points is cut by a jump.
pub struct Cut {
    from: DVec3,
    /// The gradient of the winding number, or its opposite where the number is negative.
    pub gradient: DVec3,
    outer: f64,
    inner: f64,
}

impl Cut {
    /// Where this is negative, a point of the set is outside.
    pub fn outer(&self, p: DVec3) -> f64 {
        self.gradient.dot(p - self.from) + self.outer
    }

    /// Where this is positive, a point of the set is inside.
    pub fn inner(&self, p: DVec3) -> f64 {
        self.gradient.dot(p - self.from) + self.inner
    }

    /// The plane where [`outer`](Self::outer) is 0: a point, and the normal. `None` without a
    /// gradient.
    pub fn plane(&self) -> Option<(DVec3, DVec3)> {
        let normal = self.gradient.try_normalize()?;
        Some((self.from - self.outer / self.gradient.length() * normal, normal))
    }
}

/// The side of the convex hull of points. `from` is one of its points, off the faces, and no face
/// passes between it and another point.
pub fn side(jump: &GeneralizedWinding, points: &[DVec3], from: DVec3) -> Side {
    let radius = points.iter().map(|p| p.distance(from)).fold(0.0, f64::max);
    let Some(near) = jump.near(from, radius) else { return Side::Unknown };
    let numbers = points.iter().map(|p| near.value + near.gradient.dot(*p - from));
    let (low, high) = numbers.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), w| (l.min(w), h.max(w)));
    let (low, high) = (low - near.error, high + near.error);
    let cut = |sign: f64| {
        let beyond = sign * near.value - 0.5;
        let (outer, inner) = (beyond + near.error, beyond - near.error);
        Side::Across(Cut { from, gradient: sign * near.gradient, outer, inner })
    };
    match (low > -0.5, high < 0.5) {
        (true, true) => Side::Outside,
        _ if low >= 0.5 || high <= -0.5 => Side::Inside,
        (true, false) => cut(1.0),
        (false, true) => cut(-1.0),
        (false, false) => Side::Unknown,
    }
}
