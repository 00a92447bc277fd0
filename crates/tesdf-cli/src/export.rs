//! `tesdf export RUN -o run.glb`: a recorded run as an animated GLB file. `tesdf export FILE.tesdf
//! -o FILE.json`: an asset as JSON of TES-Encoder.
use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};
use std::slice;

use crate::terminal::asset_file;
use crate::terminal::interrupt;
use crate::terminal::output::{self, Consent};
use crate::terminal::parse;
use crate::terminal::report::{self, Failure, Outcome};
use tesdf_playback::{Frames, GlbOptions, Playback, glb};

use crate::open_run::{self, OpenRun};

/// Arguments of `tesdf export`.
#[derive(clap::Args, Debug)]
pub struct Args {
    /// The run, which `tesdf simulate` wrote; or a .tesdf file with a conforming domain
    #[arg(value_parser = parse::input())]
    pub run: PathBuf,
    /// Output GLB file, or JSON file of TES-Encoder for a .tesdf file; an existing file is replaced,
    /// a pipe or device is written to
    #[arg(short, long, value_name = "GLB", value_parser = parse::output())]
    pub output: PathBuf,
    /// Whether a read-only output is replaced.
    #[command(flatten)]
    pub consent: Consent,
    /// Which steps are played.
    #[command(flatten)]
    pub frames: FrameArgs,
    /// Seconds of the run in each second of the animation: 0.1 is slow motion
    #[arg(long, value_name = "FACTOR", value_parser = parse::factor, default_value = "1", allow_hyphen_values = true)]
    pub speed: f64,
    /// Replace the geometry of a body of the run by a .tesdf file, or by a mesh, which is encoded;
    /// `link*` are all bodies whose names begin with `link`; may be given several times
    #[arg(long = "geometry", value_name = "BODY=FILE", value_parser = crate::simulate::geometry)]
    pub geometries: Vec<(String, PathBuf)>,
}

/// Which steps of a run are played.
#[derive(clap::Args, Clone, Copy, Debug)]
pub struct FrameArgs {
    /// Take every N-th step, and the last one [default: so that there are at most 1000]
    #[arg(long, value_name = "N", conflicts_with = "fps")]
    pub every: Option<NonZeroUsize>,
    /// Take the steps nearest to this many times in each second of the run
    #[arg(long, value_name = "FRAMES", value_parser = parse::factor, allow_hyphen_values = true)]
    pub fps: Option<f64>,
}

impl FrameArgs {
    /// The chosen frames.
    pub fn frames(self) -> Frames {
        match (self.every, self.fps) {
            (Some(every), _) => Frames::Every(every),
            (None, Some(rate)) => Frames::PerSecond(rate),
            (None, None) => Frames::default(),
        }
    }
}

/// Writes the run as a GLB file, or the asset as JSON.
///
/// # Errors
/// The asset cannot be opened or has no conforming domain. The run or a geometry cannot be opened, a
/// state is not valid, or the file cannot be written.
pub fn run(args: &Args) -> Result<Outcome, Failure> {
    if has_extension(&args.run, "tesdf") {
        return asset_as_json(args);
    }
    let interrupted = interrupt::flag();
    let OpenRun { record, system, output, .. } =
        open_run::open(&args.run, &args.geometries, &args.output, args.consent, interrupted)?;
    let at = |e| Failure::new(format!("{}: {e}", args.run.display()));
    let run = Playback::new(&record, &system, args.frames.frames()).map_err(at)?;
    let bytes = glb(&run, &GlbOptions { speed: args.speed }).map_err(at)?;
    output::write(&output, &bytes)?;
    report::table(&[
        ("animation", args.output.display().to_string()),
        ("bodies", run.bodies.len().to_string()),
        ("frames", format!("{} of {} states", run.steps.len(), record.times().len())),
        ("size", format!("{:.2} MB", bytes.len() as f64 / 1e6)),
    ])?;
    Ok(Outcome::Good)
}

/// Writes an asset as JSON.
///
/// # Errors
/// The asset cannot be opened, it has no conforming domain, an option of runs is given, or the file
/// cannot be written.
fn asset_as_json(args: &Args) -> Result<Outcome, Failure> {
    let file = args.run.display();
    let is_of_runs = args.frames.every.is_some()
        || args.frames.fps.is_some()
        || args.speed != 1.0
        || !args.geometries.is_empty();
    if is_of_runs {
        return Err(Failure::new(format!(
            "{file}: --every, --fps, --speed and --geometry are for runs; leave them out for a .tesdf file"
        )));
    }
    let output = output::open(&args.output, slice::from_ref(&args.run), args.consent)?;
    if !has_extension(&args.output, "json") && !output.is_stdout() {
        let found = args.output.display();
        return Err(Failure::new(format!(
            "{found}: a .tesdf file is exported as JSON; expected a name in .json"
        ))
        .hint(format!("-o {}", args.output.with_extension("json").display())));
    }
    let asset = asset_file::open(&args.run)?;
    let bytes = asset.to_json_bytes().map_err(|e| Failure::new(format!("{file}: {e}")))?;
    output::write(&output, &bytes)?;
    report::table(&[
        ("JSON", args.output.display().to_string()),
        ("faces", asset.face_count().to_string()),
        ("size", format!("{:.2} MB", bytes.len() as f64 / 1e6)),
    ])?;
    Ok(Outcome::Good)
}

fn has_extension(path: &Path, extension: &str) -> bool {
    path.extension().is_some_and(|found| found.eq_ignore_ascii_case(extension))
}
