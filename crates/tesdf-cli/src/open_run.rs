//! Opens a recorded run with the geometries of its bodies.
use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;

use crate::terminal::output::{self, Consent};
use crate::terminal::progress::watched;
use crate::terminal::report::Failure;
use crate::terminal::run_file;
use tesdf::Progress;
use tesdf::save::Destination;
use tesdf_sim::scene_file::{AssetCache, LoadedScene, SceneError};
use tesdf_sim::{RunRecord, System};

use crate::simulate::replace_geometries;

/// A run that is open.
pub struct OpenRun {
    /// The run.
    pub record: RunRecord,
    /// Its scene.
    pub loaded: LoadedScene,
    /// The bodies, with their geometries.
    pub system: System,
    /// The output file, which is none of the files that were read.
    pub output: Destination,
}

/// Reads a run and opens the geometries of its bodies. `geometries` replace those of bodies.
///
/// # Errors
/// The file is not a run, a geometry is missing, Ctrl-C was pressed, or the output is one of these
/// files.
pub fn open(
    run: &Path,
    geometries: &[(String, PathBuf)],
    output: &Path,
    consent: Consent,
    interrupted: &AtomicBool,
) -> Result<OpenRun, Failure> {
    let record = run_file::open(run)?;
    let mut loaded = LoadedScene::of_run(&record, run).map_err(Failure::new)?;
    replace_geometries(&mut loaded, geometries, run)?;
    let mut inputs = loaded.geometry_files();
    inputs.push(run.to_path_buf());
    let output = output::open(output, &inputs, consent)?;
    let progress = Progress::default();
    loaded.assets = AssetCache::of_user();
    let system =
        watched(&progress, interrupted, || loaded.system_watched(&progress)).map_err(|e| match e {
            SceneError::Body { name, reason, .. } => {
                Failure::new(format!("{}: body {name}: {reason}", run.display())).hint(
                    "the run stores paths, not meshes; give their current place with --geometry BODY=FILE",
                )
            }
            e => Failure::new(e),
        })?;
    Ok(OpenRun { record, loaded, system, output })
}
