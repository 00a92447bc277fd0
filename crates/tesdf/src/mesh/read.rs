//! Reads mesh files into a [`TriangleMesh`]: STL, OBJ, PLY, OFF, glTF, GLB and 3MF, and by the
//! program Gmsh STEP, IGES and BREP.
//!
//! Each format has a parser that turns bytes into polygons with a place (line, byte, accessor) for
//! each vertex and face. The steps after that are common: index check, finiteness, welding,
//! triangulation. Memory is allocated only for bytes that are present, never by a count in a
//! header.
//!
//! `docs/architecture.md` says why the parsers are our own.
mod assemble;
mod cad;
mod error;
#[cfg(feature = "gltf")]
mod gltf;
mod obj;
mod off;
mod place;
mod ply;
mod sniff;
mod stl;
pub(crate) mod text;
#[cfg(feature = "threemf")]
mod threemf;

use std::ops::Range;
use std::path::{Path, PathBuf};

use serde::Serialize;

use super::TriangleMesh;
use crate::input;
use assemble::{Places, RawMesh, assemble};
pub use cad::{CadError, CadOptions};
pub use error::ReadError;
pub use place::Place;

/// A mesh file format that can be read.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
#[non_exhaustive]
pub enum MeshFormat {
    /// Stereolithography, binary or ASCII (told apart by content).
    Stl,
    /// Wavefront OBJ.
    Obj,
    /// Polygon file format, ASCII or binary of either byte order.
    Ply,
    /// Object file format of Geomview, ASCII.
    Off,
    /// glTF 2.0 as JSON.
    Gltf,
    /// glTF 2.0 as one binary file.
    Glb,
    /// 3D Manufacturing Format.
    #[serde(rename = "3mf")]
    ThreeMf,
    /// STEP (ISO 10303-21), by the program Gmsh.
    Step,
    /// IGES, by the program Gmsh.
    Iges,
    /// The native format of OpenCASCADE, by the program Gmsh.
    Brep,
}

impl MeshFormat {
    /// All formats, in the order of messages.
    pub const ALL: [Self; 10] = [
        Self::Stl,
        Self::Obj,
        Self::Ply,
        Self::Off,
        Self::Gltf,
        Self::Glb,
        Self::ThreeMf,
        Self::Step,
        Self::Iges,
        Self::Brep,
    ];

    /// The format that the extension of `path` names, in upper or lower case.
    ///
    /// # Errors
    /// [`ReadError::UnknownExtension`] lists the known extensions.
    pub fn of_path(path: impl AsRef<Path>) -> Result<Self, ReadError> {
        let path = path.as_ref();
        let extension = path.extension().unwrap_or_default().to_string_lossy();
        Self::ALL
            .into_iter()
            .find(|f| f.extensions().iter().any(|known| known.eq_ignore_ascii_case(&extension)))
            .ok_or_else(|| ReadError::UnknownExtension { path: path.to_owned() })
    }

    /// The file extension, without the dot.
    pub fn extension(self) -> &'static str {
        self.extensions()[0]
    }

    /// All extensions that stand for the format.
    fn extensions(self) -> &'static [&'static str] {
        match self {
            Self::Stl => &["stl"],
            Self::Obj => &["obj"],
            Self::Ply => &["ply"],
            Self::Off => &["off"],
            Self::Gltf => &["gltf"],
            Self::Glb => &["glb"],
            Self::ThreeMf => &["3mf"],
            Self::Step => &["step", "stp"],
            Self::Iges => &["iges", "igs"],
            Self::Brep => &["brep"],
        }
    }

    /// Whether the file has curved surfaces, of which Gmsh makes triangles ([`CadOptions`]).
    pub fn is_cad(self) -> bool {
        matches!(self, Self::Step | Self::Iges | Self::Brep)
    }

    /// The feature of the library that reads the format. All others are always read.
    fn feature(self) -> &'static str {
        match self {
            Self::Step | Self::Iges | Self::Brep => "gmsh",
            Self::ThreeMf => "threemf",
            _ => "gltf",
        }
    }
}

impl std::fmt::Display for MeshFormat {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Stl => "STL",
            Self::Obj => "OBJ",
            Self::Ply => "PLY",
            Self::Off => "OFF",
            Self::Gltf => "glTF",
            Self::Glb => "GLB",
            Self::ThreeMf => "3MF",
            Self::Step => "STEP",
            Self::Iges => "IGES",
            Self::Brep => "BREP",
        })
    }
}

/// A mesh read from a file, with a report of the changes made while reading.
#[derive(Clone, Debug)]
pub struct LoadedMesh {
    /// The mesh. Faces are in file order, and each polygon is replaced by its triangles.
    pub mesh: TriangleMesh,
    /// Statistics and changes.
    pub report: LoadReport,
    /// The objects that the file has: of OBJ those of `o`, or else the groups of `g`; of ASCII STL
    /// each `solid`; of glTF each node with a mesh; of 3MF each mesh that a build item shows; of
    /// STEP, IGES and BREP each solid. Empty for other formats.
    pub parts: Vec<MeshPart>,
    /// For each vertex and face of the mesh, its source in the file.
    pub origin: Origin,
}

/// An object of a mesh file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct MeshPart {
    /// Its name in the file. It may be empty, and others may have the same one.
    pub name: String,
    /// Its faces in [`LoadedMesh::mesh`], ascending.
    pub faces: Vec<Range<usize>>,
}

/// The sources in the file of the vertices and faces of a [`LoadedMesh`].
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Origin {
    /// For each vertex of the mesh, the first vertex of the file at its position, 0-based.
    pub vertices: Vec<u32>,
    /// For each face of the mesh, its polygon in the file, 0-based.
    pub faces: Vec<u32>,
}

/// Statistics of a file and changes made while reading. `vertices_in_file` is the number of
/// vertices of the mesh plus `welded_vertices` plus `unused_vertices`.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct LoadReport {
    /// The file's format.
    pub format: MeshFormat,
    /// Vertices in the file. An STL file has three for each facet.
    pub vertices_in_file: usize,
    /// Polygons in the file.
    pub faces_in_file: usize,
    /// Polygons of more than three corners, which are split into triangles.
    pub triangulated_polygons: usize,
    /// Polygons among these that are not convex.
    pub concave_polygons: usize,
    /// Used vertices that are merged into an earlier vertex with bitwise the same position; of an STL
    /// file also those that rounding to its 32-bit numbers moved apart, if the mesh is closed so.
    pub welded_vertices: usize,
    /// Vertices that are dropped because no face uses them.
    pub unused_vertices: usize,
    /// Name of the unit of length: of a 3MF file its own, of glTF `m`, of STEP and IGES `mm`, to
    /// which they are converted. `None` for other formats, which have no unit.
    pub unit: Option<String>,
    /// Notes for people, one sentence each.
    pub notes: Vec<String>,
    /// BLAKE3 of the file's bytes (and of external glTF buffers, in order), in hexadecimal.
    pub source_blake3: String,
}

/// Reads the mesh file at `path`. The extension names the format.
///
/// # Errors
/// [`ReadError`] names the cause, the line, byte or element, and what to do.
///
/// # Example
///
/// ```
/// use tesdf::mesh::read;
///
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
/// # let folder = tempfile::tempdir()?;
/// # let path = folder.path().join("part.obj");
/// # std::fs::write(&path, "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n")?;
/// let loaded = read(&path)?;
/// assert_eq!(loaded.mesh.faces().len(), 4);
/// assert_eq!(loaded.report.welded_vertices, 0);
/// # Ok(())
/// # }
/// ```
pub fn read(path: impl AsRef<Path>) -> Result<LoadedMesh, ReadError> {
    read_with(path, &CadOptions::default())
}

/// The same as [`read`], with options for files of CAD formats ([`MeshFormat::is_cad`]). Other
/// files are read without them.
///
/// # Errors
/// The same as for [`read`].
pub fn read_with(path: impl AsRef<Path>, cad: &CadOptions) -> Result<LoadedMesh, ReadError> {
    read_path(path.as_ref(), cad)
}

fn read_path(path: &Path, cad: &CadOptions) -> Result<LoadedMesh, ReadError> {
    let format = MeshFormat::of_path(path).map_err(|unknown| match std::fs::metadata(path) {
        Ok(_) => unknown,
        Err(source) => ReadError::Open { path: path.to_owned(), source },
    })?;
    let bytes = input::read(path).map_err(|source| ReadError::Open { path: path.to_owned(), source })?;
    let folder = path.parent().unwrap_or(Path::new(""));
    parse(&bytes, format, From { folder: Some(folder), cad: Some(cad) })
}

/// The files that [`read`] opens for `path`: the file itself and the external buffers of a glTF
/// file. For a file that cannot be read, only `path`; [`read`] then gives the reason.
pub fn files(path: impl AsRef<Path>) -> Vec<PathBuf> {
    files_of(path.as_ref())
}

fn files_of(path: &Path) -> Vec<PathBuf> {
    let buffers = match MeshFormat::of_path(path) {
        // A pipe is not opened here, because its bytes can be read only once.
        #[cfg(feature = "gltf")]
        Ok(format @ (MeshFormat::Gltf | MeshFormat::Glb)) if path.is_file() => {
            let bytes = std::fs::read(path).unwrap_or_default();
            gltf::external_files(&bytes, format, path.parent().unwrap_or(Path::new("")))
        }
        _ => Vec::new(),
    };
    std::iter::once(path.to_path_buf()).chain(buffers).collect()
}

/// BLAKE3, in hexadecimal, of the bytes of all [`files`] that [`read`] opens for `path`:
/// [`LoadReport::source_blake3`], without the time that reading a mesh takes.
///
/// # Errors
/// [`ReadError::Open`]: one of the files cannot be read.
///
/// # Example
///
/// ```
/// use tesdf::mesh;
///
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
/// # let folder = tempfile::tempdir()?;
/// # let path = folder.path().join("part.obj");
/// # std::fs::write(&path, "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n")?;
/// assert_eq!(mesh::source_blake3(&path)?, mesh::read(&path)?.report.source_blake3);
/// # Ok(())
/// # }
/// ```
pub fn source_blake3(path: impl AsRef<Path>) -> Result<String, ReadError> {
    let mut hasher = blake3::Hasher::new();
    for (k, path) in files_of(path.as_ref()).into_iter().enumerate() {
        // The file names the others.
        let allowed = if k == 0 { Ok(()) } else { input::check_regular(&path) };
        let bytes = allowed.and_then(|()| input::read(&path));
        let bytes = bytes.map_err(|source| ReadError::Open { path, source })?;
        hasher.update(&bytes);
    }
    Ok(hasher.finalize().to_hex().to_string())
}

/// Reads a mesh from bytes in memory. The buffers of a glTF file must be in these bytes too.
///
/// # Errors
/// The same as for [`read`], and [`ReadError::FileOnly`]: Gmsh runs for files alone.
pub fn read_bytes(bytes: &[u8], format: MeshFormat) -> Result<LoadedMesh, ReadError> {
    parse(bytes, format, From { folder: None, cad: None })
}

/// Where the bytes come from.
struct From<'a> {
    /// The folder of the file.
    folder: Option<&'a Path>,
    cad: Option<&'a CadOptions>,
}

fn parse(bytes: &[u8], format: MeshFormat, from: From<'_>) -> Result<LoadedMesh, ReadError> {
    if bytes.is_empty() {
        return Err(ReadError::Empty { format });
    }
    let mut hasher = blake3::Hasher::new();
    hasher.update(bytes);
    let raw = match format {
        MeshFormat::Stl => stl::parse(bytes),
        MeshFormat::Obj => obj::parse(bytes),
        MeshFormat::Ply => ply::parse(bytes),
        MeshFormat::Off => off::parse(bytes),
        #[cfg(feature = "gltf")]
        MeshFormat::Gltf | MeshFormat::Glb => gltf::parse(bytes, format, from.folder, &mut hasher),
        #[cfg(feature = "threemf")]
        MeshFormat::ThreeMf => threemf::parse(bytes),
        MeshFormat::Step | MeshFormat::Iges | MeshFormat::Brep => match from.cad {
            #[cfg(feature = "gmsh")]
            Some(options) => cad::parse(bytes, format, options),
            #[cfg(not(feature = "gmsh"))]
            Some(_) => Err(ReadError::NotBuilt { format }),
            None => Err(ReadError::FileOnly { format }),
        },
        #[cfg(not(all(feature = "gltf", feature = "threemf")))]
        format => Err(ReadError::NotBuilt { format }),
    }?;
    assemble(raw, format, hasher.finalize().to_hex().to_string())
}
