//! Where a mesh is convex around its vertices, and the faces beside each other there.
use glam::DVec3;

use super::TeSdf;

/// A corner of a face may be higher over the plane of a face beside it by this part of its distance,
/// and the place is convex all the same.
pub const CONVEX: f64 = 1e-5;

/// Cosine of the least angle of a face at a vertex whose surroundings are clear (0.01 rad).
const LEAST_ANGLE: f64 = 0.99995;

impl TeSdf {
    /// For each vertex, the distance from it within which there are only the faces that have it, in
    /// the unit of the mesh: positive where these are convex, negative where they are not, and 0
    /// where a face has no area or is a needle there. Made on first use.
    #[doc(hidden)]
    pub fn corner_cones(&self) -> &[f32] {
        // On one thread: a thread that waits could take up a task that waits for this.
        self.corner_cones
            .get_or_init(|| (0..self.vertices.len() as u32).map(|vertex| self.corner_cone(vertex)).collect())
    }

    /// The other faces that have a side of a face. Side k goes from corner k to the next one.
    pub(crate) fn faces_beside(&self, face: usize, side: usize) -> impl Iterator<Item = usize> {
        let corners = self.faces[face];
        let (start, end) = (corners[side], corners[(side + 1) % 3]);
        let mut last = face;
        self.faces_at(start).iter().map(|&other| other as usize).filter(move |&other| {
            // A face that has the vertex twice is named twice.
            let is_new = other != face && other != last && self.faces[other].contains(&end);
            last = if is_new { other } else { last };
            is_new
        })
    }

    fn corner_cone(&self, vertex: u32) -> f32 {
        let (mut clear, mut is_convex) = (f64::INFINITY, true);
        let fan = self.faces_at(vertex);
        let corners_of = |face: u32| {
            let corners = self.face_corners(face as usize);
            let first = self.face_vertices(face as usize).iter().position(|v| *v == vertex).unwrap_or(0);
            [0, 1, 2].map(|k| corners[(first + k) % 3])
        };
        for &face in fan {
            let [at, p, q] = corners_of(face);
            let (u, v) = (p - at, q - at);
            let Some(normal) = u.cross(v).try_normalize() else { return 0.0 };
            let side = q - p;
            let share = (-u.dot(side) / side.length_squared()).clamp(0.0, 1.0);
            clear = clear.min((u + share * side).length());
            if u.dot(v) > LEAST_ANGLE * u.length() * v.length() || !clear.is_finite() {
                return 0.0;
            }
            let is_under = |way: DVec3| way.dot(normal) <= CONVEX * way.length();
            is_convex &= fan.iter().flat_map(|&other| corners_of(other)).all(|corner| is_under(corner - at));
        }
        if fan.is_empty() {
            0.0
        } else if is_convex {
            clear as f32
        } else {
            -clear as f32
        }
    }
}
