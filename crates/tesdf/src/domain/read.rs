//! Files of tetrahedra to [`TetMesh`]: Gmsh, TetGen, VTK's XML.
//!
//! Only tetrahedra of four vertices are taken. Points, lines and surface elements are skipped and counted; other
//! volumes are an error. Nothing is allocated by a count in a header, only by bytes that are there.
//!
//! The parsers are our own. `mshio` 0.4.2 reads MSH 4.1 only, its last release is of 2020, and its errors are positions of
//! a parser's input; `vtkio` 0.6.3 (0.7 is a release candidate) gives errors without a place. XML is parsed by
//! `roxmltree`, zlib by `flate2`.
use std::path::{Path, PathBuf};

use glam::DVec3;
use serde::Serialize;

mod cursor;
mod error;
mod gmsh;
mod tetgen;
mod vtu;

use super::TetMesh;
pub use error::ReadTetrahedraError;
use error::malformed;

/// A format of tetrahedra that can be read.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum TetFormat {
    /// Gmsh's MSH 2.2 and 4.1, ASCII and binary.
    Msh,
    /// TetGen's vertices; the tetrahedra are in the `.ele` beside it.
    Node,
    /// TetGen's tetrahedra; the vertices are in the `.node` beside it.
    Ele,
    /// VTK's unstructured grid as XML: ASCII, base64 inline or appended, raw appended; zlib or not compressed.
    Vtu,
}

impl TetFormat {
    /// All formats, in the order in which messages list them.
    pub const ALL: [Self; 4] = [Self::Msh, Self::Node, Self::Ele, Self::Vtu];

    /// The format that a file's extension names, in upper or lower case.
    ///
    /// # Errors
    /// [`ReadTetrahedraError::UnknownExtension`] lists the extensions there are.
    pub fn of_path(path: &Path) -> Result<Self, ReadTetrahedraError> {
        let extension = path.extension().unwrap_or_default().to_string_lossy();
        Self::ALL
            .into_iter()
            .find(|f| f.extension().eq_ignore_ascii_case(&extension))
            .ok_or_else(|| ReadTetrahedraError::UnknownExtension { path: path.to_owned() })
    }

    /// The file extension, without the dot.
    pub fn extension(self) -> &'static str {
        match self {
            Self::Msh => "msh",
            Self::Node => "node",
            Self::Ele => "ele",
            Self::Vtu => "vtu",
        }
    }
}

impl std::fmt::Display for TetFormat {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Msh => "Gmsh MSH",
            Self::Node => "TetGen .node",
            Self::Ele => "TetGen .ele",
            Self::Vtu => "VTU",
        })
    }
}

/// Elements that were skipped because they have no volume.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Skipped {
    /// Points.
    pub points: usize,
    /// Lines of any order.
    pub lines: usize,
    /// Triangles, quadrangles and polygons of any order.
    pub surfaces: usize,
}

/// Tetrahedra that were read, and what reading left out.
#[derive(Clone, Debug, PartialEq)]
pub struct LoadedTetrahedra {
    /// Vertices and tetrahedra in file order, vertices numbered from 0 whatever the file calls them.
    pub mesh: TetMesh,
    /// The format of the file.
    pub format: TetFormat,
    /// What was left out.
    pub skipped: Skipped,
}

/// What a parser gives: corners are ids of `vertices`, checked.
#[derive(Default)]
struct Parsed {
    vertices: Vec<DVec3>,
    tetrahedra: Vec<[u32; 4]>,
    skipped: Skipped,
}

/// Reads a file of tetrahedra; its extension names the format. Of TetGen's pair either path will do.
///
/// # Errors
/// [`ReadTetrahedraError`] names what is at fault, the line, byte or element, and what to do.
pub fn read_tetrahedra(path: &Path) -> Result<TetMesh, ReadTetrahedraError> {
    Ok(load_tetrahedra(path)?.mesh)
}

/// As [`read_tetrahedra`], with a report of what was left out.
///
/// # Errors
/// As [`read_tetrahedra`].
pub fn load_tetrahedra(path: &Path) -> Result<LoadedTetrahedra, ReadTetrahedraError> {
    let format = TetFormat::of_path(path)?;
    let bytes = |path: &Path| {
        std::fs::read(path).map_err(|source| ReadTetrahedraError::Open { path: path.to_owned(), source })
    };
    let parsed = match format {
        TetFormat::Msh => gmsh::parse(&bytes(path)?),
        TetFormat::Vtu => vtu::parse(&bytes(path)?),
        TetFormat::Node => tetgen::parse(&bytes(path)?, &bytes(&beside(path, TetFormat::Ele))?),
        TetFormat::Ele => tetgen::parse(&bytes(&beside(path, TetFormat::Node))?, &bytes(path)?),
    }?;
    let mesh = TetMesh::new(parsed.vertices, parsed.tetrahedra)
        .map_err(|source| ReadTetrahedraError::Mesh { format, source })?;
    Ok(LoadedTetrahedra { mesh, format, skipped: parsed.skipped })
}

/// The other file of a pair, in upper case where the first is.
fn beside(path: &Path, format: TetFormat) -> PathBuf {
    let upper = path.extension().is_some_and(|e| e.to_string_lossy().chars().all(char::is_uppercase));
    let extension = format.extension();
    path.with_extension(if upper { extension.to_uppercase() } else { extension.to_owned() })
}
