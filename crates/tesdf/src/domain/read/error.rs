use std::path::PathBuf;

use super::TetFormat;
use crate::domain::TetMeshError;
use crate::mesh::{Place, msh::MshError};

/// Why a file does not give tetrahedra.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ReadTetrahedraError {
    /// A file cannot be read from disk.
    #[error("cannot read {}: {source}", path.display())]
    Open {
        /// The path. For TetGen it may be that of the other file of the pair.
        path: PathBuf,
        /// The error of the operating system.
        source: std::io::Error,
    },
    /// The extension names no format.
    #[error(
        "{}: the extension names no format of tetrahedra that can be read; expected one of {}: `meshio convert FILE OUT.msh` \
         converts others",
        path.display(),
        TetFormat::ALL.map(|f| format!(".{}", f.extension())).join(", ")
    )]
    UnknownExtension {
        /// The path asked for.
        path: PathBuf,
    },
    /// The bytes do not follow the rules of the format.
    #[error("{format}, {place}: {found}; {help}")]
    Malformed {
        /// The format.
        format: TetFormat,
        /// The place in the file.
        place: Place,
        /// What was found there.
        found: String,
        /// What was expected, or what to do.
        help: String,
    },
    /// An element has a volume and is not a tetrahedron with four corners.
    #[error(
        "{format}, {place}: element {element} is {kind}; expected tetrahedra of four vertices: save the mesh in first order, \
         without hexahedra, prisms and pyramids"
    )]
    Element {
        /// The format.
        format: TetFormat,
        /// The place in the file.
        place: Place,
        /// The number of the element in the file.
        element: u64,
        /// The kind of the element, such as `a hexahedron`.
        kind: String,
    },
    /// Vertices and tetrahedra do not make a mesh. Ids are in the order of the file.
    #[error("{format}: {source}")]
    Mesh {
        /// The format.
        format: TetFormat,
        /// The error of the mesh.
        source: TetMeshError,
    },
}

impl From<MshError> for ReadTetrahedraError {
    fn from(error: MshError) -> Self {
        let format = TetFormat::Msh;
        match error {
            MshError::Malformed { place, found, help } => Self::Malformed { format, place, found, help },
            MshError::Volume { place, element, kind } => {
                Self::Element { format, place, element, kind: kind.into() }
            }
        }
    }
}

/// An error about the bytes of a format.
pub(super) fn malformed(
    format: TetFormat,
    place: Place,
    found: impl Into<String>,
    help: impl Into<String>,
) -> ReadTetrahedraError {
    ReadTetrahedraError::Malformed { format, place, found: found.into(), help: help.into() }
}
