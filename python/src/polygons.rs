//! `tesdf._native.polygons`: a mesh of polygons, for readers that are written in Python.
use pyo3::prelude::*;
use pyo3::types::PyTuple;
use tesdf::mesh::{MeshFormat, read_bytes};

use crate::arrays::{self, Rows};
use crate::errors::{Error, argument};

/// Welds equal points and splits polygons into triangles, as reading a file does.
///
/// - points: [N, 3].
/// - counts: number of corners of each polygon.
/// - corners: ids of the points of all polygons.
///
/// Returns (vertices [V, 3], faces [F, 3], notes). Raises MeshError if an id or a point is wrong.
#[pyfunction]
pub fn polygons<'py>(
    py: Python<'py>,
    points: &Bound<'py, PyAny>,
    counts: &Bound<'py, PyAny>,
    corners: &Bound<'py, PyAny>,
) -> PyResult<Bound<'py, PyTuple>> {
    let points = Rows::new("points", points)?;
    let points = points.as_slice()?;
    let is_list = |shape: &[usize]| shape.len() == 1;
    let counts = arrays::integers("counts", counts, "shape (F,)", is_list)?;
    let corners = arrays::integers("corners", corners, "shape (C,)", is_list)?;
    // The readers of the library take files, and a file in memory is one, too.
    let mut ply = format!(
        "ply\nformat binary_little_endian 1.0\nelement vertex {}\nproperty double x\nproperty double y\nproperty double z\n\
         element face {}\nproperty list uint uint vertex_indices\nend_header\n",
        points.len(),
        counts.as_slice()?.len()
    )
    .into_bytes();
    points.iter().flat_map(|p| p.to_array()).for_each(|x| ply.extend(x.to_le_bytes()));
    let id = |value: i64| {
        u32::try_from(value).map_err(|_| argument("corners", format!("{value}"), "ids from 0 to 2^32 - 1"))
    };
    let mut rest = corners.as_slice()?;
    for (polygon, &count) in counts.as_slice()?.iter().enumerate() {
        let own = usize::try_from(count).ok().and_then(|count| rest.split_at_checked(count));
        let Some((own, after)) = own else {
            let found = format!("polygon {polygon} with {count} corners, and {} corners left", rest.len());
            return Err(argument("counts", found, "as many corners as there are"));
        };
        rest = after;
        ply.extend(id(count)?.to_le_bytes());
        for &corner in own {
            ply.extend(id(corner)?.to_le_bytes());
        }
    }
    let loaded =
        read_bytes(&ply, MeshFormat::Ply).map_err(|e| Error::Read("polygons".into(), e).raise(py))?;
    let vertices = arrays::of_rows(py, loaded.mesh.vertices())?;
    let faces = arrays::of_faces(py, loaded.mesh.faces())?;
    (vertices, faces, PyTuple::new(py, loaded.report.notes)?).into_pyobject(py)
}
