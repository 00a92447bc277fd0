//! Writes a [`TriangleMesh`] to a file. PLY and OBJ keep every bit; STL rounds to f32.
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use super::TriangleMesh;
use crate::save::{SaveError, save_atomic};

/// A mesh file format that can be written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum WriteFormat {
    /// Binary little-endian PLY with `double` coordinates. Keeps every bit.
    Ply,
    /// OBJ with the shortest decimals that read back as the same f64. Keeps every bit.
    Obj,
    /// Binary STL. Coordinates are rounded to f32, and vertices are no longer shared.
    Stl,
}

impl WriteFormat {
    /// The format that the extension of `path` names, in upper or lower case.
    ///
    /// # Errors
    /// [`WriteError::UnknownExtension`] lists the known extensions.
    pub fn of_path(path: impl AsRef<Path>) -> Result<Self, WriteError> {
        let path = path.as_ref();
        let extension = path.extension().unwrap_or_default().to_ascii_lowercase();
        match extension.to_str() {
            Some("ply") => Ok(Self::Ply),
            Some("obj") => Ok(Self::Obj),
            Some("stl") => Ok(Self::Stl),
            _ => Err(WriteError::UnknownExtension { path: path.to_owned() }),
        }
    }

    /// Whether reading the file gives the same coordinates, bit for bit. STL does not: rounding to
    /// f32 moves vertices by up to 6e-8 of their coordinates.
    pub fn is_exact(self) -> bool {
        self != Self::Stl
    }
}

/// Why a mesh was not written. The file at the path is then unchanged.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum WriteError {
    /// The extension names no format that can be written.
    #[error("{}: the extension names no mesh format that can be written; expected one of .ply, .obj, .stl", path.display())]
    UnknownExtension {
        /// The path asked for.
        path: PathBuf,
    },
    /// A coordinate is too large for f32, so STL cannot hold it.
    #[error(
        "vertex {vertex} (0-based) has the coordinate {value}, beyond the 3.4e38 of STL's f32; write .ply or .obj"
    )]
    BeyondF32 {
        /// Vertex, 0-based.
        vertex: usize,
        /// The coordinate.
        value: f64,
    },
    /// The file cannot be written.
    #[error(transparent)]
    Save(#[from] SaveError),
}

/// Writes `mesh` to `path`. The extension names the format (`.ply`, `.obj`, `.stl`), which is
/// returned.
///
/// # Errors
/// [`WriteError`]. A regular file at `path` is then unchanged.
pub fn write(path: impl AsRef<Path>, mesh: &TriangleMesh) -> Result<WriteFormat, WriteError> {
    let path = path.as_ref();
    let format = WriteFormat::of_path(path)?;
    save_atomic(path, &write_bytes(mesh, format)?)?;
    Ok(format)
}

/// The bytes of a mesh file in the given format.
///
/// # Errors
/// [`WriteError::BeyondF32`].
pub fn write_bytes(mesh: &TriangleMesh, format: WriteFormat) -> Result<Vec<u8>, WriteError> {
    match format {
        WriteFormat::Ply => Ok(ply(mesh)),
        WriteFormat::Obj => Ok(obj(mesh)),
        WriteFormat::Stl => stl(mesh),
    }
}

fn ply(mesh: &TriangleMesh) -> Vec<u8> {
    let mut out = format!(
        "ply\nformat binary_little_endian 1.0\nelement vertex {}\nproperty double x\nproperty double y\n\
         property double z\nelement face {}\nproperty list uchar uint vertex_indices\nend_header\n",
        mesh.vertices().len(),
        mesh.faces().len()
    )
    .into_bytes();
    for value in mesh.vertices().iter().flat_map(|p| p.to_array()) {
        out.extend(value.to_le_bytes());
    }
    for face in mesh.faces() {
        out.push(3);
        face.iter().for_each(|v| out.extend(v.to_le_bytes()));
    }
    out
}

fn obj(mesh: &TriangleMesh) -> Vec<u8> {
    let mut out = String::new();
    for p in mesh.vertices() {
        // Debug gives the shortest decimal that reads back as the same f64. It uses exponents where
        // Display would print hundreds of zeros. Writing to a String cannot fail.
        let _ = writeln!(out, "v {:?} {:?} {:?}", p.x, p.y, p.z);
    }
    for [a, b, c] in mesh.faces() {
        let _ = writeln!(out, "f {} {} {}", a + 1, b + 1, c + 1);
    }
    out.into_bytes()
}

fn stl(mesh: &TriangleMesh) -> Result<Vec<u8>, WriteError> {
    for (vertex, p) in mesh.vertices().iter().enumerate() {
        if let Some(value) = p.to_array().into_iter().find(|v| !(*v as f32).is_finite()) {
            return Err(WriteError::BeyondF32 { vertex, value });
        }
    }
    let mut out = vec![0; 80];
    // The header must not begin with `solid`: ASCII files begin that way.
    out[..20].copy_from_slice(b"binary STL by tesdf ");
    out.extend((mesh.faces().len() as u32).to_le_bytes());
    for face in 0..mesh.faces().len() {
        let [a, b, c] = mesh.triangle(face);
        let normal = (b - a).cross(c - a).normalize_or_zero();
        for value in [normal, a, b, c].iter().flat_map(|p| p.to_array()) {
            out.extend((value as f32).to_le_bytes());
        }
        out.extend([0, 0]);
    }
    Ok(out)
}
