//! `tesdf.Asset`
use std::ops::ControlFlow;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use numpy::{PyArray1, PyArray2, PyArrayMethods};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict};
use rayon::prelude::*;
use tesdf::TeSdf;
use tesdf::asset::{Element, layout};
use tesdf::glam::DVec3;
use tesdf::inspect::{InspectOptions, inspect};
use tesdf::query::{Answer, AnswerColumns, BatchError, Extent, Precision};
use tesdf::verify::{VerifyOptions, verify};

use crate::arrays::{self, Points, Rows};
use crate::errors::{Error, argument};
use crate::interrupt::cancellable;
use crate::whole;
use crate::{classes, device, pool};

/// Number of points between two checks for Python's signals: less than a second of work.
const CHUNK: usize = 1 << 19;

/// An encoded mesh with exact signed distances, closest points and gradients. encode makes it, open
/// reads it from a file. It is immutable: methods that move its vertices return another asset.
///
/// All lengths are in the mesh's unit. Points are arrays [N, 3], or one point [3]; contiguous
/// float64 arrays are read in place. Queries run on all cores (RAYON_NUM_THREADS sets the number of
/// threads) and release the interpreter's lock.
#[pyclass(frozen, module = "tesdf")]
pub struct Asset {
    /// Shared with scenes.
    inner: Arc<TeSdf>,
    on_device: device::HeldShapes,
}

impl Asset {
    pub fn new(inner: TeSdf) -> Self {
        Self::of(Arc::new(inner))
    }

    pub fn of(inner: Arc<TeSdf>) -> Self {
        Self { inner, on_device: device::HeldShapes::default() }
    }

    pub fn shared(&self) -> Arc<TeSdf> {
        Arc::clone(&self.inner)
    }

    /// Calls `fill` for chunks of rows without the interpreter's lock. Python handles signals
    /// between the chunks.
    fn in_chunks(
        py: Python<'_>,
        rows: usize,
        mut fill: impl FnMut(std::ops::Range<usize>) -> Result<(), BatchError> + Send,
    ) -> PyResult<()> {
        let pool = pool::shared().map_err(|e| e.raise(py))?;
        for start in (0..rows).step_by(CHUNK) {
            py.detach(|| pool.install(|| fill(start..rows.min(start + CHUNK))))
                .map_err(|e| PyValueError::new_err(e.to_string()))?;
            py.check_signals()?;
        }
        Ok(())
    }

    fn answers<'py>(
        &self,
        points: &Bound<'py, PyAny>,
        precision: &str,
        extent: Extent,
    ) -> PyResult<Bound<'py, PyAny>> {
        let py = points.py();
        let precision = named(precision)?;
        let asked = Points::new(points)?;
        let points = asked.as_slice()?;
        let rows = points.len();
        let distance = PyArray1::<f64>::zeros(py, rows, false);
        let [gradient, closest] = [(); 2].map(|()| PyArray2::<f64>::zeros(py, [rows, 3], false));
        let face = PyArray1::<u32>::zeros(py, rows, false);
        {
            let (mut d, mut g) = (distance.try_readwrite()?, gradient.try_readwrite()?);
            let (mut c, mut f) = (closest.try_readwrite()?, face.try_readwrite()?);
            let (d, f) = (d.as_slice_mut()?, f.as_slice_mut()?);
            let (g, c) = (g.as_slice_mut()?.as_chunks_mut().0, c.as_slice_mut()?.as_chunks_mut().0);
            Self::in_chunks(py, rows, |at| {
                let columns = AnswerColumns {
                    signed_distance: &mut d[at.clone()],
                    gradient: &mut g[at.clone()],
                    closest_point: &mut c[at.clone()],
                    face: &mut f[at.clone()],
                };
                self.inner.query_batch_into(&points[at], precision, extent, columns)
            })?;
        }
        classes::answers(py)?.call1((
            asked.answered(distance)?,
            asked.answered(gradient)?,
            asked.answered(closest)?,
            asked.answered(face)?,
        ))
    }

    fn section<'py>(slf: &Bound<'py, Self>, name: &str) -> PyResult<Bound<'py, PyAny>> {
        Self::sections(slf)?.get_item(name)?.ok_or_else(|| {
            argument("section", format!("'{name}' is not in the asset"), "one of those of `sections`")
        })
    }
}

/// Reads a JSON file of TES-Encoder, the program of the paper's authors: a surface, tetrahedra that
/// conform to it, and their lists.
///
/// The lists stay as they are, and nothing is proved of them: the asset's certificate has no delta.
/// `tesdf verify --prove` proves them, or shows where a list misses a face. Surface and tetrahedra
/// are checked, as encode does.
///
/// Raises OSError if the file cannot be read. Raises MeshError, which names the key and the place in
/// its array, if a value does not fit or the tetrahedra do not conform to the surface, and
/// NotSolidError if the surface has no well-defined inside.
#[pyfunction]
pub fn import_json(py: Python<'_>, path: PathBuf) -> PyResult<Asset> {
    let pool = pool::shared().map_err(|e| e.raise(py))?;
    let imported = py.detach(|| pool.install(|| TeSdf::import_json(&path)));
    imported.map(Asset::new).map_err(|e| Error::ImportJson(path, e).raise(py))
}

fn named(precision: &str) -> PyResult<Precision> {
    match precision {
        "f64" => Ok(Precision::F64),
        "f32" => Ok(Precision::F32),
        _ => Err(argument("precision", format!("'{precision}'"), "'f64' or 'f32'")),
    }
}

#[pymethods]
impl Asset {
    /// Maps the file and checks the structure that queries rely on. verify also reads every byte.
    ///
    /// The file must not be changed in place while the asset exists; replacing it, as save does, is
    /// safe. Raises OSError if the file cannot be read, and AssetError if it is not an asset.
    #[staticmethod]
    pub fn open(py: Python<'_>, path: PathBuf) -> PyResult<Self> {
        let opened = py.detach(|| TeSdf::open(&path));
        opened.map(Self::new).map_err(|e| Error::Asset(Some(path), e).raise(py))
    }

    /// As open, but from the bytes of a file.
    #[staticmethod]
    fn from_bytes(py: Python<'_>, data: &[u8]) -> PyResult<Self> {
        TeSdf::from_bytes(data).map(Self::new).map_err(|e| Error::Asset(None, e).raise(py))
    }

    /// The bytes of the whole file. After move_vertices, call reencode_stale first: the file does
    /// not record which lists are stale.
    fn to_bytes<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyBytes>> {
        let bytes = self.inner.to_bytes().map_err(|e| Error::Asset(None, e).raise(py))?;
        Ok(PyBytes::new(py, &bytes))
    }

    /// Writes the file with the bytes of to_bytes. An existing file is replaced in one step and
    /// keeps its permissions. A read-only file raises PermissionError.
    fn save(&self, py: Python<'_>, path: PathBuf) -> PyResult<()> {
        py.detach(|| self.inner.save(&path)).map_err(|e| Error::Asset(Some(path), e).raise(py))
    }

    /// Writes a JSON file of TES-Encoder, the program of the paper's authors, which import_json reads.
    ///
    /// The asset must have a conforming domain: encode with domain="gmsh" or a file of tetrahedra,
    /// and with plain=True if each tetrahedron should be one cell; otherwise a tetrahedron gets the
    /// faces of all of its cells. Raises EncodeError for the bisection domain, and OSError if the
    /// file cannot be written.
    fn export_json(&self, py: Python<'_>, path: PathBuf) -> PyResult<()> {
        let written = py.detach(|| self.inner.export_json(&path));
        written.map_err(|e| Error::ExportJson(path, e).raise(py))
    }

    /// Signed distance, gradient, closest point and face for each of the points [N, 3]. Of one point
    /// [3], answers have no axis of points; a device takes [N, 3] only.
    ///
    /// With precision "f64" the mesh is used as given, and exact predicates decide the signs. "f32"
    /// is several times faster and exact to 1e-6 of the diagonal. A point that is not finite gets
    /// NaN and NO_FACE.
    ///
    /// device: "cpu", "gpu" (what TESDF_DEVICE names, else the best device), or the number of a
    /// device or a part of its name, such as "cuda:0" (devices lists them). A device computes in
    /// f32, exact to 2e-6 of the diagonal, whatever precision says. It keeps the asset until a
    /// query on another device. Points that are on the device, as a DeviceArray or float32 of
    /// torch, warp or cupy on a CUDA device, are read in place, and the answers stay there:
    /// DeviceAnswers.
    #[pyo3(signature = (points, precision = "f64", *, device = None), text_signature = "($self, points, precision=\"f64\", *, device=\"cpu\")")]
    fn query<'py>(
        &self,
        points: &Bound<'py, PyAny>,
        precision: &str,
        device: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        match device::chosen(device)?.or_else(|| device::of_array(points)) {
            Some(device) => device::query(&self.on_device, &self.inner, points, &device),
            None => self.answers(points, precision, Extent::Everywhere),
        }
    }

    /// As query, but with NaN and NO_FACE for points outside of the encoded domain. The domain ends
    /// at the width of the band from the solid, up to about the size of a cell.
    #[pyo3(signature = (points, precision = "f64"))]
    fn query_in_domain<'py>(
        &self,
        points: &Bound<'py, PyAny>,
        precision: &str,
    ) -> PyResult<Bound<'py, PyAny>> {
        self.answers(points, precision, Extent::Domain)
    }

    /// Only the signed distances [N], negative inside; of one point [3] a number.
    #[pyo3(signature = (points, precision = "f64"))]
    fn signed_distance<'py>(
        &self,
        py: Python<'py>,
        points: &Bound<'py, PyAny>,
        precision: &str,
    ) -> PyResult<Bound<'py, PyAny>> {
        let precision = named(precision)?;
        let asked = Points::new(points)?;
        let points = asked.as_slice()?;
        let found = PyArray1::zeros(py, points.len(), false);
        {
            let mut found = found.try_readwrite()?;
            let found = found.as_slice_mut()?;
            Self::in_chunks(py, points.len(), |at| {
                self.inner.signed_distances_into(&points[at.clone()], precision, &mut found[at])
            })?;
        }
        asked.answered(found)
    }

    /// Whether each of the points [N, 3] is inside, by exact predicates; of one point [3] a truth
    /// value. Points on the surface may count as inside or outside.
    fn is_inside<'py>(&self, py: Python<'py>, points: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyAny>> {
        let asked = Points::new(points)?;
        let points = asked.as_slice()?;
        let found = PyArray1::zeros(py, points.len(), false);
        {
            let mut found = found.try_readwrite()?;
            let found = found.as_slice_mut()?;
            Self::in_chunks(py, points.len(), |at| {
                let inside = |(inside, &p): (&mut bool, &DVec3)| *inside = self.inner.is_inside(p);
                found[at.clone()].par_iter_mut().zip(&points[at]).for_each(inside);
                Ok(())
            })?;
        }
        asked.answered(found)
    }

    /// The first face that each ray meets, from either side: RayHits(t, point, face, normal).
    ///
    /// origins and directions have the shape [N, 3], or [3] for a value that all rays share. t is
    /// in lengths of the direction and at most limit. A ray that meets no face has t = inf, NaN and
    /// NO_FACE.
    #[pyo3(signature = (origins, directions, limit = f64::INFINITY))]
    fn ray_cast<'py>(
        &self,
        py: Python<'py>,
        origins: &Bound<'py, PyAny>,
        directions: &Bound<'py, PyAny>,
        limit: f64,
    ) -> PyResult<Bound<'py, PyAny>> {
        let both = py.import("numpy")?.call_method1("broadcast_arrays", (origins, directions))?;
        let (origins, directions) =
            (Rows::new("origins", &both.get_item(0)?)?, Rows::new("directions", &both.get_item(1)?)?);
        let (origins, directions) = (origins.as_slice()?, directions.as_slice()?);
        let mut hits = vec![None; origins.len()];
        Self::in_chunks(py, origins.len(), |at| {
            let rays = origins[at.clone()].par_iter().zip(&directions[at.clone()]);
            let cast = |(hit, (&origin, &direction)): (&mut Option<_>, (&DVec3, &DVec3))| {
                *hit = self.inner.ray_cast(origin, direction, limit);
            };
            hits[at].par_iter_mut().zip(rays).for_each(cast);
            Ok(())
        })?;
        let t: Vec<f64> = hits.iter().map(|hit| hit.map_or(f64::INFINITY, |hit| hit.t)).collect();
        let point: Vec<DVec3> = hits.iter().map(|hit| hit.map_or(DVec3::NAN, |hit| hit.point)).collect();
        let face: Vec<u32> = hits.iter().map(|hit| hit.map_or(Answer::NO_FACE, |hit| hit.face)).collect();
        let normal: Vec<DVec3> = hits.iter().map(|hit| hit.map_or(DVec3::NAN, |hit| hit.normal)).collect();
        classes::ray_hits(py)?.call1((
            PyArray1::from_vec(py, t),
            arrays::of_rows(py, &point)?,
            PyArray1::from_vec(py, face),
            arrays::of_rows(py, &normal)?,
        ))
    }

    /// The asset with the vertices [N] moved to the positions [N, 3]: Moved(asset, faces,
    /// tetrahedra, inverted). Needs a conforming domain.
    ///
    /// The first ids are the mesh's vertices in their order; those of the domain's own vertices
    /// (sections["domain.vertices"]) follow. Tetrahedra and lists stay the same. Distances are then
    /// distances to the listed faces in their new positions, and nothing is proved about them until
    /// reencode_stale. This asset does not change.
    ///
    /// Raises DeformError in the bisection domain, and for ids and positions that are not valid.
    fn move_vertices<'py>(
        &self,
        vertices: &Bound<'py, PyAny>,
        positions: &Bound<'py, PyAny>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let py = vertices.py();
        let ids = arrays::ids("vertices", vertices)?;
        let positions = Rows::new("positions", positions)?;
        let positions = positions.as_slice()?;
        if ids.len() != positions.len() {
            let found = format!("{} of {} vertices", positions.len(), ids.len());
            return Err(argument("positions", found, "one for each vertex"));
        }
        let moves: Vec<(u32, DVec3)> = ids.into_iter().zip(positions.iter().copied()).collect();
        let moved = py.detach(|| {
            let mut asset = TeSdf::clone(&self.inner);
            asset.move_vertices(&moves).map(|moved| (asset, moved))
        });
        let (asset, moved) = moved.map_err(|e| Error::Deform(e).raise(py))?;
        let inverted = PyArray1::from_vec(py, moved.inverted);
        classes::moved(py)?.call1((Self::new(asset), moved.faces, moved.tetrahedra, inverted))
    }

    /// The stale cells: cells whose lists may be wrong for the current positions of the vertices.
    /// Returns their words in sections["domain.nodes"], ascending.
    fn stale_cells<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray1<u32>>> {
        let pool = pool::shared().map_err(|e| e.raise(py))?;
        let found = py.detach(|| pool.install(|| self.inner.stale_cells()));
        Ok(PyArray1::from_vec(py, found.map_err(|e| Error::Encode(None, e).raise(py))?))
    }

    /// The asset with new lists in its stale cells, by the encoder and options of the asset:
    /// Reencoded(asset, cells, checked, stale). The certificate then holds for the current mesh.
    fn reencode_stale<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let pool = pool::shared().map_err(|e| e.raise(py))?;
        let reencoded = py.detach(|| {
            let mut asset = TeSdf::clone(&self.inner);
            pool.install(|| asset.reencode_stale()).map(|reencoded| (asset, reencoded))
        });
        let (asset, found) = reencoded.map_err(|e| Error::Encode(None, e).raise(py))?;
        let stale = PyArray1::from_vec(py, found.stale);
        classes::reencoded(py)?.call1((Self::new(asset), found.cells, found.checked, stale))
    }

    /// Size and query cost of the asset: counts, list lengths, reads per query, bytes by section,
    /// and for a conforming domain the classes of its vertices and tetrahedra.
    fn inspect<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let pool = pool::shared().map_err(|e| e.raise(py))?;
        let found = py.detach(|| pool.install(|| inspect(&self.inner, &InspectOptions::default())));
        classes::report(py, "Inspection", &found)
    }

    /// Compares every byte with the checksums, then the answers at `samples` points with brute
    /// force over all faces; those of an asset that certifies nothing also at up to four points
    /// inside each of its cells. Ctrl-C ends it with KeyboardInterrupt.
    ///
    /// Raises AssetError if the file is damaged. Wrong answers are in the report.
    #[pyo3(signature = (samples = 10_000))]
    fn verify<'py>(
        &self,
        py: Python<'py>,
        #[pyo3(from_py_with = whole::samples)] samples: u32,
    ) -> PyResult<Bound<'py, PyAny>> {
        let pool = pool::shared().map_err(|e| e.raise(py))?;
        let options = VerifyOptions { samples: samples as usize, ..VerifyOptions::default() };
        let cancelled = AtomicBool::new(false);
        let go_on = |_| match cancelled.load(Ordering::Relaxed) {
            true => ControlFlow::Break(()),
            false => ControlFlow::Continue(()),
        };
        let work = || {
            self.inner.verify_checksums().map_err(|e| Error::Asset(None, e))?;
            pool.install(|| verify(&self.inner, &options, go_on)).map_err(Error::Verify)
        };
        let cancel = || cancelled.store(true, Ordering::Relaxed);
        let found = cancellable(py, work, cancel, || Ok(()))?;
        classes::report(py, "VerifyReport", &found.map_err(|e| e.raise(py))?)
    }

    /// What the encoder proved.
    #[getter]
    fn certificate<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        classes::report(py, "Certificate", &self.inner.about().certificate())
    }

    /// Counts from the encoding.
    #[getter]
    fn statistics<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        classes::report(py, "Statistics", &self.inner.about().statistics)
    }

    /// The file that the mesh came from.
    #[getter]
    fn source<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        classes::report(py, "Source", &self.inner.about().source)
    }

    /// Name of the mesh's unit, or None.
    #[getter]
    fn unit(&self) -> Option<&str> {
        self.inner.about().options.unit.as_deref()
    }

    /// Bounding box of the mesh [2, 3]: the lowest and the highest corner.
    #[getter]
    fn bounds<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let bounds = self.inner.bounds();
        arrays::of_rows(py, &[bounds.min, bounds.max])
    }

    /// Positions [V, 3] of the vertices in the source's order: a read-only view.
    #[getter]
    fn vertices<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        Self::section(slf, layout::VERTICES.name)
    }

    /// Vertices [F, 3] of the faces, uint32, in the order of the file: a read-only view. Row i is
    /// the face face_ids[i].
    #[getter]
    fn faces<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        Self::section(slf, layout::FACES.name)
    }

    /// Id [F] of each row of faces in the source mesh, uint32: a read-only view. Answers use these
    /// ids.
    #[getter]
    fn face_ids<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        Self::section(slf, layout::FACE_IDS.name)
    }

    /// All arrays of the file by name, as read-only views without a copy. Each view keeps the asset
    /// alive.
    #[getter]
    fn sections<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyDict>> {
        let found = PyDict::new(slf.py());
        for section in slf.get().inner.sections() {
            let (owner, columns) = (slf.as_any(), section.spec.columns);
            let bytes = section.bytes;
            // SAFETY: an asset never changes, its bytes (a mapping or a heap block) do not move,
            // and the asset is the owner.
            let array = unsafe {
                match section.spec.element {
                    Element::U8 => arrays::view::<u8>(owner, bytes, columns),
                    Element::U16 => arrays::view::<u16>(owner, bytemuck::cast_slice(bytes), columns),
                    Element::U32 => arrays::view::<u32>(owner, bytemuck::cast_slice(bytes), columns),
                    Element::F32 => arrays::view::<f32>(owner, bytemuck::cast_slice(bytes), columns),
                    Element::F64 => arrays::view::<f64>(owner, bytemuck::cast_slice(bytes), columns),
                }
            }?;
            found.set_item(section.spec.name, array)?;
        }
        Ok(found)
    }

    fn __repr__(&self) -> String {
        let about = self.inner.about();
        let source = if about.source.name.is_empty() { "made in memory" } else { &about.source.name };
        format!(
            "<tesdf.Asset {source}: {} faces, {} bytes>",
            self.inner.face_count(),
            self.inner.as_bytes().len()
        )
    }

    /// A section of its distances and its figures, for notebooks.
    fn _repr_html_<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        slf.py().import("tesdf._html")?.call_method1("of_asset", (slf,))
    }

    /// Supports pickling through the bytes of the file.
    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<(Bound<'py, PyAny>, (Bound<'py, PyBytes>,))> {
        Ok((slf.getattr("from_bytes")?, (slf.get().to_bytes(slf.py())?,)))
    }
}
