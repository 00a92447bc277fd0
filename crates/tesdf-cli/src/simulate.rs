//! `tesdf simulate SCENE -o RUN`, `tesdf simulate --resume RUN`
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use clap::ValueEnum;
use indicatif::{ProgressBar, ProgressStyle};
use serde::Serialize;
use tesdf::Progress;
use tesdf_sim::criterion::ScrewReport;
use tesdf_sim::record::RecordError;
use tesdf_sim::scene_file::{DetectorMode, LoadedScene, SceneError};
use tesdf_sim::{CutRun, HiddenPair, Moment, PartialRun, RunOrigin, Summary, System, simulate_from};

use tesdf_terminal::device::{self, Choice, Device};
use tesdf_terminal::output::{self, Consent};
use tesdf_terminal::progress::{interrupt_flag, watched};
use tesdf_terminal::report::{self, Failure, Outcome};
use tesdf_terminal::{parse, run_file};

mod recorder;

use recorder::Recorder;

/// Arguments of `tesdf simulate`.
#[derive(clap::Args, Debug)]
pub struct Args {
    /// A scene: TOML. With --resume it may be left out, and must be the scene of the run otherwise
    #[arg(required_unless_present = "resume")]
    pub scene: Option<PathBuf>,
    /// The file to write, safetensors; an existing one is replaced when the first step is made. Until the run is complete, it holds the steps
    /// so far. A pipe or device is written to at the end [default: with --resume, the run itself]
    #[arg(short, long, value_name = "RUN", required_unless_present = "resume")]
    pub output: Option<PathBuf>,
    /// Whether a read-only output is replaced.
    #[command(flatten)]
    pub consent: Consent,
    /// Go on with a run that was interrupted or killed, from its last whole step, to the same bytes as without the interruption
    #[arg(long, value_name = "RUN")]
    pub resume: Option<PathBuf>,
    /// Instead of the scene's time step, s
    #[arg(long, value_name = "SECONDS", value_parser = parse::length)]
    pub time_step: Option<f64>,
    /// Instead of the scene's duration, s
    #[arg(long, value_name = "SECONDS", value_parser = parse::length)]
    pub duration: Option<f64>,
    /// Instead of the scene's detector mode
    #[arg(long, value_enum)]
    pub mode: Option<Mode>,
    /// Instead of the geometry of a body: a .tesdf file, or a mesh that is encoded; may be given several times
    #[arg(long = "geometry", value_name = "BODY=FILE", value_parser = geometry)]
    pub geometries: Vec<(String, PathBuf)>,
    /// Where contacts are found
    #[arg(long, value_name = "DEVICE", value_parser = Choice::parse, default_value_t = Choice::Processor, help = device::help("contacts are found"))]
    pub device: Choice,
    /// Print the result as JSON
    #[arg(long)]
    pub json: bool,
}

/// What is tested against the other body's field.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Mode {
    /// The vertices
    Node,
    /// The faces, by Frank-Wolfe iterations
    Face,
    /// The faces, the exact minimum
    Exact,
    /// Nothing: bodies pass through each other, and a criterion should fail
    Off,
}

/// A body and its geometry from `BODY=FILE`.
///
/// # Errors
/// There is no `=`.
pub fn geometry(text: &str) -> Result<(String, PathBuf), String> {
    let (body, file) = text.split_once('=').ok_or("expected BODY=FILE")?;
    Ok((body.into(), file.into()))
}

/// What `--json` prints.
#[derive(Serialize)]
struct Report<'a> {
    scene: String,
    output: String,
    #[serde(flatten)]
    summary: &'a Summary,
}

impl Args {
    /// The file that says what the run is of; for messages.
    fn source(&self) -> &Path {
        self.scene.as_deref().or(self.resume.as_deref()).unwrap_or(Path::new(""))
    }

    fn output(&self) -> &Path {
        self.output.as_deref().or(self.resume.as_deref()).unwrap_or(Path::new(""))
    }
}

/// Runs a scene, or goes on with a run that was cut. The run is recorded step by step, and written as a complete run at the end.
///
/// # Errors
/// The scene cannot be loaded, the run was made with something else, a step failed, the file cannot be written, or Ctrl-C was pressed.
/// Before the first step the output file is as it was; after it, it holds the steps that were made. A run that does not meet the
/// scene's criterion is written, and is not good.
pub fn run(args: &Args) -> Result<Outcome, Failure> {
    let cut = args.resume.as_deref().map(open_cut).transpose()?;
    let loaded = load(args, cut.as_ref())?;
    let mut inputs = loaded.geometry_files();
    inputs.extend(args.scene.clone());
    let output = output::open(args.output(), &inputs, args.consent)?;
    let device = args.device.open()?;
    let interrupted = interrupt_flag()?;
    let progress = Progress::default();
    let system = watched(&progress, &interrupted, || loaded.system_watched(&progress));
    let mut system = system.map_err(|e| match e {
        SceneError::Cancelled => {
            Failure::new(format!("interrupted; {} is as it was", args.output().display()))
        }
        e => Failure::new(e),
    })?;
    let device_name = device.as_ref().map_or("cpu", Device::name);
    let origin = RunOrigin::of(&system, device_name).map_err(Failure::new)?;
    let begun = begin(args, &loaded, cut.as_ref(), &mut system, &origin)?;
    let engine = match device {
        Some(device) => loaded.newton_with(system, device.into_detector()),
        None => loaded.newton(system),
    };
    let mut engine = engine.map_err(Failure::new)?;
    let bar = LiveProgress::new(&interrupted);
    let mut recorder = Recorder::new(&output, &origin, cut.as_ref());
    let ended = simulate_from(&loaded.scene, &mut engine, begun, |moment| {
        recorder.push(moment)?;
        bar.show(moment)
    });
    drop(bar);
    let (record, summary) = ended.map_err(|e| recorder.failure(e, args.source()))?;
    recorder.finish(&record)?;
    warn_of(&summary.hidden, loaded.scene.detector.mode);
    print(args, &summary)?;
    Ok(if summary.passed == Some(false) { Outcome::NotGood } else { Outcome::Good })
}

fn open_cut(run: &Path) -> Result<CutRun, Failure> {
    CutRun::open(run).map_err(|e| match e {
        e @ RecordError::Complete { .. } => run_file::failure(run, e)
            .hint("there is nothing to resume; for a longer run, simulate the scene with --duration"),
        e => run_file::failure(run, e),
    })
}

/// The beginning of the run, where `system` then is: that of the scene, or the last step of the run that was cut.
fn begin(
    args: &Args,
    loaded: &LoadedScene,
    cut: Option<&CutRun>,
    system: &mut System,
    origin: &RunOrigin,
) -> Result<PartialRun, Failure> {
    let (Some(cut), Some(resumed)) = (cut, &args.resume) else {
        // So that the run finds its meshes, wherever it is read.
        let scene = absolute(args.source())?;
        let folder = scene.parent().unwrap_or(&scene).to_string_lossy().into_owned();
        return Ok(PartialRun::new(&loaded.scene, system, folder));
    };
    cut.check(&loaded.scene, origin).map_err(|e| {
        Failure::new(format!("cannot resume {}: {e}", resumed.display()))
            .hint("resume with the scene, options and geometries of the run, or simulate the scene from its beginning")
    })?;
    cut.run.restore(system).map_err(|e| Failure::new(format!("{}: {e}", resumed.display())))?;
    Ok(cut.run.clone())
}

/// The scene with what the command line replaces.
fn load(args: &Args, cut: Option<&CutRun>) -> Result<LoadedScene, Failure> {
    let loaded = match (&args.scene, cut) {
        (None, Some(cut)) => LoadedScene::of_run(&cut.run.record, args.source()),
        _ => LoadedScene::read(args.source()),
    };
    let mut loaded = loaded.map_err(Failure::new)?;
    let scene = &mut loaded.scene;
    scene.time_step = args.time_step.unwrap_or(scene.time_step);
    scene.duration = args.duration.unwrap_or(scene.duration);
    let given = [("--time-step", args.time_step), ("--duration", args.duration)];
    let given = given.iter().filter_map(|(option, value)| Some(format!("{option} {:?}", (*value)?)));
    let given: Vec<String> = given.collect();
    if !given.is_empty() {
        // The scene's error would name a line of the file.
        scene.steps().map_err(|e| Failure::new(format!("{}: {e}", given.join(" "))))?;
    }
    if let Some(mode) = args.mode {
        scene.detector.mode = match mode {
            Mode::Node => DetectorMode::Node,
            Mode::Face => DetectorMode::Face,
            Mode::Exact => DetectorMode::Exact,
            Mode::Off => DetectorMode::Off,
        };
    }
    replace_geometries(&mut loaded, &args.geometries, args.source())?;
    Ok(loaded)
}

/// Puts other geometry in the place of that of the scene's bodies; `file` is what the scene was read from.
///
/// # Errors
/// There is no such body, or no current folder.
pub fn replace_geometries(
    loaded: &mut LoadedScene,
    geometries: &[(String, PathBuf)],
    file: &Path,
) -> Result<(), Failure> {
    for (body, geometry) in geometries {
        // Paths of a scene are relative to its folder, those of a command to where it runs.
        if !loaded.replace_geometry(body, absolute(geometry)?) {
            return Err(Failure::new(format!("{}: there is no body {body}", file.display())));
        }
    }
    Ok(())
}

fn absolute(path: &Path) -> Result<PathBuf, Failure> {
    std::path::absolute(path).map_err(|e| Failure::new(format!("{}: {e}", path.display())))
}

/// A bar on stderr with what the run does now.
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
        bar.enable_steady_tick(Duration::from_millis(200));
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

/// Says which bodies overlapped although no contact showed it, and what to do next.
fn warn_of(hidden: &[HiddenPair], mode: DetectorMode) {
    hidden.iter().for_each(|pair| report::warning(&pair.message()));
    if !hidden.is_empty() && mode == DetectorMode::Node {
        report::hint(
            "the mode node tests vertices alone: use --mode face or --mode exact, or mesh the bodies more finely",
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
        ("penetration", format!("at most {:.1e} m, as the detection saw it", summary.deepest_penetration)),
        (
            "energy",
            format!(
                "{:.3e} J of motion, from {:.3e} J released",
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
    if let Some(screw) = &summary.screw {
        rows.extend(screw_rows(screw));
    }
    report::table(&rows)
}

fn screw_rows(screw: &ScrewReport) -> Vec<(&'static str, String)> {
    let mut rows = vec![
        (
            "screw",
            format!(
                "{:.4} mm and {:.4} turns, {:.1} µm apart at most",
                screw.travel * 1e3,
                screw.turns,
                screw.largest_pitch_error * 1e6
            ),
        ),
        (
            "acceleration",
            format!(
                "{:.3e} m/s², of an ideal screw {:.3e}; {:.1} % of its travel",
                screw.acceleration,
                screw.analytic_acceleration,
                100.0 * screw.travel_of_analytic
            ),
        ),
    ];
    rows.extend(screw.failures.iter().map(|failure| ("not met", failure.clone())));
    rows.push(("criterion", if screw.failures.is_empty() { "passed" } else { "not passed" }.into()));
    rows
}
