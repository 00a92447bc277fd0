//! The surface of an asset as the proof uses it: vertices identified by position, and a ball around
//! each face.
use std::collections::HashMap;

use glam::DVec3;

use super::ProveError;
use super::exact::difference;
use super::parts::{Face, rounding};
use crate::geometry::LocalFrame;

/// No vertex and no cell may be farther than this from the origin of the local frame: the rounding
/// bounds assume it.
pub const FARTHEST: f64 = 64.0;

/// All faces, in the local frame and in the order of the file.
pub struct Surface {
    /// Distinct positions.
    pub points: Vec<DVec3>,
    /// For each vertex of the file, the index of its position.
    place_of: Vec<u32>,
    /// Corners of the faces, as indices into `points`.
    pub faces: Vec<[u32; 3]>,
    /// The faces themselves.
    pub triangles: Vec<Face>,
    /// For each face, centre and radius of a ball that contains it, up to rounding.
    balls: Vec<(DVec3, f64)>,
    /// Bound of the error of a distance between points that are up to [`FARTHEST`] from the origin.
    pub error: f64,
}

impl Surface {
    /// The mesh of an asset. `faces` are those of the surface, then those that count for the sign
    /// only. Vertices that none of them uses do not matter.
    ///
    /// # Errors
    /// [`ProveError::Frame`] when mapping a vertex to the local frame rounds it, or the vertex lies
    /// farther than [`FARTHEST`] from the origin.
    pub fn new(
        vertices: &[[f64; 3]],
        [faces, sign_faces]: [&[[u32; 3]]; 2],
        frame: LocalFrame,
    ) -> Result<Self, ProveError> {
        let mut is_used = vec![false; vertices.len()];
        let corners = faces.iter().chain(sign_faces).flatten();
        corners.for_each(|&v| is_used[v as usize] = true);
        let is_exact = |v: DVec3| (0..3).all(|k| difference(v[k], frame.offset[k]).1 == 0.0);
        let mut places = HashMap::new();
        let mut points = Vec::new();
        let mut place_of = Vec::with_capacity(vertices.len());
        for (vertex, &v) in vertices.iter().enumerate() {
            if !is_used[vertex] {
                place_of.push(u32::MAX);
                continue;
            }
            let v = DVec3::from_array(v);
            let p = frame.to_local(v);
            let back = p / frame.scale;
            if !(is_exact(v) && back == v - frame.offset && p.abs().max_element() <= FARTHEST) {
                return Err(ProveError::Frame { vertex });
            }
            // Turns -0 into 0.
            let bits = (p + 0.0).to_array().map(f64::to_bits);
            place_of.push(*places.entry(bits).or_insert_with(|| {
                points.push(p + 0.0);
                points.len() as u32 - 1
            }));
        }
        let faces: Vec<[u32; 3]> = faces.iter().map(|f| f.map(|v| place_of[v as usize])).collect();
        let triangles: Vec<Face> =
            faces.iter().map(|f| Face::new(f.map(|v| points[v as usize]), 0.0)).collect();
        let ball = |face: &Face| {
            let [a, b, c] = face.corners;
            let middle = (a + b + c) / 3.0;
            (middle, face.corners.iter().map(|p| p.distance(middle)).fold(0.0, f64::max))
        };
        let balls = triangles.iter().map(ball).collect();
        Ok(Self { points, place_of, faces, triangles, balls, error: rounding(4.0 * FARTHEST) })
    }

    /// The indices into `points` of the corners of a face of the file.
    pub fn places(&self, face: [u32; 3]) -> [u32; 3] {
        face.map(|v| self.place_of[v as usize])
    }

    /// The corners of further faces of the file.
    pub fn sign_triangles(&self, faces: &[[u32; 3]]) -> Vec<[DVec3; 3]> {
        faces.iter().map(|&f| self.places(f).map(|v| self.points[v as usize])).collect()
    }

    /// The faces among `faces` that can be closest to a point within `radius` of `center`.
    ///
    /// For every dropped face, some kept face is at least as near at every point of that ball.
    pub fn retain_near(&self, center: DVec3, radius: f64, faces: &[u32]) -> Vec<u32> {
        let ball = |face: u32| {
            let (middle, reach) = self.balls[face as usize];
            (middle.distance(center), reach)
        };
        let mut high = faces.iter().map(|&f| ball(f).0).fold(f64::INFINITY, f64::min) + self.error;
        for &face in faces {
            let (distance, reach) = ball(face);
            if distance - reach <= high {
                high = high.min(self.triangles[face as usize].high(center, self.error).distance);
            }
        }
        let limit = high + 2.0 * radius + 2.0 * self.error;
        let is_near = |face: &u32| {
            let (distance, reach) = ball(*face);
            distance - reach <= limit
                && self.triangles[*face as usize].low(center, self.error).distance <= limit
        };
        faces.iter().copied().filter(is_near).collect()
    }
}
