//! `tesdf.encode`
use std::num::{NonZeroU32, NonZeroUsize};
use std::path::PathBuf;

use pyo3::prelude::*;
use pyo3::types::PyString;
use tesdf::base::SurfaceFaces;
use tesdf::base::unit;
use tesdf::encode::{
    Deformation, Domain, DomainChoice, EncodeChoices, Encoder, MethodChoice, Preset, Refinement, RuleChoice,
    Threshold,
};
use tesdf::mesh::RepairMode;
use tesdf::{Progress, Stage};

use crate::asset::Asset;
use crate::errors::{Error, argument, kind_of};
use crate::interrupt::cancellable;
use crate::mesh::MeshInput;
use crate::pool;

/// Encodes a closed mesh. Ctrl-C ends it with KeyboardInterrupt.
///
/// - mesh: a path (STL, OBJ, PLY, OFF, glTF, GLB, 3MF; STEP, IGES, BREP with Gmsh; USD with
///   usd-core), a pair (vertices [V, 3], faces [F, 3]), or an object with attributes of these
///   names.
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
///   sample, in the mesh's unit. "safe" is large enough that no needed face is missing.
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
/// - threads: number of threads; None is one per core. The bytes of the asset do not depend on it.
/// - progress: called with the stage ("refine", "tighten", "assemble") and the completed fraction
///   of it, 0 to 1, about twenty times a second. An exception from it ends the encoding and is
///   raised.
///
/// Raises OSError or MeshError if the mesh or the tetrahedra cannot be read. Raises NotSolidError
/// if the mesh has no well-defined inside. Raises EncodeError if an option does not apply to the
/// mesh, options exclude each other, Gmsh fails, or the tetrahedra do not conform to the mesh.
#[pyfunction]
#[pyo3(signature = (
    mesh, preset = "default", *, domain = None, encoder = None, resolution = None, threshold = None, e_max = None,
    deformable = false, plain = false, band = None, regions = None, unit = None, inside = "winding", thickness = None,
    surface = "all", repair = None, threads = None, progress = None
))]
#[expect(clippy::too_many_arguments, reason = "keywords in Python")]
pub fn encode(
    py: Python<'_>,
    mesh: &Bound<'_, PyAny>,
    preset: &str,
    domain: Option<&Bound<'_, PyAny>>,
    encoder: Option<&str>,
    resolution: Option<u32>,
    threshold: Option<&Bound<'_, PyAny>>,
    e_max: Option<NonZeroU32>,
    deformable: bool,
    plain: bool,
    band: Option<f64>,
    regions: Option<Vec<[f64; 6]>>,
    unit: Option<String>,
    inside: &str,
    thickness: Option<f64>,
    surface: &str,
    repair: Option<&str>,
    threads: Option<NonZeroUsize>,
    progress: Option<&Bound<'_, PyAny>>,
) -> PyResult<Asset> {
    let choices = EncodeChoices {
        preset: named_preset(preset)?,
        domain: domain.map(domain_choice).transpose()?.unwrap_or_default(),
        method: encoder.map(named_encoder).transpose()?,
        resolution,
        threshold: threshold.map(length_or_safe).transpose()?,
        max_entries: e_max,
        deformation: if deformable { Deformation::Expected } else { Deformation::None },
        refinement: plain.then_some(Refinement::None),
        band,
        regions: regions.unwrap_or_default(),
        unit,
        rule: named_rule(inside)?,
        thickness,
        surface: named_surface(surface)?,
    };
    let options = choices.options().map_err(|e| Error::Choice(e).raise(py))?;
    let repair = match repair {
        None => RepairMode::Never,
        Some("auto") => RepairMode::Auto,
        Some(other) => return Err(argument("repair", format!("'{other}'"), "'auto' or None")),
    };

    let input = MeshInput::new(mesh)?;
    let pool = pool::of(threads).map_err(|e| e.raise(py))?;
    let state = Progress::default();
    let work = || {
        pool.install(|| {
            let loaded = input.load()?;
            let of_file = loaded.unit.clone();
            let (solid, path, source) = loaded.solid(options.inside, repair)?;
            let tetrahedra = choices.tetrahedra(&solid, &state).map_err(Error::Domain)?;
            let domain = tetrahedra.as_ref().map_or(Domain::Bisection, Domain::Conforming);
            Encoder::new()
                .options(options.or_unit(of_file.as_deref()))
                .domain(domain)
                .source(source)
                .progress(&state)
                .encode(&solid)
                .map(|asset| (asset, of_file))
                .map_err(|e| Error::Encode(path, e))
        })
    };
    let watch = || match progress {
        Some(progress) => {
            let (stage, share) = state.state();
            let stage = match stage {
                Stage::Refine => "refine",
                Stage::Tighten => "tighten",
                Stage::Assemble => "assemble",
            };
            progress.call1((stage, share)).map(|_| ())
        }
        None => Ok(()),
    };
    let (encoded, of_file) = cancellable(py, work, || state.cancel(), watch)?.map_err(|e| e.raise(py))?;
    watch()?;
    if let Some(found) = unit::conflict(of_file.as_deref(), choices.unit.as_deref()) {
        py.import("warnings")?.call_method1("warn", (found,))?;
    }
    Ok(Asset::new(encoded))
}

fn named_rule(name: &str) -> PyResult<RuleChoice> {
    let expected = "'winding', 'nonzero', 'odd', 'generalized' or 'sheet'";
    name.parse().map_err(|_| argument("inside", format!("'{name}'"), expected))
}

fn named_surface(name: &str) -> PyResult<SurfaceFaces> {
    match name {
        "all" => Ok(SurfaceFaces::All),
        "boundary" => Ok(SurfaceFaces::Boundary),
        _ => Err(argument("surface", format!("'{name}'"), "'all' or 'boundary'")),
    }
}

fn named_preset(name: &str) -> PyResult<Preset> {
    Ok(match name {
        "default" => Preset::Default,
        "fast" => Preset::Fast,
        "compact" => Preset::Compact,
        "gpu" => Preset::Gpu,
        "paper" => Preset::Paper,
        "sampled-safe" => Preset::SampledSafe,
        _ => {
            let expected = "'default', 'fast', 'compact', 'gpu', 'paper' or 'sampled-safe'";
            return Err(argument("preset", format!("'{name}'"), expected));
        }
    })
}

fn named_encoder(name: &str) -> PyResult<MethodChoice> {
    match name {
        "certified" => Ok(MethodChoice::Certified),
        "sampled" => Ok(MethodChoice::Sampled),
        _ => Err(argument("encoder", format!("'{name}'"), "'certified' or 'sampled'")),
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
        return match &*text.to_cow()? {
            "safe" => Ok(Threshold::CoveringRadius),
            text => Err(argument("threshold", format!("'{text}'"), "a length or 'safe'")),
        };
    }
    any.extract().map(Threshold::Absolute)
}
