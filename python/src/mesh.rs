//! Meshes from files, arrays or objects with `vertices` and `faces`; `check` and `repair`.
use std::path::PathBuf;

use pyo3::prelude::*;
use pyo3::types::{PyString, PyTuple};
use serde::Serialize;
use tesdf::asset::about::Source;
use tesdf::base::Inside;
use tesdf::mesh::{
    RepairMode, RepairOptions, RepairReport, ShellOrientation, SolidMesh, TriangleMesh, closing_tolerance,
    read, source_blake3,
};

use crate::arrays::{self, Rows};
use crate::errors::{Error, argument, kind_of};
use crate::{classes, pool};

/// Extensions of USD files.
const USD: [&str; 4] = ["usd", "usda", "usdc", "usdz"];

/// A mesh argument.
pub enum MeshInput {
    /// A file, which is read when the mesh is needed.
    File(PathBuf),
    Arrays(TriangleMesh),
    /// A USD file, which the package's Python has read.
    Usd(Box<Loaded>),
}

/// A mesh, and its file if it has one.
pub struct Loaded {
    pub mesh: TriangleMesh,
    pub path: Option<PathBuf>,
    pub source: Source,
    pub notes: Vec<String>,
    /// Name of the unit of the file.
    pub unit: Option<String>,
}

impl MeshInput {
    /// Converts a path, a mesh of another package, or a pair (vertices, faces).
    ///
    /// # Errors
    /// `TypeError` or `ValueError` with what was found; `MeshError` with the face or vertex at
    /// fault.
    pub fn new(any: &Bound<'_, PyAny>) -> PyResult<Self> {
        if is_path(any)? {
            let path: PathBuf = any.extract()?;
            let extension = path.extension().unwrap_or_default().to_string_lossy().to_lowercase();
            if USD.contains(&extension.as_str()) {
                return Self::of_usd(any, path);
            }
            return Ok(Self::File(path));
        }
        let [vertices, faces] = match arrays_of(any)? {
            Some(arrays) => arrays,
            None => any.extract::<[Bound<'_, PyAny>; 2]>().map_err(|_| {
                let expected = "a path, a pair (vertices, faces), or a mesh of trimesh, Open3D or pyvista";
                argument("mesh", kind_of(any), expected)
            })?,
        };
        let vertices = Rows::new("vertices", &vertices)?.as_slice()?.to_vec();
        let faces = corner_ids(&faces)?;
        TriangleMesh::new(vertices, faces).map(Self::Arrays).map_err(|e| Error::Mesh(e).raise(any.py()))
    }

    /// Reads a USD file by `tesdf.usd`.
    fn of_usd(any: &Bound<'_, PyAny>, path: PathBuf) -> PyResult<Self> {
        let py = any.py();
        let found = py.import("tesdf.usd")?.call_method1("read_usd", (any,))?;
        let (vertices, faces) = (found.getattr("vertices")?, found.getattr("faces")?);
        let vertices = Rows::new("vertices", &vertices)?.as_slice()?.to_vec();
        let mesh = TriangleMesh::new(vertices, corner_ids(&faces)?);
        let mesh = mesh.map_err(|e| Error::Mesh(e).raise(py))?;
        let blake3 = source_blake3(&path).map_err(|e| Error::Read(path.clone(), e).raise(py))?;
        Ok(Self::Usd(Box::new(Loaded {
            mesh,
            source: Source::of_file(&path, blake3),
            path: Some(path),
            notes: found.getattr("notes")?.extract()?,
            unit: found.getattr("unit")?.extract()?,
        })))
    }

    /// Reads the file, if the mesh is in a file.
    pub fn load(self) -> Result<Loaded, Error> {
        match self {
            Self::Arrays(mesh) => {
                Ok(Loaded { mesh, path: None, source: Source::default(), notes: Vec::new(), unit: None })
            }
            Self::Usd(loaded) => Ok(*loaded),
            Self::File(path) => match read(&path) {
                Err(e) => Err(Error::Read(path, e)),
                Ok(loaded) => {
                    let source = Source::of_file(&path, loaded.report.source_blake3);
                    let (notes, unit) = (loaded.report.notes, loaded.report.unit);
                    Ok(Loaded { mesh: loaded.mesh, path: Some(path), source, notes, unit })
                }
            },
        }
    }
}

impl Loaded {
    /// Checks that the mesh is a solid under a rule, or makes it one. Returns it with the path and
    /// the source, which says what was changed.
    pub fn solid(
        self,
        inside: Inside,
        repair: RepairMode,
    ) -> Result<(SolidMesh, Option<PathBuf>, Source), Error> {
        match SolidMesh::with_repair(self.mesh, inside, repair) {
            Ok((solid, changes)) => Ok((solid, self.path, self.source.repaired(changes.as_ref()))),
            Err(e) => Err(Error::NotSolid(self.path, e)),
        }
    }
}

/// Whether an argument is a path.
pub fn is_path(any: &Bound<'_, PyAny>) -> PyResult<bool> {
    Ok(any.is_instance_of::<PyString>() || any.hasattr("__fspath__")?)
}

/// Whether an argument that may be of other kinds, too, is to be read as a mesh.
pub fn is_mesh(any: &Bound<'_, PyAny>) -> PyResult<bool> {
    let is_pair = any.cast::<PyTuple>().is_ok_and(|pair| pair.len() == 2);
    Ok(is_pair || is_path(any)? || arrays_of(any)?.is_some())
}

/// The vertices and faces of an object, by the names of trimesh and others, Open3D and pyvista.
fn arrays_of<'py>(any: &Bound<'py, PyAny>) -> PyResult<Option<[Bound<'py, PyAny>; 2]>> {
    let both = |of: &Bound<'py, PyAny>, vertices, faces| match of.hasattr(vertices)? && of.hasattr(faces)? {
        true => Ok(Some([of.getattr(vertices)?, of.getattr(faces)?])),
        false => PyResult::Ok(None),
    };
    for faces in ["faces", "triangles"] {
        if let Some(arrays) = both(any, "vertices", faces)? {
            return Ok(Some(arrays));
        }
    }
    // Meshes of Open3D's tensors.
    if let Some([vertex, triangle]) = both(any, "vertex", "triangle")? {
        return Ok(Some([vertex.getattr("positions")?, triangle.getattr("indices")?]));
    }
    if any.hasattr("points")? && any.hasattr("triangulate")? {
        return both(&any.call_method0("triangulate")?, "points", "regular_faces");
    }
    Ok(None)
}

/// Converts the vertex ids of faces from an array of shape `[F, 3]` of any integer type.
fn corner_ids(any: &Bound<'_, PyAny>) -> PyResult<Vec<[u32; 3]>> {
    let ids = arrays::integers("faces", any, "shape (F, 3)", |shape| matches!(shape, [_, 3]))?;
    let ids = ids.as_slice()?.as_chunks::<3>().0;
    let corners = |(face, ids): (usize, &[i64; 3])| -> PyResult<[u32; 3]> {
        let mut corners = [0; 3];
        for (corner, &id) in corners.iter_mut().zip(ids) {
            *corner = u32::try_from(id).map_err(|_| {
                argument("faces", format!("face {face} uses vertex {id}"), "ids from 0 to 2^32 - 1 (0-based)")
            })?;
        }
        Ok(corners)
    };
    ids.iter().enumerate().map(corners).collect()
}

/// Fields of `tesdf.RepairReport`.
#[derive(Serialize)]
struct Mended<'a> {
    #[serde(flatten)]
    report: &'a RepairReport,
    notes: &'a [String],
    text: String,
}

/// Checks a mesh for defects: those that prevent a well-defined inside, and those that may be
/// unintended.
///
/// mesh: a path (STL, OBJ, PLY, OFF, glTF, GLB, 3MF; STEP, IGES, BREP with Gmsh; USD with
/// usd-core), a pair (vertices [V, 3], faces [F, 3]), or a mesh of trimesh, Open3D or pyvista.
///
/// Raises OSError or MeshError if the mesh cannot be read. Defects are in the report and raise
/// nothing.
#[pyfunction]
pub fn check<'py>(py: Python<'py>, mesh: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyAny>> {
    let input = MeshInput::new(mesh)?;
    let found = py.detach(|| {
        let loaded = input.load()?;
        let report = pool::shared()?.install(|| tesdf::mesh::check(&loaded.mesh));
        Ok((report, loaded.notes))
    });
    let (report, notes) = found.map_err(|e: Error| e.raise(py))?;
    classes::report(py, "CheckReport", &classes::Checked::of(&report, &notes))
}

/// A weld tolerance: a length, or "auto".
enum Weld {
    Within(Option<f64>),
    Auto,
}

fn weld(any: Option<&Bound<'_, PyAny>>) -> PyResult<Weld> {
    let Some(any) = any else { return Ok(Weld::Within(None)) };
    if let Ok(text) = any.cast::<PyString>() {
        return match &*text.to_cow()? {
            "auto" => Ok(Weld::Auto),
            text => Err(argument("weld_tolerance", format!("'{text}'"), "a length, None or 'auto'")),
        };
    }
    any.extract().map(|length| Weld::Within(Some(length)))
}

/// The largest number of edges of a hole that is filled: `True` stands for all holes.
fn largest_hole(any: Option<&Bound<'_, PyAny>>) -> PyResult<Option<u32>> {
    let Some(any) = any else { return Ok(None) };
    if let Ok(all) = any.extract::<bool>() {
        return Ok(all.then_some(u32::MAX));
    }
    match any.extract::<u32>() {
        Ok(edges) if edges >= 3 => Ok(Some(edges)),
        _ => {
            Err(argument("fill_holes", any.str()?.to_string(), "True, False or a number of edges, 3 or more"))
        }
    }
}

/// Makes a mesh encodable, and reports every change. Without keywords, it changes a mesh only where
/// the repair is unique.
///
/// mesh: as for check. weld_tolerance: maximum distance of vertices that are merged, in the mesh's
/// unit; "auto" is the smallest of 1e-7 to 1e-4 of the diagonal that closes the cracks; None merges
/// none. orient: turns all closed shells outward, or inward if they are cavities, also shells that
/// meet others. fill_holes: True fills all holes with triangles between their vertices, a number
/// only holes with at most this number of edges.
///
/// Returns Repaired(vertices, faces, report). A mesh that cannot be encoded after the repair is not
/// an error: the report gives the reason. Raises OSError or MeshError if the mesh cannot be read or
/// no face remains.
#[pyfunction]
#[pyo3(signature = (mesh, *, weld_tolerance = None, orient = false, fill_holes = None))]
pub fn repair<'py>(
    py: Python<'py>,
    mesh: &Bound<'py, PyAny>,
    weld_tolerance: Option<&Bound<'py, PyAny>>,
    orient: bool,
    fill_holes: Option<&Bound<'py, PyAny>>,
) -> PyResult<Bound<'py, PyAny>> {
    let input = MeshInput::new(mesh)?;
    let (weld, fill_holes) = (weld(weld_tolerance)?, largest_hole(fill_holes)?);
    let shells = if orient { ShellOrientation::All } else { ShellOrientation::Separate };
    let found = py.detach(|| {
        let Loaded { mesh, path, notes, .. } = input.load()?;
        let repaired = pool::shared()?.install(|| {
            let weld_tolerance = match weld {
                Weld::Within(length) => length,
                Weld::Auto => closing_tolerance(&mesh),
            };
            let options = RepairOptions { weld_tolerance, shells, fill_holes, ..RepairOptions::DEFAULT };
            tesdf::mesh::repair(&mesh, &options)
        });
        Ok((repaired.map_err(|e| Error::Repair(path, e))?, notes))
    });
    let (repaired, notes) = found.map_err(|e: Error| e.raise(py))?;
    let text = repaired.report.to_string();
    let report =
        classes::report(py, "RepairReport", &Mended { report: &repaired.report, notes: &notes, text })?;
    let vertices = arrays::of_rows(py, repaired.mesh.vertices())?;
    classes::repaired(py)?.call1((vertices, arrays::of_faces(py, repaired.mesh.faces())?, report))
}
