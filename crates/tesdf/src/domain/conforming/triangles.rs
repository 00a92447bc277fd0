//! The triangles of a tetrahedralisation, each with the tetrahedra on its sides and with the face
//! of the surface that it is.
use glam::DVec3;

use super::{ConformingError, MissingFace, weld::Welded};
use crate::{
    domain::sides::sides_of,
    geometry::{Triangle as Corners, normal_signs},
    mesh::SolidMesh,
};

/// A vertex that is farther from a missing face than this, relative to the diagonal, does not lie
/// on it.
const ON_FACE: f64 = 1e-9;

/// A triangle of the tetrahedralisation. Seen from its front, its corners in ascending order go
/// counter-clockwise.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Triangle {
    /// Ascending.
    pub corners: [u32; 3],
    /// The tetrahedra in front and behind.
    pub sides: [Option<u32>; 2],
    /// The face of the surface that the triangle is, or the first of several.
    pub face: Option<u32>,
    /// Winding number behind the triangle minus that in front: 1 for each face with its front on
    /// the same side, -1 for each other face.
    pub jump: i32,
}

pub(super) const FRONT: usize = 0;
pub(super) const BEHIND: usize = 1;

/// The corners in ascending order, and whether sorting took an odd number of swaps.
fn sorted([mut a, mut b, mut c]: [u32; 3]) -> ([u32; 3], bool) {
    let mut odd = false;
    for _ in 0..2 {
        if a > b {
            (a, b, odd) = (b, a, !odd);
        }
        if b > c {
            (b, c, odd) = (c, b, !odd);
        }
    }
    ([a, b, c], odd)
}

impl Triangle {
    pub fn positions(&self, vertices: &[DVec3]) -> [DVec3; 3] {
        self.corners.map(|v| vertices[v as usize])
    }

    pub fn centroid(&self, vertices: &[DVec3]) -> DVec3 {
        self.positions(vertices).iter().sum::<DVec3>() / 3.0
    }

    /// The corners, counter-clockwise seen from outside, when only one side has a tetrahedron.
    pub fn outward(&self) -> Option<[u32; 3]> {
        let [a, b, c] = self.corners;
        match self.sides {
            [None, Some(_)] => Some([a, b, c]),
            [Some(_), None] => Some([a, c, b]),
            _ => None,
        }
    }
}

/// All triangles, by ascending corners. The tetrahedra must be positively oriented.
pub(super) fn triangles(welded: &Welded) -> Result<Vec<Triangle>, ConformingError> {
    let mut uses: Vec<([u32; 3], u32, usize)> = Vec::with_capacity(4 * welded.tetrahedra.len());
    for (t, &corners) in (0u32..).zip(&welded.tetrahedra) {
        for side in sides_of(corners) {
            // The side is ordered outward, so the tetrahedron is behind the triangle, unless
            // sorting turned the triangle over.
            let (key, odd) = sorted(side);
            uses.push((key, t, if odd { FRONT } else { BEHIND }));
        }
    }
    uses.sort_unstable();
    let mut found = Vec::with_capacity(uses.len() / 2 + 1);
    for group in uses.chunk_by(|a, b| a.0 == b.0) {
        let mut triangle = Triangle { corners: group[0].0, sides: [None; 2], face: None, jump: 0 };
        if let [(_, first, _), (_, second, _), _, ..] = *group {
            let position = triangle.centroid(&welded.vertices);
            return Err(ConformingError::Overfull {
                users: group.len(),
                tetrahedra: [first, second],
                position,
            });
        }
        for &(_, t, side) in group {
            if let Some(other) = triangle.sides[side].replace(t) {
                let position = triangle.centroid(&welded.vertices);
                return Err(ConformingError::SameSide { tetrahedra: [other, t], position });
            }
        }
        found.push(triangle);
    }
    Ok(found)
}

/// Assigns each face of the surface to its triangle.
pub(super) fn place_faces(
    triangles: &mut [Triangle],
    solid: &SolidMesh,
    welded: &Welded,
) -> Result<(), ConformingError> {
    let mesh = solid.mesh();
    let mut first = None;
    let mut missing = 0;
    for (face, corners) in mesh.faces().iter().enumerate() {
        let [a, b, c] = mesh.triangle(face);
        if normal_signs(a, b, c) == [0; 3] {
            return Err(ConformingError::FaceWithoutArea { face });
        }
        let (key, odd) = sorted(corners.map(|v| welded.surface[v as usize]));
        match triangles.binary_search_by_key(&key, |t| t.corners) {
            Ok(at) => {
                triangles[at].face.get_or_insert(face as u32);
                triangles[at].jump += if odd { -1 } else { 1 };
            }
            Err(_) => {
                missing += 1;
                first.get_or_insert(face);
            }
        }
    }
    let Some(face) = first else { return Ok(()) };
    let corners = Corners::new(mesh.triangle(face));
    let near = ON_FACE * mesh.diagonal();
    let own = mesh.vertices().len();
    let on_it = |p: DVec3| corners.closest(p).distance <= near;
    let reason = match welded.vertices[own..].iter().position(|&p| on_it(p)) {
        Some(at) => MissingFace::Split { vertex: welded.origin[at] as usize },
        None => MissingFace::Recut,
    };
    Err(ConformingError::FaceMissing { missing, of: mesh.faces().len(), face, reason })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sorting_counts_swaps() {
        for (corners, odd) in [
            ([1, 2, 3], false),
            ([2, 3, 1], false),
            ([3, 1, 2], false),
            ([2, 1, 3], true),
            ([1, 3, 2], true),
            ([3, 2, 1], true),
        ] {
            assert_eq!(sorted(corners), ([1, 2, 3], odd));
        }
    }
}
