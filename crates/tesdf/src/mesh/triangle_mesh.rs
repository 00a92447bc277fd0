use glam::DVec3;

use crate::geometry::Aabb;

/// An indexed triangle mesh. All indices are in range, and all coordinates are finite.
///
/// Coordinates are in the mesh's own unit. The corners of a face are counter-clockwise seen from
/// outside (right-hand rule). Nothing else is guaranteed: the mesh may be open, self-intersecting
/// or wrongly oriented.
#[derive(Clone, Debug, PartialEq)]
pub struct TriangleMesh {
    vertices: Vec<DVec3>,
    faces: Vec<[u32; 3]>,
}

/// Why vertices and faces do not make a [`TriangleMesh`].
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum MeshError {
    /// A face uses a vertex that does not exist.
    #[error("face {face} uses vertex {index}, but there are {vertices} vertices (0-based)")]
    IndexOutOfRange {
        /// Face, 0-based.
        face: usize,
        /// The index found.
        index: u64,
        /// Number of vertices.
        vertices: usize,
    },
    /// A coordinate is NaN or infinite.
    #[error("vertex {vertex} has the coordinate {axis} = {value}; coordinates must be finite")]
    NonFinite {
        /// Vertex, 0-based.
        vertex: usize,
        /// `x`, `y` or `z`.
        axis: char,
        /// The value found.
        value: f64,
    },
    /// There is no face.
    #[error("the mesh has no faces; expected at least one triangle")]
    Empty,
    /// There are more vertices or faces than 32-bit ids can name.
    #[error("{found} {what} are more than the {limit} that 32-bit ids can name; split the mesh")]
    TooLarge {
        /// `vertices` or `faces`.
        what: &'static str,
        /// The number found.
        found: usize,
        /// The largest accepted number.
        limit: usize,
    },
}

impl TriangleMesh {
    /// Largest accepted number of vertices, and of faces.
    pub const MAX_ELEMENTS: usize = (1 << 29) - 1;

    /// Checks indices and coordinates.
    ///
    /// # Errors
    /// [`MeshError`] names the first face or vertex at fault.
    pub fn new(vertices: Vec<DVec3>, faces: Vec<[u32; 3]>) -> Result<Self, MeshError> {
        for (what, found) in [("vertices", vertices.len()), ("faces", faces.len())] {
            if found > Self::MAX_ELEMENTS {
                return Err(MeshError::TooLarge { what, found, limit: Self::MAX_ELEMENTS });
            }
        }
        if faces.is_empty() {
            return Err(MeshError::Empty);
        }
        for (face, corners) in faces.iter().enumerate() {
            if let Some(&index) = corners.iter().find(|&&i| i as usize >= vertices.len()) {
                return Err(MeshError::IndexOutOfRange {
                    face,
                    index: index.into(),
                    vertices: vertices.len(),
                });
            }
        }
        for (vertex, p) in vertices.iter().enumerate() {
            for (axis, value) in ['x', 'y', 'z'].into_iter().zip(p.to_array()) {
                if !value.is_finite() {
                    return Err(MeshError::NonFinite { vertex, axis, value });
                }
            }
        }
        Ok(Self { vertices, faces })
    }

    /// A mesh of faces and vertices that were taken from a valid one.
    pub(super) fn of_part(vertices: Vec<DVec3>, faces: Vec<[u32; 3]>) -> Self {
        debug_assert!(faces.iter().flatten().all(|&v| (v as usize) < vertices.len()));
        Self { vertices, faces }
    }

    /// Vertex positions, in the mesh's unit.
    pub fn vertices(&self) -> &[DVec3] {
        &self.vertices
    }

    /// Corner indices of each face, counter-clockwise seen from outside.
    pub fn faces(&self) -> &[[u32; 3]] {
        &self.faces
    }

    /// Corner positions of face `face`, in the mesh's unit.
    ///
    /// # Panics
    /// When `face` is not smaller than the number of faces.
    pub fn triangle(&self, face: usize) -> [DVec3; 3] {
        self.faces[face].map(|v| self.vertices[v as usize])
    }

    /// Bounds of the used vertices, in the mesh's unit.
    pub fn bounds(&self) -> Aabb {
        (0..self.faces.len()).fold(Aabb::EMPTY, |b, f| b.union(Aabb::of(&self.triangle(f))))
    }

    /// Length of the diagonal of [`bounds`](Self::bounds), in the mesh's unit. Relative tolerances
    /// refer to it.
    pub fn diagonal(&self) -> f64 {
        self.bounds().extent().length()
    }
}
