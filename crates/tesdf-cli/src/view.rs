//! `tesdf view RUN -o page.html`: a page that plays a recorded run in a browser.
use std::path::PathBuf;
use std::sync::atomic::AtomicBool;

use crate::terminal::interrupt;
use crate::terminal::output::{self, Consent};
use crate::terminal::parse;
use crate::terminal::progress::Bar;
use crate::terminal::report::{self, Failure, Outcome};
use tesdf::collide::CollideError;
use tesdf_playback::{Arrows, ContactOptions, FrameContacts, Playback, PlaybackError, page};

use crate::export::FrameArgs;
use crate::open_run::{self, OpenRun};

/// Arguments of `tesdf view`.
#[derive(clap::Args, Debug)]
pub struct Args {
    /// The run, which `tesdf simulate` wrote
    #[arg(value_parser = parse::input())]
    pub run: PathBuf,
    /// Output HTML file; an existing file is replaced, a pipe or device is written to
    #[arg(short, long, value_name = "HTML", value_parser = parse::output())]
    pub output: PathBuf,
    /// Whether a read-only output is replaced.
    #[command(flatten)]
    pub consent: Consent,
    /// Which steps are played.
    #[command(flatten)]
    pub frames: FrameArgs,
    /// Draw at most this many contacts in a frame, the deepest ones of each place, and as many
    /// recorded forces, the greatest ones; 0 draws none. Contacts that the run has not recorded are
    /// detected again
    #[arg(long, value_name = "N", default_value_t = ContactOptions::MOST)]
    pub contacts: usize,
    /// Heading of the page [default: the name of the run]
    #[arg(long)]
    pub title: Option<String>,
    /// Replace the geometry of a body of the run by a .tesdf file, or by a mesh, which is encoded;
    /// `link*` are all bodies whose names begin with `link`; may be given several times
    #[arg(long = "geometry", value_name = "BODY=FILE", value_parser = crate::simulate::geometry)]
    pub geometries: Vec<(String, PathBuf)>,
}

/// Writes a page that plays the run.
///
/// # Errors
/// The run or a geometry cannot be opened, a state is not valid, Ctrl-C was pressed, or the file
/// cannot be written.
pub fn run(args: &Args) -> Result<Outcome, Failure> {
    let interrupted = interrupt::flag();
    let opened = open_run::open(&args.run, &args.geometries, &args.output, args.consent, interrupted)?;
    let OpenRun { record, system, output, .. } = &opened;
    let at = |e: PlaybackError| match e {
        PlaybackError::Collide(CollideError::Stopped) => {
            Failure::new(format!("interrupted; {} is unchanged", args.output.display()))
        }
        e => Failure::new(format!("{}: {e}", args.run.display())),
    };
    let run = Playback::new(record, system, args.frames.frames()).map_err(at)?;
    let contacts = contacts(args, &opened, &run, interrupted).map_err(at)?;
    let forces = run.forces(args.contacts);
    let name = || args.run.file_stem().map(|name| name.to_string_lossy().into_owned());
    let title = args.title.clone().or_else(name).unwrap_or_default();
    let page = page(&run, Arrows { contacts: contacts.as_deref(), forces: forces.as_deref() }, &title)
        .map_err(at)?;
    output::write(output, page.as_bytes())?;
    let drawn = match &contacts {
        None => "none drawn".to_string(),
        Some(frames) => {
            let most = frames.iter().map(|frame| frame.found).max().unwrap_or(0);
            format!("at most {most} in a frame, of which {} are drawn", most.min(args.contacts))
        }
    };
    let pushing = match &forces {
        None => "none recorded".to_string(),
        Some(frames) => {
            format!("at most {} in a frame", frames.iter().map(|frame| frame.found).max().unwrap_or(0))
        }
    };
    report::table(&[
        ("page", args.output.display().to_string()),
        ("bodies", run.bodies.len().to_string()),
        ("frames", format!("{} of {} states", run.steps.len(), record.times().len())),
        ("contacts", drawn),
        ("forces", pushing),
        ("size", format!("{:.2} MB", page.len() as f64 / 1e6)),
    ])?;
    Ok(Outcome::Good)
}

/// The contacts of each frame; `None` when there are none to draw.
fn contacts(
    args: &Args,
    OpenRun { loaded, system, .. }: &OpenRun,
    run: &Playback<'_>,
    interrupted: &AtomicBool,
) -> Result<Option<Vec<FrameContacts>>, PlaybackError> {
    if args.contacts == 0 {
        return Ok(None);
    }
    let bar = Bar::new("contacts");
    let options = ContactOptions { detection: loaded.detection(system), most: args.contacts };
    run.contacts(system, &options, interrupted, |done| bar.set(done as f64 / run.steps.len() as f64))
}
