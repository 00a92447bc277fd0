//! Vertices, edges and faces as sets of points, and bounds of their distances from a point.
//!
//! Comes in: corners. Goes out: `low` bounds, which are at most the true distance, and `high` bounds, which are at least the true
//! distance, both in spite of rounding. `docs/math.md`, section 15, counts the operations.
use glam::DVec3;

use super::exact::{FLAT, U, unit_normal};

/// A bound on the error of every quantity of this module, for points and corners that are within `reach` of each other and of
/// the origin.
pub fn rounding(reach: f64) -> f64 {
    32.0 * U * reach
}

/// A segment; a point where both ends are the same.
#[derive(Clone, Copy, Debug)]
pub struct Edge {
    /// Its ends.
    pub ends: [DVec3; 2],
    /// From the first end to the second.
    along: DVec3,
    /// 1 / |along|²; 0 for a point.
    inverse: f64,
}

impl Edge {
    /// The edge between two points.
    pub fn new(ends: [DVec3; 2]) -> Self {
        let along = ends[1] - ends[0];
        let squared = along.length_squared();
        // An edge whose squared length loses digits to underflow is as good as its first end.
        let inverse = if squared > 1e-280 { 1.0 / squared } else { 0.0 };
        Self { ends, along, inverse }
    }

    /// To `x` from a point of the edge that is nearly the closest one.
    fn offset(&self, x: DVec3) -> DVec3 {
        let from = x - self.ends[0];
        let share = (from.dot(self.along) * self.inverse).clamp(0.0, 1.0);
        from - share * self.along
    }

    /// How far `x` is beyond each end, towards the other end; `None` for a point.
    pub fn within(&self, x: DVec3) -> Option<[f64; 2]> {
        let unit = self.along.try_normalize().filter(|_| self.inverse > 0.0)?;
        Some([unit.dot(x - self.ends[0]), -unit.dot(x - self.ends[1])])
    }
}

/// The plane of a face, and the planes through its edges at right angles to it.
#[derive(Clone, Copy, Debug)]
struct Prism {
    normal: DVec3,
    /// Unit vectors in the plane, at right angles to each edge, towards the face.
    inward: [DVec3; 3],
}

/// A triangle of any shape, down to a point.
#[derive(Clone, Copy, Debug)]
pub struct Face {
    /// Its corners; edge `k` goes from corner `k` to the next.
    pub corners: [DVec3; 3],
    edges: [Edge; 3],
    /// `None` for a face that is taken for its edges.
    prism: Option<Prism>,
    /// A bound on the height over the longest edge; only for a face that is taken for its edges.
    pub thickness: f64,
}

/// A bound on a distance, and the way from which it comes.
#[derive(Clone, Copy, Debug)]
pub struct Bound {
    /// The bound.
    pub distance: f64,
    /// To the point, from a point of the set or its plane.
    pub offset: DVec3,
}

impl Face {
    /// The triangle with these corners. Where its height is at most `thin` it is taken for its edges.
    pub fn new(corners: [DVec3; 3], thin: f64) -> Self {
        let edges = [0, 1, 2].map(|k| Edge::new([corners[k], corners[(k + 1) % 3]]));
        let plane = unit_normal(corners).filter(|(_, height)| *height > thin);
        let prism = plane.map(|(normal, _)| Prism {
            normal,
            inward: edges.map(|e| normal.cross(e.along.normalize_or_zero())),
        });
        let longest = edges.iter().map(|e| e.along.length()).fold(0.0, f64::max);
        // The height itself is rounded.
        let thickness = if prism.is_some() { 0.0 } else { 1.001 * thin.max(2.0 * FLAT * longest) };
        Self { corners, edges, prism, thickness }
    }

    /// Number of the longest edge.
    pub fn longest_edge(&self) -> usize {
        let length = |k: usize| self.edges[k].along.length_squared();
        (0..3).fold(0, |best, k| if length(k) > length(best) { k } else { best })
    }

    /// The unit normal; `None` for a face that is taken for its edges.
    pub fn normal(&self) -> Option<DVec3> {
        self.prism.map(|p| p.normal)
    }

    /// How far `x` is on the face's side of each edge; `None` for a face that is taken for its edges.
    pub fn sides(&self, x: DVec3) -> Option<[f64; 3]> {
        let prism = self.prism?;
        Some([0, 1, 2].map(|k| prism.inward[k].dot(x - self.corners[k])))
    }

    fn height(&self, x: DVec3, prism: &Prism) -> Bound {
        let height = prism.normal.dot(x - self.corners[0]);
        Bound { distance: height.abs(), offset: height * prism.normal }
    }

    /// At most the distance of `x`; `error` is the [`rounding`].
    pub fn low(&self, x: DVec3, error: f64) -> Bound {
        let bound = match (&self.prism, self.sides(x)) {
            // Over the face, or so near to its border that rounding hides it. The plane is never farther than the face.
            (Some(prism), Some(side)) if side.iter().all(|&s| s >= -error) => self.height(x, prism),
            _ => self.nearest_edge(x),
        };
        Bound { distance: bound.distance - error - self.thickness, ..bound }
    }

    /// At least the distance of `x`, with the way from a point of the face.
    pub fn high(&self, x: DVec3, error: f64) -> Bound {
        let bound = match (&self.prism, self.sides(x)) {
            // Surely over the face: its foot is a point of the face.
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
    /// At most the distance of `x`; `error` is the [`rounding`].
    pub fn low(&self, x: DVec3, error: f64) -> Bound {
        let offset = match self {
            Self::Vertex(v) => x - **v,
            Self::Edge(e) => e.offset(x),
            Self::Face(f) => return f.low(x, error),
        };
        Bound { distance: offset.length() - error, offset }
    }

    /// The points whose convex hull it is.
    pub fn corners(&self) -> &[DVec3] {
        match self {
            Self::Vertex(v) => std::slice::from_ref(v),
            Self::Edge(e) => &e.ends,
            Self::Face(f) => &f.corners,
        }
    }

    /// The unit normal of a face.
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

    /// How far corners and points of the strategies are from each other and the origin.
    const REACH: f64 = 8.0;

    fn bounds_hold(corners: [DVec3; 3], p: DVec3, thin: f64) -> Result<(), TestCaseError> {
        let error = rounding(REACH);
        let face = Face::new(corners, thin);
        let exact = squared_distance(p, corners);
        let (low, high) = (face.low(p, error), face.high(p, error));
        prop_assert!(is_between(low.distance, &exact, high.distance), "{low:?} {high:?} {face:?}");
        // The way of the upper bound comes from a point of the face.
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
        #![proptest_config(ProptestConfig::with_cases(4000))]
        #[test]
        fn bounds_hold_for_degenerate_faces((corners, p) in face_and_point(), thin in 0usize..3) {
            bounds_hold(corners, p, [0.0, 1e-15, 1e-9][thin])?;
        }

        #[test]
        fn bounds_hold_beyond_tips((corners, p) in beyond_a_tip()) {
            bounds_hold(corners, p, 0.0)?;
        }
    }
}
