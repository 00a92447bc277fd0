//! `tesdf.export` and `tesdf.view`
use std::collections::BTreeMap;
use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

use pyo3::prelude::*;
use tesdf::Progress;
use tesdf::base::Named;
use tesdf::save::{Destination, SaveError, SaveOptions};
use tesdf_playback::{Arrows, ContactOptions, Frames, GlbOptions, Playback, glb, page};
use tesdf_sim::scene_file::{AssetCache, LoadedScene};
use tesdf_sim::{RunRecord, System};

use crate::errors::{Error, argument, kind_of};
use crate::interrupt::cancellable;
use crate::pool;
use crate::simulation::{RecordedRun, Simulation};
use crate::whole;

// The docstring of `tesdf.view` has the number.
const _: () = assert!(ContactOptions::MOST == 128);

/// Writes a run as an animated GLB file, which Blender, three.js and others play.
///
/// - run: the path of a run of `tesdf simulate` or Simulation.save, a Simulation, whose steps so far
///   are taken, or a Record.
/// - path: the file.
/// - every: every N-th step and the last one are played. fps: the steps nearest to this many times
///   in each second of the run. Without both, at most 1000 steps are.
/// - speed: seconds of the run in each second of the animation.
/// - geometries: files in place of the meshes that the run names: a dict of names of bodies and
///   paths. Not for a Simulation or Record, which has its meshes.
///
/// Each body is a node with its name; lengths are metres, and y is up, as glTF wants it. The same
/// run gives the bytes of `tesdf export`.
///
/// Raises OSError if a file cannot be read or written, SceneError if a mesh is missing, and
/// SimulationError if the run cannot be played.
#[pyfunction]
#[pyo3(signature = (run, path, *, every = None, fps = None, speed = 1.0, geometries = None))]
pub fn export(
    py: Python<'_>,
    run: &Bound<'_, PyAny>,
    path: PathBuf,
    #[pyo3(from_py_with = whole::every)] every: Option<NonZeroUsize>,
    fps: Option<f64>,
    speed: f64,
    geometries: Option<BTreeMap<String, PathBuf>>,
) -> PyResult<()> {
    let frames = frames(every, fps)?;
    write(py, run, geometries, &path, None, |source, _| {
        let run = Playback::new(&source.record, &source.system, frames).map_err(Error::Playback)?;
        glb(&run, &GlbOptions { speed }).map_err(Error::Playback)
    })
}

/// Writes the page of tesdf.view to a file, with its arguments.
///
/// - contacts: None are those that the run has recorded, where it has those of all frames but the
///   last, else none.
/// - in_notebook: without every and fps, at most 300 steps are played, if possible at those whose
///   contacts are recorded.
#[pyfunction]
#[pyo3(signature = (
    run, path, *, every = None, fps = None, contacts = None, title = None, geometries = None, progress = None,
    in_notebook = false
))]
#[expect(clippy::too_many_arguments, reason = "keywords in Python")]
pub fn view(
    py: Python<'_>,
    run: &Bound<'_, PyAny>,
    path: PathBuf,
    #[pyo3(from_py_with = whole::every)] every: Option<NonZeroUsize>,
    fps: Option<f64>,
    #[pyo3(from_py_with = whole::contacts)] contacts: Option<usize>,
    title: Option<String>,
    geometries: Option<BTreeMap<String, PathBuf>>,
    progress: Option<&Bound<'_, PyAny>>,
    in_notebook: bool,
) -> PyResult<()> {
    let is_chosen = every.is_some() || fps.is_some();
    let frames = frames(every, fps)?;
    write(py, run, geometries, &path, progress, |source, watch| {
        let Source { record, system, loaded, name, .. } = source;
        let frames = if in_notebook && !is_chosen { of_notebook(record) } else { frames };
        let run = Playback::new(record, system, frames).map_err(Error::Playback)?;
        let detects = contacts.map_or_else(|| run.has_recorded_contacts(), |most| most > 0);
        let most = contacts.unwrap_or(ContactOptions::MOST);
        let options = ContactOptions { detection: loaded.detection(system).filter(|_| detects), most };
        let forces = run.forces(most);
        let done = |frames: usize| watch.frames(frames, run.steps.len());
        let contacts = run.contacts(system, &options, &watch.stop, done).map_err(Error::Playback)?;
        let title = title.as_deref().unwrap_or(name);
        let arrows = Arrows { contacts: contacts.as_deref(), forces: forces.as_deref() };
        Ok(page(&run, arrows, title).map_err(Error::Playback)?.into_bytes())
    })
}

/// Notebooks keep what they show, so a page in one has fewer states than a file.
const OF_NOTEBOOK: usize = 300;
/// Fewest states at which the contacts of a run are recorded for a notebook to play them alone.
const FEWEST: u64 = 50;

/// The frames of a notebook: at most [`OF_NOTEBOOK`], and those with recorded contacts where there
/// are enough of them.
fn of_notebook(record: &RunRecord) -> Frames {
    let last = record.times().len().saturating_sub(1);
    let every = last.div_ceil(OF_NOTEBOOK).max(1);
    let between = match record.contact_steps() {
        [first, second, ..] if (second - first) * FEWEST <= last as u64 => (second - first) as usize,
        _ => 1,
    };
    Frames::Every(NonZeroUsize::new(every.next_multiple_of(between)).unwrap_or(NonZeroUsize::MIN))
}

fn frames(every: Option<NonZeroUsize>, fps: Option<f64>) -> PyResult<Frames> {
    match (every, fps) {
        (Some(every), None) => Ok(Frames::Every(every)),
        (None, Some(rate)) => Ok(Frames::PerSecond(rate)),
        (None, None) => Ok(Frames::default()),
        (Some(_), Some(_)) => Err(argument("every", "fps is given, too", "one of both")),
    }
}

/// How far a file is, and the request to stop.
#[derive(Default)]
struct Watch {
    /// Of the mesh that is encoded.
    encoding: Progress,
    stop: AtomicBool,
    /// Frames whose contacts are found, and the number of frames; 0 before the first.
    found: [AtomicUsize; 2],
}

impl Watch {
    fn frames(&self, found: usize, of: usize) {
        self.found[0].store(found, Ordering::Relaxed);
        self.found[1].store(of, Ordering::Relaxed);
    }

    /// The stage, and its share.
    fn state(&self) -> (&'static str, f64) {
        match [0, 1].map(|k| self.found[k].load(Ordering::Relaxed)) {
            [_, 0] => {
                let (stage, share) = self.encoding.state();
                (stage.name(), share)
            }
            [found, of] => ("contacts", found as f64 / of as f64),
        }
    }

    fn cancel(&self) {
        self.encoding.cancel();
        self.stop.store(true, Ordering::Relaxed);
    }
}

/// A run with the geometries of its bodies.
struct Source {
    record: RunRecord,
    system: System,
    loaded: LoadedScene,
    /// Name for the heading.
    name: String,
    /// The files that were read, none of which may be the output.
    inputs: Vec<PathBuf>,
}

impl Source {
    fn open(path: &Path, geometries: &BTreeMap<String, PathBuf>, progress: &Progress) -> Result<Self, Error> {
        let record = RunRecord::open(path).map_err(|e| Error::Record(path.to_path_buf(), e))?;
        let mut loaded = LoadedScene::of_run(&record, path).map_err(Error::Scene)?;
        for (body, file) in geometries {
            // Paths in a scene are relative to its folder, but these to the current folder.
            let file = std::path::absolute(file).unwrap_or_else(|_| file.clone());
            if !loaded.replace_geometry(body, file) {
                return Err(Error::NoBody(path.to_path_buf(), body.clone()));
            }
        }
        loaded.assets = AssetCache::of_user();
        let system = loaded.system_watched(progress).map_err(Error::Scene)?;
        let name = path.file_stem().map_or(String::new(), |name| name.to_string_lossy().into_owned());
        let mut inputs = loaded.geometry_files();
        inputs.push(path.to_path_buf());
        Ok(Self { record, system, loaded, name, inputs })
    }

    fn of_simulation(record: RunRecord, system: System) -> Result<Self, Error> {
        let loaded = LoadedScene::of_run(&record, "").map_err(Error::Scene)?;
        Ok(Self { record, system, loaded, name: "run".into(), inputs: Vec::new() })
    }
}

/// Makes a file of a run on another thread, which Ctrl-C ends, and writes it.
fn write(
    py: Python<'_>,
    run: &Bound<'_, PyAny>,
    geometries: Option<BTreeMap<String, PathBuf>>,
    path: &Path,
    progress: Option<&Bound<'_, PyAny>>,
    make: impl FnOnce(&Source, &Watch) -> Result<Vec<u8>, Error> + Send,
) -> PyResult<()> {
    let pool = pool::shared().map_err(|e| e.raise(py))?;
    let watch = Watch::default();
    let simulation = run.cast::<Simulation>().ok().map(|simulation| simulation.get());
    // Of a Record.
    let recorded = run.getattr("_run").and_then(|run| Ok(run.cast_into::<RecordedRun>()?)).ok();
    let recorded = recorded.as_ref().map(|recorded| recorded.get());
    let file: Option<PathBuf> = run.extract().ok();
    if simulation.is_none() && recorded.is_none() && file.is_none() {
        return Err(argument("run", kind_of(run), "a path, a Simulation, or a Record of this process"));
    }
    if file.is_none() && geometries.is_some() {
        return Err(argument("geometries", "given for a Simulation or Record", "None: it has its meshes"));
    }
    let geometries = geometries.unwrap_or_default();
    let work = || {
        pool.install(|| {
            let source = match (simulation, recorded) {
                (Some(simulation), _) => {
                    let (record, system) = simulation.so_far()?;
                    Source::of_simulation(record, system)?
                }
                (None, Some(RecordedRun { record, system })) => {
                    Source::of_simulation(record.clone(), system.clone())?
                }
                (None, None) => Source::open(&file.unwrap_or_default(), &geometries, &watch.encoding)?,
            };
            let inputs: Vec<&Path> = source.inputs.iter().map(PathBuf::as_path).collect();
            let refused = |e: SaveError| Error::Record(path.to_path_buf(), e.into());
            let options = SaveOptions { inputs: &inputs, ..SaveOptions::default() };
            let output = Destination::new(path, &options).map_err(refused)?;
            output.write(&make(&source, &watch)?).map_err(refused)
        })
    };
    let tell = || progress.map_or(Ok(()), |progress| progress.call1(watch.state()).map(drop));
    cancellable(py, work, || watch.cancel(), tell)?.map_err(|e| e.raise(py))?;
    watch.frames(1, 1);
    tell()
}
