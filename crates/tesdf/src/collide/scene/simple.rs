//! Planes, boxes, spheres, capsules and cylinders: their fields as formulas, and the parts of their surfaces.
use arrayvec::ArrayVec;
use glam::{DVec2, DVec3};

use crate::collide::scene::cylinder::{Cylinder, FACES_PER_SECTOR, SECTORS};
use crate::collide::scene::field_value::FieldValue;
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
    /// A cylinder about the z axis.
    Cylinder(Cylinder),
}

impl Simple {
    /// Signed distance, gradient and nearest point. The sides of a box are numbered −x +x −y +y −z
    /// +z, those of a cylinder 0 for the round one, 1 and 2 for its ends at −z and +z.
    pub fn value(&self, p: DVec3) -> FieldValue {
        let (distance, gradient, closest_point, position) = match *self {
            Self::Plane => (p.z, DVec3::Z, p.with_z(0.0), 0),
            Self::Box(half) => box_value(p, half),
            Self::Cylinder(cylinder) => cylinder.value(p),
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

    /// As `value` at `p`. Inside a box or cylinder, where several sides are equally near, up to
    /// `tie`, the gradient is that which most opposes `normal`.
    pub fn most_opposing(&self, p: DVec3, normal: DVec3, tie: f64, value: FieldValue) -> FieldValue {
        let half = match *self {
            _ if value.distance > 0.0 => return value,
            Self::Cylinder(cylinder) => return cylinder.most_opposing(p, normal, tie, value),
            Self::Box(half) => half,
            Self::Plane | Self::Round { .. } => return value,
        };
        let tie = tie.max(1e-12 * half.max_element());
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
            Self::Cylinder(Cylinder { half_height, radius }) => DVec3::new(radius, radius, half_height),
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
            Self::Cylinder(Cylinder { half_height, radius }) => Some(half_height.min(radius)),
        }
    }

    /// Number of parts that represent the surface: convex polygons of up to three points. The surface
    /// lies within the [`radius`](Self::radius) of them.
    ///
    /// A box has twelve triangles, two for each side in the order of [`value`](Self::value). A
    /// sphere has its centre, a capsule its segment. A cylinder has the faces of a prism, which are
    /// inside its round side. A plane has no corners; see [`plane_square`].
    pub fn part_count(&self) -> u32 {
        match self {
            Self::Plane => 0,
            Self::Box(_) => TRIANGLES.len() as u32,
            Self::Round { .. } => 1,
            Self::Cylinder(_) => SECTORS * FACES_PER_SECTOR,
        }
    }

    /// The points of a part; none where there is no such part.
    pub fn part(&self, part: u32) -> Points {
        match *self {
            _ if part >= self.part_count() => Points::new(),
            Self::Plane => Points::new(),
            Self::Box(half) => Points::from(TRIANGLES[part as usize].map(|corner| box_corner(half, corner))),
            Self::Round { .. } => self.nodes().map(|(end, _)| end).collect(),
            Self::Cylinder(cylinder) => Points::from(cylinder.face(part)),
        }
    }

    /// All parts.
    pub fn parts(&self) -> impl Iterator<Item = Points> {
        let simple = *self;
        (0..self.part_count()).map(move |part| simple.part(part))
    }

    /// The outward normal of a part, up to rounding; `None` of a plane and of rounded shapes.
    pub fn normal(&self, part: u32) -> Option<DVec3> {
        match *self {
            Self::Plane | Self::Round { .. } => None,
            Self::Box(_) => {
                let outward = if (part / 2).is_multiple_of(2) { -1.0 } else { 1.0 };
                Some(outward * DVec3::AXES[part as usize / 4 % 3])
            }
            Self::Cylinder(_) => Some(Cylinder::normal(part)),
        }
    }

    /// The parts that have these corners of a part, and the part itself.
    pub fn parts_with(&self, part: u32, corners: &[usize]) -> impl Iterator<Item = u32> {
        let own: ArrayVec<u32, 3> = corners.iter().map(|&k| self.corner_numbers(part)[k]).collect();
        let (around, all) = match self {
            Self::Cylinder(_) => (Cylinder::faces_around(part, corners), 0..0),
            _ => (ArrayVec::new(), 0..self.part_count()),
        };
        let simple = *self;
        let has_them = move |other: &u32| {
            let numbers = simple.corner_numbers(*other);
            own.iter().all(|corner| numbers.contains(corner))
        };
        around.into_iter().chain(all).filter(has_them)
    }

    /// The corners of a part by their numbers: equal corners have equal numbers.
    fn corner_numbers(&self, part: u32) -> [u32; 3] {
        match self {
            Self::Plane | Self::Round { .. } => [0, 1, 2],
            Self::Box(_) => TRIANGLES[part as usize % TRIANGLES.len()].map(|corner| corner as u32),
            Self::Cylinder(_) => Cylinder::nodes_of_face(part),
        }
    }

    /// The parts that look against `normal`, with an edge of the prism of a cylinder on that side: what
    /// is lowest over a plane with this normal is then on them.
    pub fn parts_against(&self, normal: DVec3) -> impl Iterator<Item = Points> {
        let simple = *self;
        let down = -normal.truncate();
        let turn = match self {
            Self::Cylinder(_) if down.length() > ACROSS => down.normalize(),
            _ => DVec2::X,
        };
        let turned = move |p: DVec3| turn.rotate(p.truncate()).extend(p.z);
        let looks_against =
            move |part: &u32| simple.normal(*part).is_none_or(|own| turned(own).dot(normal) < -ACROSS);
        let part = move |part| simple.part(part).into_iter().map(turned).collect();
        (0..self.part_count()).filter(looks_against).map(part)
    }

    /// The surface lies within this distance of the parts.
    pub fn radius(&self) -> f64 {
        if let Self::Round { radius, .. } = *self { radius } else { 0.0 }
    }

    /// Number of distinct points of the parts.
    pub fn node_count(&self) -> u32 {
        match *self {
            Self::Plane => 0,
            Self::Box(_) => NODES.len() as u32,
            Self::Round { half_height, .. } => 1 + u32::from(half_height != 0.0),
            Self::Cylinder(_) => 2 * SECTORS + 2,
        }
    }

    /// A distinct point of the parts.
    pub fn node(&self, node: u32) -> DVec3 {
        match *self {
            Self::Plane => DVec3::ZERO,
            Self::Box(half) => box_corner(half, NODES[node as usize].0),
            Self::Round { half_height: 0.0, .. } => DVec3::ZERO,
            Self::Round { half_height, .. } => {
                DVec3::new(0.0, 0.0, if node == 0 { -half_height } else { half_height })
            }
            Self::Cylinder(cylinder) => cylinder.node(node),
        }
    }

    /// The lowest part that has a node.
    pub fn part_of_node(&self, node: u32) -> u32 {
        match self {
            Self::Box(_) => NODES[node as usize].1,
            Self::Cylinder(_) => Cylinder::face_of_node(node),
            Self::Plane | Self::Round { .. } => 0,
        }
    }

    /// The distinct points of the parts, each with the lowest part that has it.
    pub fn nodes(&self) -> impl Iterator<Item = (DVec3, u32)> {
        let simple = *self;
        (0..self.node_count()).map(move |node| (simple.node(node), simple.part_of_node(node)))
    }
}

/// Parts whose normals have a smaller cosine are perpendicular to each other, up to rounding.
const ACROSS: f64 = 1e-9;

/// The points of a part.
pub type Points = ArrayVec<DVec3, 3>;

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

// The faces and corners of all boxes are the same but for the lengths, so they are tables: a
// detection asks for them at each contact. A corner is a number whose bit k is set where its
// coordinate k is positive.

/// The triangles: two for each side.
const TRIANGLES: [[usize; 3]; 12] = {
    let mut triangles = [[0; 3]; 12];
    let mut side = 0;
    while side < 6 {
        let (axis, is_high) = (side / 2, side % 2);
        let (on_side, right, top) = (is_high << axis, 1 << ((axis + 1) % 3), 1 << ((axis + 2) % 3));
        // Seen from outside, the corners turn to the left on both sides of the axis.
        let (from, to) = if is_high == 1 { (0, top) } else { (top, 0) };
        let [a, b, c, d] = [on_side | from, on_side | right | from, on_side | right | to, on_side | to];
        (triangles[2 * side], triangles[2 * side + 1]) = ([a, b, c], [a, c, d]);
        side += 1;
    }
    triangles
};

/// The corners in the order in which the triangles have them, each with the first one.
const NODES: [(usize, u32); 8] = {
    let (mut nodes, mut count, mut seen) = ([(0, 0); 8], 0, 0);
    let mut k = 0;
    while k < 3 * TRIANGLES.len() {
        let corner = TRIANGLES[k / 3][k % 3];
        if seen >> corner & 1 == 0 {
            seen |= 1 << corner;
            nodes[count] = (corner, k as u32 / 3);
            count += 1;
        }
        k += 1;
    }
    nodes
};

/// The node of a box at the corner that is at the positive end of these axes.
pub fn box_node(is_high: [bool; 3]) -> u32 {
    let corner = (0..3).map(|axis| usize::from(is_high[axis]) << axis).sum::<usize>();
    NODES.iter().position(|&(other, _)| other == corner).unwrap_or(0) as u32
}

fn box_corner(half: DVec3, corner: usize) -> DVec3 {
    DVec3::from_array(std::array::from_fn(
        |axis| {
            if corner >> axis & 1 == 1 { half[axis] } else { -half[axis] }
        },
    ))
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
        let triangles: Vec<Triangle> = simple.parts().map(|t| Triangle::new([t[0], t[1], t[2]])).collect();
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
        assert_eq!(capsule.nodes().count(), 2);
    }

    #[test]
    fn normals_and_neighbours_are_those_of_the_points() {
        let cylinder = Cylinder { half_height: 2.0, radius: 0.5 };
        for simple in [Simple::Box(DVec3::new(1.0, 2.0, 3.0)), Simple::Cylinder(cylinder)] {
            for part in 0..simple.part_count() {
                let own = simple.part(part);
                let normal = simple.normal(part).expect("a side");
                assert!(normal.distance(Triangle::new([own[0], own[1], own[2]]).normal) < 1e-12);
                for corners in [&[0][..], &[1], &[2], &[0, 1], &[1, 2], &[2, 0]] {
                    let has_them =
                        |other: &u32| corners.iter().all(|&k| simple.part(*other).contains(&own[k]));
                    let mut found: Vec<u32> = simple.parts_with(part, corners).collect();
                    found.sort_unstable();
                    let expected: Vec<u32> = (0..simple.part_count()).filter(has_them).collect();
                    assert_eq!(found, expected, "{part} {corners:?}");
                }
            }
        }
    }

    #[test]
    fn a_box_has_eight_corners() {
        let simple = Simple::Box(DVec3::new(1.0, 2.0, 3.0));
        let nodes: Vec<(DVec3, u32)> = simple.nodes().collect();
        assert_eq!(nodes.len(), 8);
        for (k, (node, part)) in nodes.iter().enumerate() {
            assert!(nodes[..k].iter().all(|(other, _)| other != node));
            assert_eq!(simple.parts().position(|points| points.contains(node)), Some(*part as usize));
        }
    }
}
