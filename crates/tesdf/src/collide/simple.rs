//! Planes, boxes, spheres and capsules: their fields as formulas, and the parts of their surfaces.
use glam::DVec3;

use super::field_value::FieldValue;
use crate::geometry::{Aabb, Feature};

/// A convex shape whose signed distance is a formula. All these fields are convex functions.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Simple {
    /// The half-space z ≤ 0.
    Plane,
    /// A box with these half extents.
    Box(DVec3),
    /// All points within `radius` of the segment between ± `half_height` on the z axis; a sphere
    /// when `half_height` is 0.
    Round {
        /// Half of the segment's length.
        half_height: f64,
        /// Radius.
        radius: f64,
    },
}

impl Simple {
    /// Signed distance, gradient and nearest point. The sides of a box are numbered −x +x −y +y −z
    /// +z.
    pub fn value(&self, p: DVec3) -> FieldValue {
        let (distance, gradient, closest_point, position) = match *self {
            Self::Plane => (p.z, DVec3::Z, p.with_z(0.0), 0),
            Self::Box(half) => box_value(p, half),
            Self::Round { half_height, radius } => {
                let core = DVec3::new(0.0, 0.0, p.z.clamp(-half_height, half_height));
                let from_core = p - core;
                let length = from_core.length();
                // On the core itself, all directions perpendicular to it are equally good.
                let gradient = if length > 0.0 { from_core / length } else { DVec3::X };
                (length - radius, gradient, core + radius * gradient, 0)
            }
        };
        FieldValue { distance, gradient, closest_point, position, feature: Feature::Face }
    }

    /// As `value` at `p`. Inside a box, where several sides are equally near, the gradient is that
    /// which most opposes `normal`.
    pub fn most_opposing(&self, p: DVec3, normal: DVec3, value: FieldValue) -> FieldValue {
        let Self::Box(half) = *self else { return value };
        if value.distance > 0.0 {
            return value;
        }
        let tie = 1e-12 * half.max_element();
        let mut best = value;
        for axis in 0..3 {
            let depth = half[axis] - p[axis].abs();
            let outward = DVec3::AXES[axis] * if p[axis] < 0.0 { -1.0 } else { 1.0 };
            if depth <= tie - value.distance && outward.dot(normal) < best.gradient.dot(normal) {
                let mut closest_point = p;
                closest_point[axis] = half[axis].copysign(p[axis]);
                let position = 2 * axis as u32 + u32::from(p[axis] >= 0.0);
                best = FieldValue { gradient: outward, closest_point, position, ..value };
            }
        }
        best
    }

    /// Bounds; infinite for a plane.
    pub fn bounds(&self) -> Aabb {
        let half = match *self {
            Self::Plane => {
                return Aabb { min: DVec3::NEG_INFINITY, max: DVec3::new(f64::INFINITY, f64::INFINITY, 0.0) };
            }
            Self::Box(half) => half,
            Self::Round { half_height, radius } => DVec3::new(radius, radius, half_height + radius),
        };
        Aabb { min: -half, max: half }
    }

    /// The radius of the largest ball inside, centred on the origin; `None` for a plane, where it
    /// is unlimited.
    pub fn inner_radius(&self) -> Option<f64> {
        match *self {
            Self::Plane => None,
            Self::Box(half) => Some(half.min_element()),
            Self::Round { radius, .. } => Some(radius),
        }
    }

    /// The parts that represent the surface: convex polygons of up to three points, and a radius
    /// within which the surface lies.
    ///
    /// A box has twelve triangles, two for each side in the order of [`value`](Self::value). A
    /// sphere has its centre, a capsule its segment. A plane has no corners; see [`plane_square`].
    pub fn parts(&self) -> (Vec<Vec<DVec3>>, f64) {
        match *self {
            Self::Plane => (Vec::new(), 0.0),
            Self::Box(half) => (box_triangles(half), 0.0),
            Self::Round { half_height: 0.0, radius } => (vec![vec![DVec3::ZERO]], radius),
            Self::Round { half_height, radius } => {
                (vec![vec![DVec3::new(0.0, 0.0, -half_height), DVec3::new(0.0, 0.0, half_height)]], radius)
            }
        }
    }

    /// The edges: twelve of a box, the segment of a capsule. The surface lies within the radius.
    pub fn edges(&self) -> (Vec<SimpleEdge>, f64) {
        let (parts, radius) = self.parts();
        let mut edges: Vec<SimpleEdge> = Vec::new();
        for (part, points) in (0..).zip(&parts) {
            for side in 0..if points.len() == 3 { 3 } else { points.len() as u32 - 1 } {
                let [p, q] = [side, side + 1].map(|k| points[k as usize % points.len()]);
                let normals = match *self {
                    Self::Box(half) => {
                        // The side lies in the sides of the box where both ends do.
                        let outward = |axis: usize| {
                            let is_common = p[axis] == q[axis] && p[axis].abs() == half[axis];
                            is_common.then(|| DVec3::AXES[axis] * p[axis].signum())
                        };
                        let outward: Vec<DVec3> = (0..3).filter_map(outward).collect();
                        // The diagonal of a side is no edge.
                        let &[first, second] = outward.as_slice() else { continue };
                        [first, second]
                    }
                    _ => [DVec3::ZERO; 2],
                };
                if edges.iter().all(|e| e.points != [p, q] && e.points != [q, p]) {
                    edges.push(SimpleEdge { id: 3 * part + side, points: [p, q], normals });
                }
            }
        }
        (edges, radius)
    }

    /// The distinct points of the parts, each with the lowest part that has it.
    pub fn nodes(&self) -> (Vec<(DVec3, u32)>, f64) {
        let (parts, radius) = self.parts();
        let mut nodes: Vec<(DVec3, u32)> = Vec::new();
        for (part, points) in parts.iter().enumerate() {
            for &p in points {
                if nodes.iter().all(|(q, _)| *q != p) {
                    nodes.push((p, part as u32));
                }
            }
        }
        (nodes, radius)
    }
}

/// An edge of a box, or the core of a capsule.
#[derive(Clone, Copy, Debug)]
pub struct SimpleEdge {
    /// 3 × part + side: that side of the lowest part that has it.
    pub id: u32,
    /// Its ends.
    pub points: [DVec3; 2],
    /// The normals of the two sides of a box; zero for a capsule.
    pub normals: [DVec3; 2],
}

fn box_value(p: DVec3, half: DVec3) -> (f64, DVec3, DVec3, u32) {
    let clamped = p.clamp(-half, half);
    let sign = DVec3::from_array(p.to_array().map(|x| if x < 0.0 { -1.0 } else { 1.0 }));
    // The nearest side, or the side that the point is most outside of.
    let depth = half - p.abs();
    let axis = (0..3).min_by(|&i, &j| depth[i].total_cmp(&depth[j])).unwrap_or(0);
    let side = 2 * axis as u32 + u32::from(sign[axis] > 0.0);
    let outward = p - clamped;
    if outward != DVec3::ZERO {
        let length = outward.length();
        return (length, outward / length, clamped, side);
    }
    let mut gradient = DVec3::ZERO;
    gradient[axis] = sign[axis];
    let mut closest = p;
    closest[axis] = sign[axis] * half[axis];
    (-depth[axis], gradient, closest, side)
}

fn box_triangles(half: DVec3) -> Vec<Vec<DVec3>> {
    let mut triangles = Vec::with_capacity(12);
    for axis in 0..3 {
        for sign in [-1.0, 1.0] {
            let corner = |u: f64, v: f64| {
                let mut p = DVec3::ZERO;
                p[axis] = sign * half[axis];
                p[(axis + 1) % 3] = u * half[(axis + 1) % 3];
                p[(axis + 2) % 3] = sign * v * half[(axis + 2) % 3];
                p
            };
            let [a, b, c, d] = [corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)];
            triangles.push(vec![a, b, c]);
            triangles.push(vec![a, c, d]);
        }
    }
    triangles
}

/// The square of the plane z = 0 that contains all its points within `radius` of `center`, as two
/// triangles.
pub fn plane_square(center: DVec3, radius: f64) -> [[DVec3; 3]; 2] {
    let corner = |u: f64, v: f64| DVec3::new(center.x + u * radius, center.y + v * radius, 0.0);
    let [a, b, c, d] = [corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)];
    [[a, b, c], [a, c, d]]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Triangle;

    #[test]
    fn the_distance_to_a_box_equals_that_to_its_triangles() {
        let half = DVec3::new(1.0, 2.0, 3.0);
        let simple = Simple::Box(half);
        let triangles: Vec<Triangle> =
            simple.parts().0.iter().map(|t| Triangle::new([t[0], t[1], t[2]])).collect();
        for (side, t) in triangles.iter().enumerate() {
            let axis = side / 4;
            let outward = if side % 4 < 2 { -1.0 } else { 1.0 };
            assert_eq!(t.normal[axis], outward, "triangle {side} faces outward");
        }
        for i in 0..1000u32 {
            let p = DVec3::new((i % 10) as f64, (i / 10 % 10) as f64, (i / 100) as f64) - 4.6;
            let value = simple.value(p);
            let least = triangles.iter().map(|t| t.closest(p).distance).fold(f64::INFINITY, f64::min);
            assert!((value.distance.abs() - least).abs() < 1e-12);
            assert_eq!(value.distance < 0.0, p.abs().cmplt(half).all());
            let side = value.position as usize;
            let on_side = triangles[2 * side..2 * side + 2]
                .iter()
                .any(|t| t.closest(value.closest_point).distance < 1e-12);
            assert!(on_side, "{p} {value:?}");
            let step = 1e-6;
            let ahead = simple.value(p + step * value.gradient).distance;
            assert!((ahead - value.distance - step).abs() < 1e-9);
        }
    }

    #[test]
    fn a_capsule_without_height_is_a_sphere() {
        let (sphere, capsule) = (
            Simple::Round { half_height: 0.0, radius: 2.0 },
            Simple::Round { half_height: 1.0, radius: 2.0 },
        );
        let p = DVec3::new(3.0, 0.0, 0.5);
        assert_eq!(capsule.value(p).distance, 1.0);
        assert!((sphere.value(p).distance - (9.25f64.sqrt() - 2.0)).abs() < 1e-15);
        assert_eq!(sphere.value(DVec3::ZERO).distance, -2.0);
        assert_eq!(capsule.nodes().0.len(), 2);
        assert_eq!(Simple::Box(DVec3::ONE).nodes().0.len(), 8);
        assert_eq!(capsule.edges().0.len(), 1);
        assert!(sphere.edges().0.is_empty() && Simple::Plane.edges().0.is_empty());
    }

    #[test]
    fn a_box_has_twelve_edges() {
        let half = DVec3::new(1.0, 2.0, 3.0);
        let (edges, _) = Simple::Box(half).edges();
        assert_eq!(edges.len(), 12);
        for SimpleEdge { id, points: [p, q], normals: [m, n] } in edges {
            assert_eq!((p != q, m.dot(n), m.dot(p - q), n.dot(p - q)), (true, 0.0, 0.0, 0.0));
            assert!(m.dot(p) > 0.0 && n.dot(p) > 0.0);
            let part = &Simple::Box(half).parts().0[id as usize / 3];
            assert_eq!((part[id as usize % 3], part[(id as usize + 1) % 3]), (p, q));
        }
    }
}
