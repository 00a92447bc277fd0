//! A cylinder about the z axis: its field as a formula, and the prism that stands for its surface.
use std::sync::LazyLock;

use arrayvec::ArrayVec;
use glam::{DVec2, DVec3};

use crate::collide::scene::field_value::FieldValue;

/// Number of sides of the prism. Its edges are on the round side, and its faces at most 0.5 % of the
/// radius inside.
pub const SECTORS: u32 = 32;

/// Faces of a sector: two on the round side, one on each end.
pub const FACES_PER_SECTOR: u32 = 4;

/// A cylinder, in its own frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cylinder {
    /// Half of its length.
    pub half_height: f64,
    /// Radius.
    pub radius: f64,
}

impl Cylinder {
    /// Signed distance, gradient, nearest point and side: 0 for the round one, 1 and 2 for the ends
    /// at −z and +z.
    pub fn value(&self, p: DVec3) -> (f64, DVec3, DVec3, u32) {
        let Self { half_height, radius } = *self;
        let (from_axis, outward) = polar(p);
        let up = if p.z < 0.0 { -1.0 } else { 1.0 };
        let (beside, beyond) = (from_axis - radius, p.z.abs() - half_height);
        let side = if beside >= beyond { 0 } else { 1 + u32::from(up > 0.0) };
        let way = DVec2::new(beside, beyond).max(DVec2::ZERO);
        if way != DVec2::ZERO {
            let distance = way.length();
            let gradient = (way.x * outward + way.y * up * DVec3::Z) / distance;
            let closest = (from_axis.min(radius) * outward).with_z(p.z.clamp(-half_height, half_height));
            return (distance, gradient, closest, side);
        }
        match side {
            0 => (beside, outward, (radius * outward).with_z(p.z), side),
            _ => (beyond, up * DVec3::Z, p.with_z(up * half_height), side),
        }
    }

    /// As [`Simple::most_opposing`](crate::collide::scene::simple::Simple::most_opposing).
    pub fn most_opposing(&self, p: DVec3, normal: DVec3, tie: f64, value: FieldValue) -> FieldValue {
        let Self { half_height, radius } = *self;
        let tie = tie.max(1e-12 * half_height.max(radius));
        let (from_axis, mut outward) = polar(p);
        // On the axis, all directions perpendicular to it are equally good.
        if from_axis <= tie {
            outward = (-normal).with_z(0.0).try_normalize().unwrap_or(outward);
        }
        let up = if p.z < 0.0 { DVec3::NEG_Z } else { DVec3::Z };
        let mut best = value;
        let mut offer = |depth: f64, gradient: DVec3, closest_point: DVec3, position: u32| {
            if depth <= tie - value.distance && gradient.dot(normal) < best.gradient.dot(normal) {
                best = FieldValue { gradient, closest_point, position, ..value };
            }
        };
        offer(radius - from_axis, outward, (radius * outward).with_z(p.z), 0);
        offer(half_height - p.z.abs(), up, p.with_z(up.z * half_height), 1 + u32::from(up.z > 0.0));
        best
    }

    /// The corners of a face of the prism. Of sector k, faces 4k and 4k + 1 are on the round side,
    /// 4k + 2 and 4k + 3 on the ends at −z and +z.
    pub fn face(&self, face: u32) -> [DVec3; 3] {
        Self::nodes_of_face(face).map(|node| self.node(node))
    }

    /// The same corners as numbers of [`node`](Self::node).
    pub fn nodes_of_face(face: u32) -> [u32; 3] {
        let sector = face / FACES_PER_SECTOR;
        let [from, to] = [2 * sector, 2 * ((sector + 1) % SECTORS)];
        match face % FACES_PER_SECTOR {
            0 => [from, to, to + 1],
            1 => [from, to + 1, from + 1],
            2 => [2 * SECTORS, to, from],
            _ => [2 * SECTORS + 1, from + 1, to + 1],
        }
    }

    /// The outward normal of a face, up to rounding.
    pub fn normal(face: u32) -> DVec3 {
        let sector = face / FACES_PER_SECTOR;
        match face % FACES_PER_SECTOR {
            0 | 1 => {
                let [from, to] = [sector, sector + 1].map(|k| DIRECTIONS[(k % SECTORS) as usize]);
                (from + to).normalize().extend(0.0)
            }
            2 => DVec3::NEG_Z,
            _ => DVec3::Z,
        }
    }

    /// The faces that may have these corners of a face: of the two sectors at an edge, or of an end
    /// around its middle.
    pub fn faces_around(face: u32, corners: &[usize]) -> ArrayVec<u32, { SECTORS as usize }> {
        let (sector, kind) = (face / FACES_PER_SECTOR, face % FACES_PER_SECTOR);
        let edge = |corner: &usize| match (kind, corner) {
            (0 | 1, 0) => Some(sector),
            (0, _) | (1, 1) | (2, 1) | (3, 2) => Some(sector + 1),
            (2 | 3, 0) => None,
            _ => Some(sector),
        };
        match corners.iter().find_map(edge) {
            Some(edge) => {
                let sectors = [edge + SECTORS - 1, edge].map(|sector| sector % SECTORS);
                let faces = |sector| FACES_PER_SECTOR * sector..FACES_PER_SECTOR * (sector + 1);
                sectors.into_iter().flat_map(faces).collect()
            }
            None => (0..SECTORS).map(|sector| FACES_PER_SECTOR * sector + kind).collect(),
        }
    }

    /// A corner of the prism: 2k and 2k + 1 are the ends of edge k, then come the middles of both
    /// ends.
    pub fn node(&self, node: u32) -> DVec3 {
        let z = if node.is_multiple_of(2) { -self.half_height } else { self.half_height };
        match node / 2 {
            edge if edge < SECTORS => (self.radius * DIRECTIONS[edge as usize]).extend(z),
            _ => DVec3::new(0.0, 0.0, z),
        }
    }

    /// The lowest face that has a corner.
    pub fn face_of_node(node: u32) -> u32 {
        let is_high = node % 2;
        match node / 2 {
            0 => is_high,
            SECTORS => 2 + is_high,
            edge => FACES_PER_SECTOR * (edge - 1),
        }
    }

    /// The outward normals at a place: of the sides that it is within `limit` of. `None` where that
    /// is the round side alone, whose normal changes along it.
    pub fn normals(&self, p: DVec3, limit: f64) -> Option<ArrayVec<DVec3, 2>> {
        let (from_axis, outward) = polar(p);
        let mut normals = ArrayVec::new();
        if self.half_height - p.z.abs() <= limit {
            normals.push(if p.z < 0.0 { DVec3::NEG_Z } else { DVec3::Z });
            if self.radius - from_axis <= limit {
                normals.push(outward);
            }
        }
        (!normals.is_empty()).then_some(normals)
    }
}

/// The distance from the z axis and the direction away from it.
fn polar(p: DVec3) -> (f64, DVec3) {
    let beside = p.with_z(0.0);
    let length = beside.length();
    (length, if length > 0.0 { beside / length } else { DVec3::X })
}

/// The directions of the edges, from square roots alone: these have the same bits everywhere.
static DIRECTIONS: LazyLock<[DVec2; SECTORS as usize]> = LazyLock::new(|| {
    const QUARTER: usize = SECTORS as usize / 4;
    let mut quarter = [DVec2::X; QUARTER + 1];
    quarter[QUARTER] = DVec2::Y;
    let mut step = QUARTER;
    while step > 1 {
        for k in (0..QUARTER).step_by(step) {
            quarter[k + step / 2] = (quarter[k] + quarter[k + step]).normalize();
        }
        step /= 2;
    }
    std::array::from_fn(|k| {
        let turned = |direction: DVec2, _| direction.perp();
        (0..k / QUARTER).fold(quarter[k % QUARTER], turned)
    })
});

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::random;

    #[test]
    fn the_distance_is_that_of_points_of_the_surface() {
        let mut state = 1;
        for case in 0..2000 {
            let mut number = || random(&mut state);
            let cylinder = Cylinder { half_height: 0.1 + number(), radius: 0.1 + number() };
            let Cylinder { half_height: h, radius: r } = cylinder;
            let mut p = 3.0 * (DVec3::new(number(), number(), number()) - 0.5);
            match case % 8 {
                0 => (p.x, p.y) = (0.0, 0.0),
                1 => p.z = h,
                2 => p.z = 0.0,
                3 => p = (r * p.with_z(0.0).normalize()).with_z(p.z),
                _ => {}
            }
            let (distance, gradient, closest, side) = cylinder.value(p);
            let (rho, z) = (p.truncate().length(), p.z.abs());
            // In the half-plane through the point, the surface is two segments.
            let to_side = DVec2::new(rho - r, (z - h).max(0.0)).length();
            let to_end = DVec2::new((rho - r).max(0.0), z - h).length();
            let is_inside = rho < r && z < h;
            let expected = if is_inside { -to_side.min(to_end) } else { to_side.min(to_end) };
            assert!((distance - expected).abs() < 1e-14, "case {case}: {distance}, not {expected}");
            assert!((closest.distance(p) - distance.abs()).abs() < 1e-14, "case {case}");
            assert!(cylinder.value(closest).0.abs() < 1e-14, "case {case}");
            assert!((gradient.length() - 1.0).abs() < 1e-14, "case {case}");
            assert!((closest + distance * gradient - p).length() < 1e-14, "case {case}");
            let on_side = match side {
                0 => (closest.truncate().length() - r).abs(),
                1 => (closest.z + h).abs(),
                _ => (closest.z - h).abs(),
            };
            assert!(on_side < 1e-14, "case {case}: {closest} is on side {side}");
        }
    }

    #[test]
    fn the_prism_is_closed_and_on_the_cylinder() {
        let cylinder = Cylinder { half_height: 2.0, radius: 0.5 };
        let count = SECTORS * FACES_PER_SECTOR;
        let bits = |p: DVec3| p.to_array().map(|x| (x + 0.0).to_bits());
        let mut edges = std::collections::HashSet::new();
        for face in 0..count {
            let [a, b, c] = cylinder.face(face);
            let normal = (b - a).cross(c - a);
            assert!(normal.dot((a + b + c) / 3.0) > 0.0, "face {face} looks outward");
            for (p, q) in [(a, b), (b, c), (c, a)] {
                assert!(edges.insert((bits(p), bits(q))), "face {face} turns as its neighbours");
            }
        }
        assert!(edges.iter().all(|&(p, q)| edges.contains(&(q, p))), "each edge has two faces");
        for node in 0..2 * SECTORS + 2 {
            let at = cylinder.node(node);
            assert!(cylinder.value(at).0.abs() < 1e-15, "node {node}");
            let lowest = (0..count).find(|&face| cylinder.face(face).contains(&at));
            assert_eq!(lowest, Some(Cylinder::face_of_node(node)), "node {node}");
        }
    }
}
