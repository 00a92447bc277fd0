//! `tesdf simulate SCENE -o RUN` and `tesdf simulate --resume RUN`: simulates a scene.
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressStyle};
use serde::Serialize;
use tesdf::Progress;
use tesdf_playback::{LiveFrame, LiveView};
use tesdf_sim::criterion::Criteria;
use tesdf_sim::record::RecordError;
use tesdf_sim::scene_file::{AssetCache, DetectorMode, LoadedScene, SceneError};
use tesdf_sim::{Dynamics, InterruptedRun, Moment, PartialRun, RunOrigin, Summary, System, simulate_from};

use crate::collide::warn_of_coarse;
use crate::terminal::device::{self, Choice, Device};
use crate::terminal::interrupt;
use crate::terminal::output::{self, Consent};
use crate::terminal::progress::watched;
use crate::terminal::report::{self, Failure, Outcome};
use crate::terminal::{parse, run_file};

mod criteria;
mod recorder;

use recorder::Recorder;

/// Arguments of `tesdf simulate`.
#[derive(clap::Args, Debug)]
pub struct Args {
    /// Scene file, TOML. With --resume it is optional, but must be the scene of the run
    #[arg(required_unless_present = "resume", value_parser = parse::scene())]
    pub scene: Option<PathBuf>,
    /// Output file, safetensors; an existing file is replaced after the first step. Until the run
    /// is complete, the file holds the steps so far. A pipe or device is written to at the end
    /// [default: with --resume, the run itself]
    #[arg(short, long, value_name = "RUN", required_unless_present = "resume", value_parser = parse::output())]
    pub output: Option<PathBuf>,
    /// Whether a read-only output is replaced.
    #[command(flatten)]
    pub consent: Consent,
    /// Resume a run that was interrupted or killed, from its last complete step. The file ends with
    /// the same bytes as without the interruption
    #[arg(long, value_name = "RUN")]
    pub resume: Option<PathBuf>,
    /// Time step in place of the scene's, s
    #[arg(long, value_name = "SECONDS", value_parser = parse::length)]
    pub time_step: Option<f64>,
    /// Duration in place of the scene's, s
    #[arg(long, value_name = "SECONDS", value_parser = parse::length)]
    pub duration: Option<f64>,
    /// Detector mode in place of the scene's
    #[arg(long, value_parser = parse::named::<DetectorMode>())]
    pub mode: Option<DetectorMode>,
    /// Replace the geometry of a body by a .tesdf file, or by a mesh, which is encoded; `link*` are
    /// all bodies whose names begin with `link`; may be given several times
    #[arg(long = "geometry", value_name = "BODY=FILE", value_parser = geometry)]
    pub geometries: Vec<(String, PathBuf)>,
    /// Where contacts are found
    #[arg(long, value_name = "DEVICE", value_parser = Choice::parse, default_value_t = Choice::Processor, help = device::help("contacts are found"))]
    pub device: Choice,
    /// Exit with code 1 when the run has warnings: bodies that overlap, joints that come apart,
    /// energy from nowhere, steps that did not converge
    #[arg(long)]
    pub strict: bool,
    /// Encode the meshes of the scene anew. Otherwise those that were encoded before come from the
    /// user's folder for caches, or that of the environment variable TESDF_CACHE
    #[arg(long)]
    pub no_cache: bool,
    /// Serve a page on this machine that follows the run. Its address is printed on stderr. After
    /// the run it is served until Ctrl-C
    #[arg(long)]
    pub view: bool,
    /// Print the result as JSON
    #[arg(long)]
    pub json: bool,
}

/// Tells which meshes were encoded, and where they are kept.
pub fn tell_encoded(assets: &AssetCache) {
    let files: Vec<String> = assets.encoded().iter().map(|file| file.display().to_string()).collect();
    if !files.is_empty() {
        report::note(&format!("encoded {}; kept in {}", files.join(", "), assets.folder().display()));
    }
}

/// Parses a body and its geometry as `BODY=FILE`.
///
/// # Errors
/// The text has no `=`.
pub fn geometry(text: &str) -> Result<(String, PathBuf), String> {
    let (body, file) = text.split_once('=').ok_or("expected BODY=FILE")?;
    Ok((body.into(), file.into()))
}

/// The output of `--json`.
#[derive(Serialize)]
struct Report<'a> {
    scene: String,
    output: String,
    #[serde(flatten)]
    summary: &'a Summary,
}

impl Args {
    /// The file that the scene comes from, for messages.
    fn source(&self) -> &Path {
        self.scene.as_deref().or(self.resume.as_deref()).unwrap_or(Path::new(""))
    }

    fn output(&self) -> &Path {
        self.output.as_deref().or(self.resume.as_deref()).unwrap_or(Path::new(""))
    }
}

/// Simulates a scene, or resumes an interrupted run. Each step is recorded at once, and the
/// complete run is written at the end.
///
/// # Errors
/// The scene cannot be loaded, the run was made with another scene or program version, a step
/// failed, the file cannot be written, or Ctrl-C was pressed. Before the first step the output file
/// is unchanged; afterwards it holds the steps so far. A run that does not meet the scene's
/// criterion is written and has exit code 1.
pub fn run(args: &Args) -> Result<Outcome, Failure> {
    run_with(args, &Criteria::standard(), |_| Ok(()))
}

/// As [`run`], for scenes that may have these criteria. A scene file is changed by `change` once it is
/// read.
///
/// # Errors
/// The same errors as [`run`], and those of `change`.
pub fn run_with(
    args: &Args,
    criteria: &Criteria,
    change: impl FnOnce(&mut LoadedScene) -> Result<(), Failure>,
) -> Result<Outcome, Failure> {
    let earlier = args.resume.as_deref().map(open_interrupted).transpose()?;
    let mut loaded = read(args, earlier.as_ref(), criteria, change)?;
    replace_values(&mut loaded, args)?;
    let mut inputs = loaded.geometry_files();
    inputs.extend(args.scene.clone());
    let output = output::open(args.output(), &inputs, args.consent)?;
    let device = args.device.open()?;
    let interrupted = interrupt::flag();
    let progress = Progress::default();
    loaded.assets = if args.no_cache { None } else { AssetCache::of_user() };
    let system = watched(&progress, interrupted, || loaded.system_watched(&progress));
    let mut system = system.map_err(|e| match e {
        SceneError::Cancelled => {
            Failure::new(format!("interrupted; {} is unchanged", args.output().display()))
        }
        e => Failure::new(e),
    })?;
    if let Some(assets) = &loaded.assets {
        tell_encoded(assets);
    }
    let device_name = device.as_ref().map_or("cpu", Device::name);
    let origin = RunOrigin::of(&system, device_name).map_err(Failure::new)?;
    let begun = begin(args, &loaded, earlier.as_ref(), &mut system, &origin)?;
    let coarse = loaded.coarse_contacts(&system).map_err(Failure::new)?;
    let name = |id| {
        system
            .body_of(id)
            .map_or("a body".into(), |body| format!("`{}`", loaded.scene.bodies[body].get_ref().name))
    };
    warn_of_coarse(&coarse, name, "use mode = \"exact\" under [detector]");
    let engine = match device {
        Some(device) => loaded.newton_with(system, device.into_detector()),
        None => loaded.newton(system),
    };
    let mut engine = engine.map_err(Failure::new)?;
    let mut live = args.view.then(|| follow(args, engine.system())).transpose()?;
    let bar = LiveProgress::new(interrupted);
    let mut recorder = Recorder::new(&output, &origin, earlier.as_ref());
    let watch = |moment: &Moment<'_>| {
        recorder.push(moment)?;
        if let Some(live) = &mut live {
            let frame = LiveFrame::from(moment);
            let shown = if moment.step == moment.steps { live.end(&frame) } else { live.show(&frame) };
            // The run goes on without its page.
            shown.unwrap_or_else(|e| report::warning(&e.to_string()));
        }
        bar.show(moment)
    };
    // On a thread of the pool: from outside, each parallel call would switch threads twice.
    let ended = rayon::scope(|_| simulate_from(&loaded.scene, &mut engine, begun, watch));
    drop(bar);
    let (record, summary) = ended.map_err(|e| recorder.failure(e, args.source()))?;
    recorder.finish(&record)?;
    warn_of(&summary, loaded.scene.detector.name());
    print(args, &summary)?;
    if live.is_some() {
        report::note("the run has ended; its page is served until Ctrl-C");
        while !interrupted.load(Ordering::Relaxed) {
            std::thread::sleep(Duration::from_millis(50));
        }
    }
    let is_refused = args.strict && !summary.warnings.is_empty();
    Ok(if is_refused || summary.passed == Some(false) { Outcome::NotGood } else { Outcome::Good })
}

/// Serves the page of the run.
fn follow(args: &Args, system: &System) -> Result<LiveView, Failure> {
    let title = args.source().file_stem().unwrap_or_default().to_string_lossy();
    let live = LiveView::open(system, &title).map_err(Failure::new)?;
    report::note(&format!("the run is shown at {}", live.url()));
    Ok(live)
}

fn open_interrupted(run: &Path) -> Result<InterruptedRun, Failure> {
    InterruptedRun::open(run).map_err(|e| match e {
        e @ RecordError::Complete { .. } => run_file::failure(run, e)
            .hint("there is nothing to resume; for a longer run, simulate the scene with --duration"),
        e => run_file::failure(run, e),
    })
}

/// The start of the run: the beginning of the scene, or the last step of an interrupted run.
/// `system` gets the states of this start.
fn begin(
    args: &Args,
    loaded: &LoadedScene,
    earlier: Option<&InterruptedRun>,
    system: &mut System,
    origin: &RunOrigin,
) -> Result<PartialRun, Failure> {
    let (Some(earlier), Some(resumed)) = (earlier, &args.resume) else {
        // The run stores the scene's folder, so its meshes are found from any folder.
        let scene = absolute(args.source())?;
        let folder = scene.parent().unwrap_or(&scene).to_string_lossy().into_owned();
        return Ok(PartialRun::new(&loaded.scene, system, folder));
    };
    earlier.check(&loaded.scene, origin).map_err(|e| {
        Failure::new(format!("cannot resume {}: {e}", resumed.display()))
            .hint("resume with the scene, options and geometries of the run, or simulate the scene from its beginning")
    })?;
    earlier.run.restore(system).map_err(|e| Failure::new(format!("{}: {e}", resumed.display())))?;
    Ok(earlier.run.clone())
}

/// The scene of the file, or of the run that is resumed.
fn read(
    args: &Args,
    earlier: Option<&InterruptedRun>,
    criteria: &Criteria,
    change: impl FnOnce(&mut LoadedScene) -> Result<(), Failure>,
) -> Result<LoadedScene, Failure> {
    if let (None, Some(earlier)) = (&args.scene, earlier) {
        let record = &earlier.run.record;
        return LoadedScene::of_run_with(record, args.source(), criteria).map_err(Failure::new);
    }
    let mut loaded = LoadedScene::read_with(args.source(), criteria).map_err(Failure::new)?;
    change(&mut loaded)?;
    Ok(loaded)
}

/// Replaces the values of the scene that the command line gives.
fn replace_values(loaded: &mut LoadedScene, args: &Args) -> Result<(), Failure> {
    let scene = &mut loaded.scene;
    scene.time_step = args.time_step.unwrap_or(scene.time_step);
    scene.duration = args.duration.unwrap_or(scene.duration);
    let given = [("--time-step", args.time_step), ("--duration", args.duration)];
    let given = given.iter().filter_map(|(option, value)| Some(format!("{option} {:?}", (*value)?)));
    let given: Vec<String> = given.collect();
    if !given.is_empty() {
        // The scene's own error would name a line of the file.
        scene.steps().map_err(|e| Failure::new(format!("{}: {e}", given.join(" "))))?;
    }
    if let Some(mode) = args.mode {
        scene.detector.choose(mode);
    }
    replace_geometries(loaded, &args.geometries, args.source())
}

/// Replaces the geometries of bodies. `file` is the file that the scene was read from, for
/// messages.
///
/// # Errors
/// A body does not exist, or there is no current folder.
pub fn replace_geometries(
    loaded: &mut LoadedScene,
    geometries: &[(String, PathBuf)],
    file: &Path,
) -> Result<(), Failure> {
    for (body, geometry) in geometries {
        // Paths in a scene are relative to its folder, but paths on the command line to the current
        // folder.
        if !loaded.replace_geometry(body, absolute(geometry)?) {
            return Err(Failure::new(format!("{}: there is no body {body}", file.display())));
        }
    }
    Ok(())
}

fn absolute(path: &Path) -> Result<PathBuf, Failure> {
    std::path::absolute(path).map_err(|e| Failure::new(format!("{}: {e}", path.display())))
}

/// A progress bar on stderr with the current state of the run.
struct LiveProgress<'a> {
    bar: ProgressBar,
    interrupted: &'a AtomicBool,
    begin: Instant,
}

impl<'a> LiveProgress<'a> {
    fn new(interrupted: &'a AtomicBool) -> Self {
        let bar = ProgressBar::new(1);
        if let Ok(style) = ProgressStyle::with_template("[{bar:24}] {percent:>3} %  {eta} left  {msg}") {
            bar.set_style(style.progress_chars("=> "));
        }
        Self { bar, interrupted, begin: Instant::now() }
    }

    fn show(&self, moment: &Moment<'_>) -> ControlFlow<()> {
        let Moment { step, steps, time, report, system, .. } = moment;
        self.bar.set_length(*steps);
        self.bar.set_position(*step);
        self.bar.set_message(format!(
            "{time:.3} s, {}, deepest {:.1e} m, kinetic energy {:.2e} J, {:.1} ms per step",
            report::count(report.contacts, "contact"),
            (-report.deepest.unwrap_or(0.0)).max(0.0),
            system.kinetic_energy(),
            self.begin.elapsed().as_secs_f64() * 1e3 / *step as f64
        ));
        match self.interrupted.load(Ordering::Relaxed) {
            true => ControlFlow::Break(()),
            false => ControlFlow::Continue(()),
        }
    }
}

impl Drop for LiveProgress<'_> {
    fn drop(&mut self) {
        self.bar.finish_and_clear();
    }
}

/// Prints the warnings, and a hint where vertices do not show an overlap.
fn warn_of(summary: &Summary, mode: DetectorMode) {
    summary.warnings.iter().for_each(|warning| report::warning(&warning.message));
    if !summary.hidden.is_empty() && mode == DetectorMode::Node {
        report::hint(
            "the mode `node` only tests vertices: use --mode face or --mode exact, or mesh the bodies more finely",
        );
    }
}

fn print(args: &Args, summary: &Summary) -> Result<(), Failure> {
    let [scene, output] = [args.source(), args.output()].map(|path| path.display().to_string());
    if args.json {
        return report::json(&Report { scene, output, summary });
    }
    let Summary { steps, seconds, .. } = summary;
    let mut rows = vec![
        ("run", format!("{output}, {} over {seconds} s", report::count(*steps as usize, "step"))),
        (
            "contacts",
            format!("{:.0} per step on average, at most {}", summary.mean_contacts, summary.most_contacts),
        ),
        ("penetration", format!("at most {:.1e} m, as detected", summary.deepest_penetration)),
        (
            "energy",
            format!(
                "{:.3e} J kinetic, from {:.3e} J released",
                summary.kinetic_energy, summary.released_energy
            ),
        ),
        (
            "solver",
            format!(
                "{:.1} iterations per step, {} not converged",
                summary.mean_iterations,
                report::count(summary.unconverged_steps as usize, "step")
            ),
        ),
        (
            "time",
            format!(
                "{:.2} ms per step for detection, {:.2} ms for the rest",
                summary.detection_ms, summary.solution_ms
            ),
        ),
    ];
    if let Some(drift) = summary.joint_drift {
        let [distance, angle] = [1e6 * drift.distance, 1e6 * drift.angle];
        rows.push(("joints", format!("apart by at most {distance:.2} µm and {angle:.2} µrad")));
    }
    rows.extend(criteria::rows(summary));
    report::table(&rows)
}
