//! The reference for contacts: the signed clearance of two posed solids in `f64`, by branch and
//! bound over all faces.
use std::array::from_fn;
use std::collections::VecDeque;

use tesdf::collide::Pose;
use tesdf::geometry::internal::triangles_meet;
use tesdf::geometry::{Aabb, Triangle};
use tesdf::glam::DVec3;
use tesdf::mesh::TriangleMesh;

use crate::reference::Reference;
use tesdf_sim::criterion::measure::relative;

/// Tolerance of depths, as a fraction of the other solid's diagonal. Distances are exact up to
/// rounding.
pub const TOLERANCE: f64 = 1e-7;

/// A solid, with the trees for its signed distances.
pub struct Body<'a> {
    mesh: &'a TriangleMesh,
    reference: Reference,
}

impl<'a> Body<'a> {
    /// Builds the trees of `mesh`.
    pub fn new(mesh: &'a TriangleMesh) -> Self {
        Self { mesh, reference: Reference::new(mesh) }
    }

    /// The distance between two solids, or the negative depth when they overlap, in the unit of the
    /// meshes.
    ///
    /// The depth is the largest depth of a point of either surface in the other solid. The depth of
    /// a point is its distance to the nearest point of the surface, as a signed distance field
    /// defines it. It is not the length of the shortest translation that separates the solids.
    pub fn clearance(&self, other: &Self, [own, others]: [Pose; 2]) -> f64 {
        let depth =
            self.deepest(other, relative(others, own)).max(other.deepest(self, relative(own, others)));
        if depth > 0.0 { -depth } else { self.separation(other, relative(others, own)) }
    }

    /// The largest depth of a point of this surface in `other`; 0 when no point is inside. `pose`
    /// is the pose of `self` in the frame of `other`.
    fn deepest(&self, other: &Self, pose: Pose) -> f64 {
        let bounds = other.mesh.bounds();
        let vertices: Vec<DVec3> = self.mesh.vertices().iter().map(|&v| pose.to_world(v)).collect();
        let mut depth = 0.0f64;
        for &v in vertices.iter().filter(|&&v| bounds.contains(v)) {
            depth = other.deeper(v, depth);
        }
        let least_gain = TOLERANCE * other.mesh.diagonal();
        let corners = self.mesh.faces().iter().map(|face| face.map(|v| vertices[v as usize]));
        // The queue handles wide pieces first, so deep points are found before pieces near the
        // surface become small.
        let mut pieces: VecDeque<[DVec3; 3]> = corners.filter(|t| Aabb::of(t).overlaps(bounds)).collect();
        while let Some(piece) = pieces.pop_front() {
            let (center, radius) = sphere(&piece);
            if other.reference.distance(center).0 + radius <= depth + least_gain {
                continue;
            }
            let heights = other.heights(&piece, center);
            let pairs = (0..16).map(|k| highest_of_lower(heights[k / 4], heights[k % 4]));
            if pairs.fold(f64::INFINITY, f64::min) <= depth + least_gain {
                continue;
            }
            depth = other.deeper(center, depth);
            // The depth is greatest on ridges, where two faces are equally near. Without these
            // points the search would only approach the maximum.
            for (i, j) in [(0, 1), (1, 2), (2, 0)] {
                let (at_i, at_j) = (heights[i][i] - heights[j][i], heights[i][j] - heights[j][j]);
                let share = at_i / (at_i - at_j);
                if (0.0..=1.0).contains(&share) {
                    depth = other.deeper(piece[i].lerp(piece[j], share), depth);
                }
            }
            // All points of a piece that does not cross the surface lie on the same side as its
            // centre.
            if !other.is_crossed_by(&piece) && !other.reference.is_inside(center) {
                continue;
            }
            pieces.extend(halves(piece));
        }
        depth
    }

    /// The depth of `p` if it is inside and deeper than `depth`, otherwise `depth`.
    fn deeper(&self, p: DVec3, depth: f64) -> f64 {
        let distance = self.reference.distance(p).0;
        if distance > depth && self.reference.is_inside(p) { distance } else { depth }
    }

    fn is_crossed_by(&self, piece: &[DVec3; 3]) -> bool {
        let near = self.reference.faces_meeting(Aabb::of(piece));
        near.into_iter().any(|face| triangles_meet(*piece, self.reference.face(face).corners))
    }

    /// Distances of the corners of the piece to four faces: the nearest faces of its three corners
    /// and of its centre.
    ///
    /// They bound the depth: no point of the piece is farther from the surface than from any of
    /// these faces. The distance to one face is convex, so it lies below the plane through its
    /// values at the corners. The lower plane of any two faces is also a bound, which is tight on
    /// ridges of the distance.
    fn heights(&self, piece: &[DVec3; 3], center: DVec3) -> [[f64; 3]; 4] {
        let nearest = |p: DVec3| self.reference.face(self.reference.distance(p).1);
        let to_corners = |face: &Triangle| piece.map(|c| face.closest(c).distance);
        [piece[0], piece[1], piece[2], center].map(|p| to_corners(nearest(p)))
    }

    /// The distance between two surfaces that do not cross. `pose` is the pose of `self` in the
    /// frame of `other`.
    fn separation(&self, other: &Self, pose: Pose) -> f64 {
        let placed = |face: &[u32; 3]| face.map(|v| pose.to_world(self.mesh.vertices()[v as usize]));
        let mut least = placed(&self.mesh.faces()[0])
            .map(|c| other.reference.distance(c).0)
            .into_iter()
            .fold(f64::INFINITY, f64::min);
        for face in self.mesh.faces() {
            let triangle = Triangle::new(placed(face));
            let bounds = Aabb::of(&triangle.corners);
            for candidate in other.reference.faces_meeting(bounds.grown(least)) {
                least = least.min(triangle_distance(&triangle, other.reference.face(candidate)));
            }
        }
        least
    }
}

/// The maximum over a triangle of the smaller of two linear functions, given by their values at the
/// corners. It equals the minimum over all convex combinations of the two functions of the
/// combination's maximum.
fn highest_of_lower(a: [f64; 3], b: [f64; 3]) -> f64 {
    let greatest =
        |share: f64| (0..3).map(|k| share * a[k] + (1.0 - share) * b[k]).fold(f64::NEG_INFINITY, f64::max);
    let crossing = |i: usize, j: usize| (b[j] - b[i]) / ((a[i] - b[i]) - (a[j] - b[j]));
    let shares = [0.0, 1.0, crossing(0, 1), crossing(1, 2), crossing(2, 0)];
    shares.into_iter().filter(|s| (0.0..=1.0).contains(s)).map(greatest).fold(f64::INFINITY, f64::min)
}

/// The distance of two triangles that do not cross. It is attained at a corner of one of them, or
/// between an edge of each.
fn triangle_distance(t: &Triangle, u: &Triangle) -> f64 {
    let corners = t.corners.iter().map(|&c| u.closest(c).distance);
    let corners = corners.chain(u.corners.iter().map(|&c| t.closest(c).distance));
    let edge = |t: &Triangle, k: usize| [t.corners[k], t.corners[(k + 1) % 3]];
    let edges = (0..9).map(|k| segment_distance(edge(t, k / 3), edge(u, k % 3)));
    corners.chain(edges).fold(f64::INFINITY, f64::min)
}

/// An upper bound of the distance of two segments: the distance of their lines, when its closest
/// points lie on both segments. Otherwise infinity, because an end point is then closest, and the
/// corners of the triangles cover that case.
fn segment_distance([a, b]: [DVec3; 2], [c, d]: [DVec3; 2]) -> f64 {
    let (u, v, w) = (b - a, d - c, a - c);
    let (uu, uv, vv, uw, vw) = (u.dot(u), u.dot(v), v.dot(v), u.dot(w), v.dot(w));
    let area = uu * vv - uv * uv;
    let (s, t) = ((uv * vw - vv * uw) / area, (uu * vw - uv * uw) / area);
    let inside = (0.0..=1.0).contains(&s) && (0.0..=1.0).contains(&t);
    if inside { (w + u * s - v * t).length() } else { f64::INFINITY }
}

fn sphere(t: &[DVec3; 3]) -> (DVec3, f64) {
    let center = (t[0] + t[1] + t[2]) / 3.0;
    (center, t.iter().map(|c| c.distance(center)).fold(0.0, f64::max))
}

/// Splits a triangle at the middle of its longest edge.
fn halves(t: [DVec3; 3]) -> [[DVec3; 3]; 2] {
    let length: [f64; 3] = from_fn(|k| t[k].distance_squared(t[(k + 1) % 3]));
    let k = (0..3).max_by(|&i, &j| length[i].total_cmp(&length[j])).unwrap_or(0);
    let (a, b, c) = (t[k], t[(k + 1) % 3], t[(k + 2) % 3]);
    let middle = a.midpoint(b);
    [[a, middle, c], [middle, b, c]]
}

#[cfg(test)]
mod tests {
    use std::f64::consts::{FRAC_PI_2, FRAC_PI_4, SQRT_2};

    use tesdf::glam::DQuat;

    use super::*;

    fn cube() -> TriangleMesh {
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../data/procedural/cube.obj");
        tesdf::mesh::read(path).expect("readable").mesh
    }

    /// Cubes with edges of 20 mm, where closed formulas give the clearance: face to face, edge to
    /// face, and crossed edges, both apart and overlapping.
    #[test]
    fn clearance_of_cubes() {
        let mesh = cube();
        let body = Body::new(&mesh);
        let edge_forward = DQuat::from_rotation_z(FRAC_PI_4);
        let edge_sideways = DQuat::from_rotation_x(FRAC_PI_2) * edge_forward;
        let half_diagonal = 0.01 * SQRT_2;
        let world = Pose { rotation: DQuat::from_rotation_x(0.3), translation: DVec3::new(0.1, 0.2, 0.3) };
        let gap = 0.001;
        // The offsets 0.003 and 0.002 keep the faces from lying in common planes.
        for (name, other, moved, reach, expected) in [
            ("faces, apart", DQuat::IDENTITY, DQuat::IDENTITY, 0.02 + gap, gap),
            ("faces, overlapping", DQuat::IDENTITY, DQuat::IDENTITY, 0.02 - gap, -gap),
            ("edge and face, apart", DQuat::IDENTITY, edge_forward, 0.01 + half_diagonal + gap, gap),
            ("edge and face, overlapping", DQuat::IDENTITY, edge_forward, 0.01 + half_diagonal - gap, -gap),
            ("edges, apart", edge_forward, edge_sideways, 2.0 * half_diagonal + gap, gap),
            // No vertex is inside the other cube.
            ("edges, overlapping", edge_forward, edge_sideways, 2.0 * half_diagonal - gap, -gap / SQRT_2),
        ] {
            let poses = [
                Pose {
                    rotation: world.rotation * moved,
                    translation: world.to_world(DVec3::new(reach, 0.003, 0.002)),
                },
                Pose { rotation: world.rotation * other, ..world },
            ];
            let found = body.clearance(&body, poses);
            assert!(
                (found - expected).abs() < 2.0 * TOLERANCE * mesh.diagonal(),
                "{name}: {found} is not {expected}"
            );
        }
    }
}
