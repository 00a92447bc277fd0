//! Vertices, edges and faces as sets of points, with bounds of their distances from a point.
//!
//! Input: corners. Output: `low` bounds, which are at most the true distance, and `high` bounds,
//! which are at least the true distance. Both account for rounding. `docs/math.md`, section 15,
//! counts the operations.
use glam::DVec3;

use super::exact::{FLAT, U, unit_normal};

/// An error bound for every quantity of this module. Points and corners must be within `reach` of
/// each other and of the origin.
pub fn rounding(reach: f64) -> f64 {
    32.0 * U * reach
}

/// A segment, or a point when both ends are equal.
#[derive(Clone, Copy, Debug)]
pub struct Edge {
    /// The two ends.
    pub ends: [DVec3; 2],
    /// Vector from the first end to the second.
    along: DVec3,
    /// 1 / |along|²; 0 for a point.
    inverse: f64,
}

impl Edge {
    /// The edge between two points.
    pub fn new(ends: [DVec3; 2]) -> Self {
        let along = ends[1] - ends[0];
        let squared = along.length_squared();
        // An edge whose squared length loses digits to underflow counts as its first end.
        let inverse = if squared > 1e-280 { 1.0 / squared } else { 0.0 };
        Self { ends, along, inverse }
    }

    /// Vector to `x` from a point of the edge that is closest up to rounding.
    fn offset(&self, x: DVec3) -> DVec3 {
        let from = x - self.ends[0];
        let share = (from.dot(self.along) * self.inverse).clamp(0.0, 1.0);
        from - share * self.along
    }

    /// Position of `x` along the edge, measured inwards from each end; `None` for a point.
    pub fn within(&self, x: DVec3) -> Option<[f64; 2]> {
        let unit = self.along.try_normalize().filter(|_| self.inverse > 0.0)?;
        Some([unit.dot(x - self.ends[0]), -unit.dot(x - self.ends[1])])
    }
}

/// The plane of a face, and the planes through its edges perpendicular to it.
#[derive(Clone, Copy, Debug)]
struct Prism {
    normal: DVec3,
    /// Unit vectors in the plane, perpendicular to each edge, towards the face.
    inward: [DVec3; 3],
}

/// A triangle of any shape; it may be a segment or a point.
#[derive(Clone, Copy, Debug)]
pub struct Face {
    /// The corners. Edge `k` goes from corner `k` to the next.
    pub corners: [DVec3; 3],
    edges: [Edge; 3],
    /// `None` for a face that counts as its edges.
    prism: Option<Prism>,
    /// Upper bound of the height over the longest edge for a face that counts as its edges;
    /// otherwise 0.
    pub thickness: f64,
}

/// A bound of a distance, with the vector that it comes from.
#[derive(Clone, Copy, Debug)]
pub struct Bound {
    /// The bound.
    pub distance: f64,
    /// Vector to the point from a point of the set or of its plane.
    pub offset: DVec3,
}

impl Face {
    /// The triangle with these corners. It counts as its edges when its height is at most `thin`.
    pub fn new(corners: [DVec3; 3], thin: f64) -> Self {
        let edges = [0, 1, 2].map(|k| Edge::new([corners[k], corners[(k + 1) % 3]]));
        let plane = unit_normal(corners).filter(|(_, height)| *height > thin);
        let prism = plane.map(|(normal, _)| Prism {
            normal,
            inward: edges.map(|e| normal.cross(e.along.normalize_or_zero())),
        });
        let longest = edges.iter().map(|e| e.along.length()).fold(0.0, f64::max);
        // The factor covers the rounding of the height itself.
        let thickness = if prism.is_some() { 0.0 } else { 1.001 * thin.max(2.0 * FLAT * longest) };
        Self { corners, edges, prism, thickness }
    }

    /// Index of the longest edge.
    pub fn longest_edge(&self) -> usize {
        let length = |k: usize| self.edges[k].along.length_squared();
        (0..3).fold(0, |best, k| if length(k) > length(best) { k } else { best })
    }

    /// The unit normal; `None` for a face that counts as its edges.
    pub fn normal(&self) -> Option<DVec3> {
        self.prism.map(|p| p.normal)
    }

    /// In-plane distance of `x` from each edge, positive on the face's side; `None` for a face that
    /// counts as its edges.
    pub fn sides(&self, x: DVec3) -> Option<[f64; 3]> {
        let prism = self.prism?;
        Some([0, 1, 2].map(|k| prism.inward[k].dot(x - self.corners[k])))
    }

    fn height(&self, x: DVec3, prism: &Prism) -> Bound {
        let height = prism.normal.dot(x - self.corners[0]);
        Bound { distance: height.abs(), offset: height * prism.normal }
    }

    /// Lower bound of the distance from `x`. `error` is the [`rounding`] bound.
    pub fn low(&self, x: DVec3, error: f64) -> Bound {
        let bound = match (&self.prism, self.sides(x)) {
            // Over the face, or so near to its border that rounding hides it. The plane is never
            // farther than the face.
            (Some(prism), Some(side)) if side.iter().all(|&s| s >= -error) => self.height(x, prism),
            _ => self.nearest_edge(x),
        };
        Bound { distance: bound.distance - error - self.thickness, ..bound }
    }

    /// Upper bound of the distance from `x`. The vector comes from a point of the face.
    pub fn high(&self, x: DVec3, error: f64) -> Bound {
        let bound = match (&self.prism, self.sides(x)) {
            // Certainly over the face, so the foot of the perpendicular is a point of the face.
            (Some(prism), Some(side)) if side.iter().all(|&s| s >= error) => self.height(x, prism),
            _ => self.nearest_edge(x),
        };
        Bound { distance: bound.distance + error, ..bound }
    }

    fn nearest_edge(&self, x: DVec3) -> Bound {
        let offsets = self.edges.map(|e| e.offset(x));
        let squares = offsets.map(|o| o.length_squared());
        let least = if squares[0] <= squares[1] && squares[0] <= squares[2] {
            0
        } else if squares[1] <= squares[2] {
            1
        } else {
            2
        };
        Bound { distance: squares[least].sqrt(), offset: offsets[least] }
    }
}

/// A part of the surface.
#[derive(Clone, Copy, Debug)]
pub enum Part<'a> {
    Vertex(&'a DVec3),
    Edge(&'a Edge),
    Face(&'a Face),
}

impl Part<'_> {
    /// Lower bound of the distance from `x`. `error` is the [`rounding`] bound.
    pub fn low(&self, x: DVec3, error: f64) -> Bound {
        let offset = match self {
            Self::Vertex(v) => x - **v,
            Self::Edge(e) => e.offset(x),
            Self::Face(f) => return f.low(x, error),
        };
        Bound { distance: offset.length() - error, offset }
    }

    /// The points whose convex hull is the part.
    pub fn corners(&self) -> &[DVec3] {
        match self {
            Self::Vertex(v) => std::slice::from_ref(v),
            Self::Edge(e) => &e.ends,
            Self::Face(f) => &f.corners,
        }
    }

    /// The unit normal of a face; `None` for other parts.
    pub fn normal(&self) -> Option<DVec3> {
        match self {
            Self::Face(f) => f.normal(),
            _ => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::testing::degenerate::{beyond_a_tip, face_and_point};
    use crate::testing::exact::{is_between, squared_distance};

    /// Bound of the distances of the strategies' corners and points from each other and from the
    /// origin.
    const REACH: f64 = 8.0;

    fn bounds_hold(corners: [DVec3; 3], p: DVec3, thin: f64) -> Result<(), TestCaseError> {
        let error = rounding(REACH);
        let face = Face::new(corners, thin);
        let exact = squared_distance(p, corners);
        let (low, high) = (face.low(p, error), face.high(p, error));
        prop_assert!(is_between(low.distance, &exact, high.distance), "{low:?} {high:?} {face:?}");
        // The vector of the upper bound comes from a point of the face.
        let on_face = squared_distance(p - high.offset, corners);
        prop_assert!(is_between(0.0, &on_face, error), "{high:?} {face:?}");
        for (k, edge) in face.edges.iter().enumerate() {
            let exact = squared_distance(p, [corners[k], corners[(k + 1) % 3], corners[k]]);
            let low = Part::Edge(edge).low(p, error).distance;
            prop_assert!(is_between(low, &exact, low + 2.0 * error), "edge {k}: {low:e}");
        }
        Ok(())
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(crate::testing::rotation::cases(4000)))]
        #[test]
        fn bounds_hold_for_degenerate_faces((corners, p) in face_and_point(), thin in 0usize..3) {
            bounds_hold(corners, p, [0.0, 1e-15, 1e-9][thin])?;
        }

        #[test]
        fn bounds_hold_for_points_beyond_a_tip((corners, p) in beyond_a_tip()) {
            bounds_hold(corners, p, 0.0)?;
        }
    }
}
