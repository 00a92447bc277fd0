use std::path::PathBuf;

use crate::domain::{ConformingError, TetMeshError};
use crate::encode::EncodeError;
use crate::mesh::{MeshError, NotSolid};
use crate::save::SaveError;

/// Why a JSON file of TES-Encoder does not give an asset. Places in arrays are 0-based.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ImportJsonError {
    /// The file cannot be read from disk.
    #[error("cannot read {}: {source}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// The error of the operating system.
        source: std::io::Error,
    },
    /// The text is not JSON, or a value is of another type. The message has line and column.
    #[error("JSON of TES-Encoder: {0}")]
    Text(String),
    /// A key is missing.
    #[error(
        "JSON of TES-Encoder: there is no key {key}; expected a file with surface_nodes, faces, tetrahedra and encoded_faces"
    )]
    Missing {
        /// The key.
        key: &'static str,
    },
    /// A value does not fit the others.
    #[error("{place}: {found}, expected {expected}")]
    Value {
        /// The key, and the place in its array, as in `inner_tetras[17]`.
        place: String,
        /// What is there.
        found: String,
        /// What would fit.
        expected: String,
    },
    /// The surface is not a mesh.
    #[error("faces: {0}")]
    Surface(#[from] MeshError),
    /// The surface has no inside.
    #[error("faces: {0}")]
    NotSolid(#[from] NotSolid),
    /// There are no tetrahedra, or too many.
    #[error("tetrahedra: {0}")]
    Tetrahedra(#[from] TetMeshError),
    /// The tetrahedra do not conform to the surface.
    #[error(
        "{0} (tetrahedra count over surface_inner, inner, surface_outer and outer in this order, from 0)"
    )]
    Conforming(#[from] ConformingError),
    /// There is no asset of this surface and these tetrahedra.
    #[error(transparent)]
    Encode(#[from] EncodeError),
}

/// Why an asset cannot be written as JSON of TES-Encoder.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ExportJsonError {
    /// The cells of the asset are those of the bisection domain, with hanging nodes, and faces pass
    /// through them. In Rust, [`Domain::Conforming`](crate::Domain::Conforming) encodes in another
    /// domain.
    #[error(
        "the asset has the bisection domain, which JSON of TES-Encoder cannot hold; encode the mesh with tetrahedra that \
         conform to it: `tesdf encode MESH -o FILE --domain gmsh --plain`"
    )]
    NotConforming,
    /// The face tree answers in a tetrahedron, so it has no list.
    #[error("tetrahedron {tetrahedron} has cells without a list; encode the mesh again")]
    NoList {
        /// The tetrahedron, by its place in the asset.
        tetrahedron: usize,
    },
    /// The values cannot be written as text.
    #[error("cannot write JSON: {0}")]
    Text(String),
    /// The file cannot be written.
    #[error(transparent)]
    Save(#[from] SaveError),
}
