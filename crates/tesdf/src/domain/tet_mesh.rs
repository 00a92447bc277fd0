use glam::DVec3;

/// Tetrahedra as they come from a mesher: positions and corner ids.
///
/// Coordinates are finite, ids are in range, there is at least one tetrahedron. Nothing else is promised: tetrahedra may
/// be flat, overlap, or come in either order of corners. [`ConformingMesh`](super::ConformingMesh) matches them with a
/// surface and validates them.
#[derive(Clone, Debug, PartialEq)]
pub struct TetMesh {
    vertices: Vec<DVec3>,
    tetrahedra: Vec<[u32; 4]>,
}

/// Why vertices and corner ids do not make a [`TetMesh`].
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
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
    /// More vertices or tetrahedra than can be encoded.
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

    #[test]
    fn errors_name_what_is_at_fault() {
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
