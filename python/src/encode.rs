//! `tesdf.encode`
use std::num::NonZeroUsize;
use std::path::PathBuf;
use std::sync::Arc;

use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyString};
use tesdf::Progress;
use tesdf::base::{Named, unit};
use tesdf::encode::{Deformation, Domain, DomainChoice, EncodeChoices, Encoder, Refinement, Threshold};
use tesdf::mesh::RepairMode;

use crate::asset::Asset;
use crate::errors::{Error, argument, kind_of};
use crate::interrupt::abandonable;
use crate::mesh::MeshInput;
use crate::pool;
use crate::whole::integer;

/// Encodes a closed mesh. Ctrl-C ends it with KeyboardInterrupt.
///
/// - mesh: a path (STL, OBJ, PLY, OFF, glTF, GLB, 3MF; STEP, IGES, BREP with Gmsh; USD with
///   usd-core), a pair (vertices [V, 3], faces [F, 3]), or a mesh of trimesh, Open3D or pyvista.
/// - preset: "default" (fast queries), "fast" (fast encoding), "compact" (small) or "gpu" (few
///   cells, whose lists fill the 32 threads of a GPU that read them), all exact; "paper" (the
///   paper's encoder: sampled, 129 samples along an edge, plain) or "sampled-safe" (sampled with a
///   threshold that is large enough that no needed face is missing).
/// - domain: the division of space into tetrahedra. None or "bisection" needs no other program.
///   "gmsh" runs Gmsh (the program of that name, or the one in the environment variable
///   TESDF_GMSH). A path (.msh, .node, .ele) has tetrahedra that conform to the mesh's faces.
/// - encoder: the method that finds the closest faces of each tetrahedron: "certified" (proven) or
///   "sampled" (as in the paper; faces that are closest only between samples may be missing). None
///   is the encoder of the preset.
/// - resolution: an edge of a tetrahedron has resolution + 1 samples. None is 32, or the value of
///   the preset.
/// - threshold: a face is listed if it is at most this length farther than the closest face at a
///   sample, in the mesh's unit. "squared:1e-6" compares squared distances instead, in the squared
///   unit. "safe" is large enough that no needed face is missing.
/// - e_max: maximum length of a list; the faces that are needed nearest to the surface stay.
/// - deformable: prepares the lists for moving vertices; needs a conforming domain ("gmsh" or a
///   path).
/// - plain: keeps the tetrahedra of a conforming domain as they are, without bisecting them.
/// - band: width of the encoded layer around the solid, in the mesh's unit. None is 5 % of the
///   diagonal, and no layer with "gmsh".
/// - regions: boxes [R, 6] that are encoded as well, each min x y z, max x y z.
/// - unit: name of the mesh's unit; it is recorded in the asset and scales nothing. None is the
///   unit of the file, if it has one; another unit than that is a warning.
/// - inside: the rule that says what is inside. "winding": a winding number of 1 or more,
///   "nonzero": other than 0, "odd": odd; these need a closed mesh. "generalized": a generalised
///   winding number of 1/2 or more in absolute value; for open meshes. "sheet": nearer to a face
///   than half of the thickness; for any faces.
/// - thickness: that of a sheet, in the mesh's unit.
/// - surface: the faces to which distances refer: "all", or "boundary", the faces between inside
///   and outside.
/// - repair: "auto" repairs a mesh without a well-defined inside before it is encoded: the first of
///   these that makes it encodable, duplicates and T-junctions and orientation, welding of cracks,
///   filling of holes. The asset records what was changed (asset.source.repair). None refuses such
///   a mesh.
/// - threads: number of threads, at most 1024; None is one per core. The bytes of the asset do not depend on it.
/// - progress: called with the stage ("refine", "tighten", "assemble") and the completed fraction
///   of it, 0 to 1, about twenty times a second. An exception from it ends the encoding and is
///   raised.
///
/// Raises OSError or MeshError if the mesh or the tetrahedra cannot be read. Raises NotSolidError
/// if the mesh has no well-defined inside. Raises EncodeError if an option does not apply to the
/// mesh, options exclude each other, Gmsh fails, or the tetrahedra do not conform to the mesh.
#[pyfunction]
#[pyo3(
    signature = (mesh, preset = None, **options),
    text_signature = "(mesh, preset='default', *, domain=None, encoder=None, resolution=None, threshold=None, e_max=None, deformable=False, plain=False, band=None, regions=None, unit=None, inside='winding', thickness=None, surface='all', repair=None, threads=None, progress=None)"
)]
pub fn encode(
    py: Python<'_>,
    mesh: &Bound<'_, PyAny>,
    preset: Option<&Bound<'_, PyAny>>,
    options: Option<&Bound<'_, PyDict>>,
) -> PyResult<Asset> {
    let Keywords { choices, repair, threads, progress } = Keywords::new(preset, options)?;
    let options = choices.options().map_err(|e| Error::Choice(e).raise(py))?;
    let input = MeshInput::new(mesh)?;
    let pool = pool::of(threads).map_err(|e| e.raise(py))?;
    let state = Arc::new(Progress::default());
    let (asked, shared) = (choices.clone(), Arc::clone(&state));
    let work = move || {
        let (choices, state) = (asked, &*shared);
        pool.install(|| {
            let loaded = input.load()?;
            let of_file = loaded.unit.clone();
            let (solid, path, source) = loaded.solid(options.inside, repair)?;
            let tetrahedra = choices.tetrahedra(&solid, state).map_err(Error::Domain)?;
            let domain = tetrahedra.as_ref().map_or(Domain::Bisection, Domain::Conforming);
            Encoder::new()
                .options(options.or_unit(of_file.as_deref()))
                .domain(domain)
                .source(source)
                .progress(state)
                .encode(&solid)
                .map(|asset| (asset, of_file))
                .map_err(|e| Error::Encode(path, e))
        })
    };
    let watch = || match &progress {
        Some(progress) => {
            let (stage, share) = state.state();
            progress.call1((stage.name(), share)).map(|_| ())
        }
        None => Ok(()),
    };
    let (encoded, of_file) = abandonable(py, work, || state.cancel(), watch)?.map_err(|e| e.raise(py))?;
    watch()?;
    if let Some(found) = unit::conflict(of_file.as_deref(), choices.unit.as_deref()) {
        py.import("warnings")?.call_method1("warn", (found,))?;
    }
    Ok(Asset::new(encoded))
}

/// The keywords of `encode`, besides the mesh.
#[derive(Default)]
struct Keywords<'py> {
    choices: EncodeChoices,
    repair: RepairMode,
    threads: Option<NonZeroUsize>,
    progress: Option<Bound<'py, PyAny>>,
}

impl<'py> Keywords<'py> {
    /// Converts the keywords. None stands for a keyword that is left out.
    ///
    /// # Errors
    /// `TypeError` for an unknown keyword and a value of another type, `ValueError` for an unknown
    /// name.
    fn new(preset: Option<&Bound<'py, PyAny>>, keywords: Option<&Bound<'py, PyDict>>) -> PyResult<Self> {
        let mut found = Self::default();
        if let Some(preset) = preset {
            let name = preset.cast::<PyString>().map_err(|_| {
                let expected = "the name of a preset; arrays are one argument: encode((vertices, faces))";
                PyTypeError::new_err(format!("preset: {}; expected {expected}", kind_of(preset)))
            })?;
            found.choices.preset = chosen("preset", &name.to_cow()?)?;
        }
        for (name, value) in keywords.into_iter().flatten() {
            let name: String = name.extract()?;
            found.set(&name, &value)?;
        }
        Ok(found)
    }

    fn set(&mut self, name: &str, value: &Bound<'py, PyAny>) -> PyResult<()> {
        let choices = &mut self.choices;
        match name {
            "domain" => {
                choices.domain = given(value).map(domain_choice).transpose()?.unwrap_or_default();
            }
            "encoder" => choices.encoder = given(value).map(|any| named(name, any)).transpose()?,
            "resolution" => choices.resolution = integer(name, value)?,
            "threshold" => choices.threshold = given(value).map(length_or_safe).transpose()?,
            "e_max" => choices.e_max = integer(name, value)?,
            "deformable" => {
                choices.deformation = match typed(name, value)? {
                    true => Deformation::Expected,
                    false => Deformation::None,
                };
            }
            "plain" => choices.refinement = typed::<bool>(name, value)?.then_some(Refinement::None),
            "band" => choices.band = typed(name, value)?,
            "regions" => choices.regions = typed::<Option<_>>(name, value)?.unwrap_or_default(),
            "unit" => choices.unit = typed(name, value)?,
            "inside" => choices.inside = named(name, value)?,
            "thickness" => choices.thickness = typed(name, value)?,
            "surface" => choices.surface = named(name, value)?,
            "repair" => self.repair = repair_mode(typed(name, value)?)?,
            "threads" => self.threads = integer(name, value)?,
            "progress" => self.progress = given(value).cloned(),
            _ => {
                let text = format!("encode() got an unexpected keyword argument '{name}'");
                return Err(PyTypeError::new_err(text));
            }
        }
        Ok(())
    }
}

/// An object other than None.
fn given<'a, 'py>(value: &'a Bound<'py, PyAny>) -> Option<&'a Bound<'py, PyAny>> {
    Some(value).filter(|value| !value.is_none())
}

/// A value of a type. A `TypeError` names the keyword.
fn typed<'a, 'py, T: FromPyObject<'a, 'py>>(name: &str, value: &'a Bound<'py, PyAny>) -> PyResult<T> {
    value.extract().map_err(|e: T::Error| {
        let e: PyErr = e.into();
        match e.is_instance_of::<PyTypeError>(value.py()) {
            true => PyTypeError::new_err(format!("argument '{name}': {}", e.value(value.py()))),
            false => e,
        }
    })
}

/// The choice of a name.
fn chosen<T: Named>(name: &str, text: &str) -> PyResult<T> {
    T::of_name(text).ok_or_else(|| argument(name, format!("'{text}'"), &T::names("'")))
}

/// The choice of a name, which is a text.
fn named<T: Named>(name: &str, value: &Bound<'_, PyAny>) -> PyResult<T> {
    chosen(name, &typed::<String>(name, value)?)
}

fn repair_mode(name: Option<String>) -> PyResult<RepairMode> {
    match name.as_deref() {
        None => Ok(RepairMode::Never),
        Some("auto") => Ok(RepairMode::Auto),
        Some(other) => Err(argument("repair", format!("'{other}'"), "'auto' or None")),
    }
}

/// Converts the name of a domain, or a path. Text that is not a name is a path.
fn domain_choice(any: &Bound<'_, PyAny>) -> PyResult<DomainChoice> {
    if let Ok(text) = any.cast::<PyString>() {
        let Ok(choice) = text.to_cow()?.parse();
        return Ok(choice);
    }
    any.extract::<PathBuf>()
        .map(DomainChoice::File)
        .map_err(|_| argument("domain", kind_of(any), "'bisection', 'gmsh' or a path of tetrahedra"))
}

fn length_or_safe(any: &Bound<'_, PyAny>) -> PyResult<Threshold> {
    if let Ok(text) = any.cast::<PyString>() {
        let text = text.to_cow()?;
        let expected = "a length of 0 or more, 'safe', or 'squared:' and an area, as 'squared:1e-6'";
        return text.parse().map_err(|_| argument("threshold", format!("'{text}'"), expected));
    }
    any.extract().map(Threshold::Absolute)
}
