use std::path::{Path, PathBuf};

use super::{CadError, MeshFormat, Place};
use crate::mesh::MeshError;

/// Why a file gives no mesh.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ReadError {
    /// The file cannot be read from disk.
    #[error("cannot read {}: {source}", path.display())]
    Open {
        /// The requested path.
        path: PathBuf,
        /// The error of the operating system.
        source: std::io::Error,
    },
    /// The extension names no mesh format.
    #[error(
        "{}: the extension names no mesh format that can be read; expected one of {}",
        path.display(),
        MeshFormat::ALL.map(|f| format!(".{}", f.extension())).join(", ")
    )]
    UnknownExtension {
        /// The requested path.
        path: PathBuf,
    },
    /// The library was built without the feature that reads the format.
    #[error(
        "{format}: tesdf was built without the feature `{}`; build it with it, or convert the mesh to PLY",
        format.feature()
    )]
    NotBuilt {
        /// The requested format.
        format: MeshFormat,
    },
    /// The format is read from files alone.
    #[error("{format}: it is read by the program Gmsh, from a file; write the bytes to a file and read that")]
    FileOnly {
        /// The requested format.
        format: MeshFormat,
    },
    /// Gmsh gave no triangles of a CAD file.
    #[error(transparent)]
    Cad(#[from] CadError),
    /// There are no bytes.
    #[error("the file is empty (0 bytes); expected {format} data: export or copy it again")]
    Empty {
        /// The requested format.
        format: MeshFormat,
    },
    /// The content is of another kind than the extension says.
    #[error("the content is not {format}: it {looks}; {help}")]
    WrongContent {
        /// The requested format.
        format: MeshFormat,
        /// The kind of the content, such as `is a PNG picture`.
        looks: String,
        /// What to do.
        help: &'static str,
    },
    /// The bytes break the format's rules.
    #[error("{format}, {place}: {found}; {help}")]
    Malformed {
        /// The format.
        format: MeshFormat,
        /// The place of the fault.
        place: Place,
        /// The content found there.
        found: String,
        /// What was expected, or what to do.
        help: String,
    },
    /// A face uses a vertex that the file does not have.
    #[error(
        "{format}, {place}: face {face} (0-based) uses vertex {index}, but the file has {vertices} \
         vertices ({base} to {last}); is the file cut short, or joined from several?",
        last = (vertices + base).saturating_sub(1)
    )]
    IndexOutOfRange {
        /// The format.
        format: MeshFormat,
        /// The place of the face.
        place: Place,
        /// Polygon of the file, 0-based.
        face: usize,
        /// The index, counted from `base`.
        index: u64,
        /// Number of vertices in the file.
        vertices: u64,
        /// First vertex number of the format: 1 for OBJ, otherwise 0.
        base: u64,
    },
    /// A vertex that a face uses has a coordinate that is NaN or infinite.
    #[error(
        "{format}, {place}: vertex {vertex} ({base}-based) has {axis} = {value} and face {face} (0-based) \
         uses it; coordinates must be finite: mend the vertex or export again"
    )]
    NonFinite {
        /// The format.
        format: MeshFormat,
        /// The place of the vertex.
        place: Place,
        /// Vertex of the file, counted from `base`.
        vertex: u64,
        /// First vertex number of the format: 1 for OBJ, otherwise 0.
        base: u64,
        /// The first polygon that uses the vertex, 0-based.
        face: usize,
        /// `x`, `y` or `z`.
        axis: char,
        /// The value found.
        value: f64,
    },
    /// The file has no face.
    #[error(
        "{format}: the file has {vertices} vertices and no face; expected a surface mesh: export it with faces"
    )]
    NoFaces {
        /// The format.
        format: MeshFormat,
        /// Number of vertices found.
        vertices: usize,
    },
    /// The mesh has more vertices or faces than ids can name.
    #[error(transparent)]
    Mesh(#[from] MeshError),
}

impl ReadError {
    /// The message, with the name of the file in front unless the error already names it.
    pub fn in_file(&self, path: &Path) -> String {
        match self {
            Self::Open { .. } | Self::UnknownExtension { .. } => self.to_string(),
            _ => format!("{}: {self}", path.display()),
        }
    }
}
