//! `tesdf.encode`
use std::num::NonZeroUsize;

use pyo3::prelude::*;
use tesdf::encode::{EncodeOptions, EncodeProgress, Length, Preset, Stage};

use crate::asset::Asset;
use crate::errors::{Error, argument};
use crate::interrupt::cancellable;
use crate::mesh::MeshInput;
use crate::pool;

/// Encodes a closed mesh; Ctrl-C ends it with KeyboardInterrupt.
///
/// mesh: a path (STL, OBJ, PLY, OFF, glTF, GLB), a pair (vertices [V, 3], faces [F, 3]), or an object that has both.
/// preset: "default" (few faces per query), "fast" (quickest to encode) or "compact" (smallest); all are exact.
/// band: width of the layer around the solid that is encoded too, in the mesh's unit; None is 5 % of the diagonal.
/// regions: boxes [R, 6] that are encoded too, each min x y z, max x y z.
/// unit: name of the mesh's unit, recorded in the asset; nothing is scaled.
/// threads: None is one per core; the asset is the same, byte by byte, for every number.
/// progress: called with the stage ("refine", "tighten", "assemble") and the share of it that is done, 0 to 1, some
/// twenty times a second; what it raises ends the encoding and is raised.
///
/// Raises OSError or MeshError when there is no mesh, NotSolidError when it has no well-defined inside, and EncodeError
/// when an option has no meaning for it.
#[pyfunction]
#[pyo3(signature = (mesh, preset = "default", *, band = None, regions = None, unit = None, threads = None, progress = None))]
#[expect(clippy::too_many_arguments, reason = "keywords in Python")]
pub fn encode(
    py: Python<'_>,
    mesh: &Bound<'_, PyAny>,
    preset: &str,
    band: Option<f64>,
    regions: Option<Vec<[f64; 6]>>,
    unit: Option<String>,
    threads: Option<NonZeroUsize>,
    progress: Option<&Bound<'_, PyAny>>,
) -> PyResult<Asset> {
    let mut options = EncodeOptions::preset(match preset {
        "default" => Preset::Default,
        "fast" => Preset::Fast,
        "compact" => Preset::Compact,
        _ => return Err(argument("preset", format!("'{preset}'"), "'default', 'fast' or 'compact'")),
    });
    if let Some(band) = band {
        options.band = Length::Absolute(band);
    }
    options.regions = regions.unwrap_or_default();
    options.unit = unit;

    let input = MeshInput::new(mesh)?;
    let pool = pool::of(threads).map_err(|e| e.raise(py))?;
    let state = EncodeProgress::default();
    let work = || {
        pool.install(|| {
            let (solid, path, source) = input.load()?.solid()?;
            tesdf::encode::encode(&solid, &source, &options, &state).map_err(|e| Error::Encode(path, e))
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
    let encoded = cancellable(py, work, || state.cancel(), watch)?.map_err(|e| e.raise(py))?;
    watch()?;
    Ok(Asset::new(encoded))
}
