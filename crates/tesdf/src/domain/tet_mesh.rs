use std::collections::HashMap;

use glam::DVec3;

use super::sides::sides_of;
use crate::{
    geometry::orientation,
    mesh::{MeshError, TriangleMesh},
};

/// The tetrahedra of a mesher: positions and corner ids.
///
/// Coordinates are finite, ids are in range, and there is at least one tetrahedron. Nothing else is
/// certain: tetrahedra may be flat, may overlap, and may have their corners in either order.
/// [`ConformingMesh`](super::ConformingMesh) matches them with a surface and checks them.
#[derive(Clone, Debug, PartialEq)]
pub struct TetMesh {
    vertices: Vec<DVec3>,
    tetrahedra: Vec<[u32; 4]>,
}

/// Why vertices and corner ids do not make a [`TetMesh`].
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum TetMeshError {
    /// There is no tetrahedron.
    #[error("there are no tetrahedra; expected at least one: is this the mesh of a surface?")]
    Empty,
    /// A tetrahedron uses a vertex that does not exist.
    #[error("tetrahedron {tetrahedron} uses vertex {index}, but there are {vertices} vertices (0-based)")]
    IndexOutOfRange {
        /// Tetrahedron, 0-based.
        tetrahedron: usize,
        /// The index found.
        index: u32,
        /// Number of vertices.
        vertices: usize,
    },
    /// A coordinate is NaN or infinite.
    #[error("vertex {vertex} (0-based) has the coordinate {axis} = {value}; coordinates must be finite")]
    NonFinite {
        /// Vertex, 0-based.
        vertex: usize,
        /// `x`, `y` or `z`.
        axis: char,
        /// The value found.
        value: f64,
    },
    /// There are more vertices or tetrahedra than can be encoded.
    #[error("{found} {what} are more than the limit of {limit}; split the mesh")]
    TooLarge {
        /// `vertices` or `tetrahedra`.
        what: &'static str,
        /// Number found.
        found: usize,
        /// Largest number accepted.
        limit: usize,
    },
}

impl TetMesh {
    /// Largest number of vertices and of tetrahedra.
    pub const MAX_ELEMENTS: usize = (1 << 29) - 1;

    /// Checks ids and coordinates.
    ///
    /// # Errors
    /// [`TetMeshError`] names the first tetrahedron or vertex at fault.
    pub fn new(vertices: Vec<DVec3>, tetrahedra: Vec<[u32; 4]>) -> Result<Self, TetMeshError> {
        for (what, found) in [("vertices", vertices.len()), ("tetrahedra", tetrahedra.len())] {
            if found > Self::MAX_ELEMENTS {
                return Err(TetMeshError::TooLarge { what, found, limit: Self::MAX_ELEMENTS });
            }
        }
        if tetrahedra.is_empty() {
            return Err(TetMeshError::Empty);
        }
        for (tetrahedron, corners) in tetrahedra.iter().enumerate() {
            if let Some(&index) = corners.iter().find(|&&i| i as usize >= vertices.len()) {
                return Err(TetMeshError::IndexOutOfRange { tetrahedron, index, vertices: vertices.len() });
            }
        }
        for (vertex, p) in vertices.iter().enumerate() {
            for (axis, value) in ['x', 'y', 'z'].into_iter().zip(p.to_array()) {
                if !value.is_finite() {
                    return Err(TetMeshError::NonFinite { vertex, axis, value });
                }
            }
        }
        Ok(Self { vertices, tetrahedra })
    }

    /// Vertex positions, in the mesh's unit.
    pub fn vertices(&self) -> &[DVec3] {
        &self.vertices
    }

    /// Corner ids of each tetrahedron, in either orientation.
    pub fn tetrahedra(&self) -> &[[u32; 4]] {
        &self.tetrahedra
    }

    /// The outer boundary: the sides of only one tetrahedron, outward, in the order of the
    /// tetrahedra.
    ///
    /// For tetrahedra that fill a solid, for example those of a finite-element mesh, this is the
    /// surface that they conform to. It has only the vertices that it uses, in the order of this
    /// mesh.
    ///
    /// # Errors
    /// [`MeshError::Empty`] when no side is on a boundary.
    pub fn surface(&self) -> Result<TriangleMesh, MeshError> {
        let outward = |t: usize| {
            let [a, b, c, d] = self.tetrahedra[t];
            let [p, q, r, s] = self.corners(t);
            sides_of(if orientation(p, q, r, s) > 0 { [a, b, d, c] } else { [a, b, c, d] })
        };
        let ascending = |mut side: [u32; 3]| {
            side.sort_unstable();
            side
        };
        let mut users: HashMap<[u32; 3], u32> = HashMap::new();
        for side in (0..self.tetrahedra.len()).flat_map(outward) {
            *users.entry(ascending(side)).or_default() += 1;
        }
        let mut faces: Vec<[u32; 3]> = (0..self.tetrahedra.len())
            .flat_map(outward)
            .filter(|&side| users[&ascending(side)] == 1)
            .collect();
        let mut ids = vec![u32::MAX; self.vertices.len()];
        faces.iter().flatten().for_each(|&v| ids[v as usize] = 0);
        let mut vertices = Vec::new();
        for (id, &p) in ids.iter_mut().zip(&self.vertices).filter(|(id, _)| **id == 0) {
            *id = vertices.len() as u32;
            vertices.push(p);
        }
        faces.iter_mut().flatten().for_each(|v| *v = ids[*v as usize]);
        TriangleMesh::new(vertices, faces)
    }

    /// Corner positions of a tetrahedron.
    ///
    /// # Panics
    /// When `tetrahedron` is not smaller than the number of tetrahedra.
    pub fn corners(&self, tetrahedron: usize) -> [DVec3; 4] {
        self.tetrahedra[tetrahedron].map(|v| self.vertices[v as usize])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two tetrahedra, one of them in negative order, have six outer sides.
    #[test]
    fn faces_of_the_surface_point_outward() {
        let vertices = vec![DVec3::ZERO, DVec3::X, DVec3::splat(9.0), DVec3::Y, DVec3::Z, DVec3::ONE];
        let mesh = TetMesh::new(vertices, vec![[0, 1, 3, 4], [1, 3, 5, 4]]).unwrap();
        let surface = mesh.surface().unwrap();
        assert_eq!((surface.vertices().len(), surface.faces().len()), (5, 6));
        let center = 0.25 * (DVec3::X + DVec3::Y + DVec3::Z + DVec3::splat(0.3));
        for face in 0..6 {
            let [a, b, c] = surface.triangle(face);
            assert!((b - a).cross(c - a).dot(a - center) > 0.0);
        }
        let report = crate::mesh::check(&surface);
        assert!(report.is_simple(), "{report}");
    }

    #[test]
    fn errors_name_the_tetrahedron_or_vertex() {
        let vertices = vec![DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z];
        assert!(TetMesh::new(vertices.clone(), vec![[0, 1, 2, 3]]).is_ok());
        assert_eq!(TetMesh::new(vertices.clone(), vec![]), Err(TetMeshError::Empty));
        let error = TetMesh::new(vertices.clone(), vec![[0, 1, 2, 3], [0, 1, 2, 4]]);
        assert_eq!(error, Err(TetMeshError::IndexOutOfRange { tetrahedron: 1, index: 4, vertices: 4 }));
        let mut bad = vertices;
        bad[2].y = f64::INFINITY;
        let error = TetMesh::new(bad, vec![[0, 1, 2, 3]]);
        assert_eq!(error, Err(TetMeshError::NonFinite { vertex: 2, axis: 'y', value: f64::INFINITY }));
    }
}
