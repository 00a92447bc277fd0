use glam::DVec3;

/// The check that a tetrahedralisation did not pass.
///
/// All ids are 0-based. Ids of tetrahedra are those of the [`TetMesh`](crate::domain::TetMesh). Ids
/// `v` of the vertices of a triangle or a place are those of its vertices. Ids of faces are those
/// of the surface.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ConformingError {
    /// A coordinate is outside of the range in which predicates are exact.
    #[error(
        "range: vertex {vertex} of the tetrahedra has {axis} = {value:e}; expected 0 or an absolute value from 1e-90 to \
         1e50: change the unit of surface and tetrahedra"
    )]
    OutOfRange {
        /// Vertex of the tetrahedral mesh.
        vertex: usize,
        /// `x`, `y` or `z`.
        axis: char,
        /// The value found.
        value: f64,
    },
    /// A vertex of the surface is not a corner of any tetrahedron.
    #[error(
        "surface vertices: {missing} of {of} are no corner of a tetrahedron, bit for bit; first vertex {vertex} of the \
         surface at {position}, from which the nearest corner is {distance:e} away. Write the tetrahedra with 17 digits or \
         in binary, from the same surface, and keep the mesher from moving vertices"
    )]
    VertexMissing {
        /// Number of such vertices.
        missing: usize,
        /// Number of vertices that faces use.
        of: usize,
        /// The first such vertex, by its id in the surface.
        vertex: usize,
        /// Its position, in the unit of the mesh.
        position: DVec3,
        /// Its distance from the nearest corner, in the unit of the mesh.
        distance: f64,
    },
    /// The corners of a tetrahedron lie exactly in one plane.
    #[error(
        "orientation: {flat} of {of} tetrahedra are flat (volume exactly 0); first tetrahedron {tetrahedron} at {position}. \
         Mesh again with another algorithm or optimiser"
    )]
    Flat {
        /// Number of such tetrahedra.
        flat: usize,
        /// Number of tetrahedra.
        of: usize,
        /// The first such tetrahedron.
        tetrahedron: usize,
        /// Its centroid, in the mesh's unit.
        position: DVec3,
    },
    /// More than two tetrahedra have the same triangle.
    #[error(
        "sharing: {users} tetrahedra have the triangle at {position}, among them {tetrahedra:?}; expected one or two. \
         Remove doubled or overlapping tetrahedra"
    )]
    Overfull {
        /// Number of tetrahedra with the triangle.
        users: usize,
        /// The first two of these tetrahedra.
        tetrahedra: [u32; 2],
        /// Centroid of the triangle, in the mesh's unit.
        position: DVec3,
    },
    /// Two tetrahedra share a triangle and are on the same side of it.
    #[error(
        "sharing: tetrahedra {} and {} are on the same side of the triangle that they share, at {position}: they overlap. \
         Mesh again", tetrahedra[0], tetrahedra[1]
    )]
    SameSide {
        /// The two tetrahedra.
        tetrahedra: [u32; 2],
        /// Centroid of the triangle, in the mesh's unit.
        position: DVec3,
    },
    /// A face of the surface has no area.
    #[error(
        "faces: face {face} of the surface has no area, so it cannot be a side of a tetrahedron: run `tesdf repair`, and \
         mesh the result"
    )]
    FaceWithoutArea {
        /// The face.
        face: usize,
    },
    /// A face of the surface is not a side of any tetrahedron.
    #[error(
        "faces: {missing} of {of} faces of the surface are no side of a tetrahedron; first face {face}, {reason}. {}",
        reason.help()
    )]
    FaceMissing {
        /// Number of such faces.
        missing: usize,
        /// Number of faces.
        of: usize,
        /// The first such face.
        face: usize,
        /// What is known about this face.
        reason: MissingFace,
    },
    /// A tetrahedron inside has a side that belongs neither to the surface nor to another
    /// tetrahedron.
    #[error(
        "labels: tetrahedron {tetrahedron} is inside, and its side at {position} is neither a face of the surface nor \
         shared with another tetrahedron: the inside is not filled. Mesh the whole inside"
    )]
    InsideOpen {
        /// The tetrahedron.
        tetrahedron: usize,
        /// Centroid of its side, in the mesh's unit.
        position: DVec3,
    },
    /// There is no tetrahedron on the inner side of a face.
    #[error(
        "labels: face {face} of the surface has no tetrahedron on its side with winding number {winding}: the inside is not \
         filled. Mesh the whole inside"
    )]
    InsideEmpty {
        /// The face.
        face: usize,
        /// Winding number on that side.
        winding: i32,
    },
    /// The winding numbers on the two sides of a face do not differ by the number that the face
    /// stands for.
    #[error(
        "labels: tetrahedra {} and {} on the two sides of face {face} of the surface have the winding numbers {} and {}: \
         tetrahedra overlap. Mesh again", tetrahedra[0], tetrahedra[1], windings[0], windings[1]
    )]
    Labels {
        /// The face.
        face: usize,
        /// The tetrahedra on its sides.
        tetrahedra: [u32; 2],
        /// Their winding numbers.
        windings: [i32; 2],
    },
    /// No tetrahedron of a connected part is fat enough that its rounded centroid lies inside of
    /// it.
    #[error(
        "labels: no tetrahedron of the part with tetrahedron {tetrahedron} is thick enough for 64-bit floats to hold a point \
         inside of it. Mesh again with another optimiser"
    )]
    NoSeed {
        /// The first tetrahedron of the part.
        tetrahedron: usize,
    },
    /// The tetrahedra inside do not have the volume that the surface encloses.
    #[error(
        "volume: the tetrahedra inside have the volume {inside:e}, the surface encloses {surface:e}; expected agreement to \
         1e-9. Mesh again from the same surface"
    )]
    Volume {
        /// Volume of the tetrahedra, each counted as often as its winding number says.
        inside: f64,
        /// Volume that the surface encloses.
        surface: f64,
    },
    /// The outer boundary of the domain meets itself, or goes around some place twice. So
    /// tetrahedra overlap or do not fit.
    #[error(
        "overlap: the outer boundary of the tetrahedra is not embedded: {found}, at {position}. Tetrahedra overlap, or \
         meet in parts of triangles. Mesh again, the outer region with vertices that match"
    )]
    Overlap {
        /// What was found.
        found: String,
        /// The place, in the unit of the mesh.
        position: DVec3,
    },
}

/// What is known about a face that is not a side of any tetrahedron.
#[derive(Clone, Debug, PartialEq)]
pub enum MissingFace {
    /// A vertex that the surface does not have lies on it.
    Split {
        /// Its id in the tetrahedral mesh.
        vertex: usize,
    },
    /// Its corners are there, but the face is not: the mesher cut the surface in another way.
    Recut,
}

impl MissingFace {
    fn help(&self) -> &'static str {
        match self {
            Self::Split { .. } => {
                "Faces cut into coplanar parts are not supported: keep the mesher from adding vertices to the surface \
                 (TetGen: -Y), or encode the surface of the tetrahedra, `TetMesh::surface`"
            }
            Self::Recut => {
                "Keep the mesher from changing the surface (TetGen: -Y), remove self-intersections, or encode the surface \
                 of the tetrahedra, `TetMesh::surface`"
            }
        }
    }
}

impl std::fmt::Display for MissingFace {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Split { vertex } => {
                write!(f, "on which vertex {vertex} of the tetrahedra lies: the mesher split it")
            }
            Self::Recut => f.write_str("whose corners are there: the mesher changed the surface"),
        }
    }
}
