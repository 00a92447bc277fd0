//! `tesdf-lab screw`: a nut on a bolt.
use std::ops::ControlFlow;
use std::path::PathBuf;

use tesdf::Length;
use tesdf::collide::{ClearanceOptions, CollideError, clearance};
use tesdf_sim::criterion::{ScrewCriterion, ScrewReport};
use tesdf_sim::scene_file::{DetectorMode, LoadedScene};
use tesdf_sim::{Moment, Summary, System, simulate};

use super::{Failure, heading, output};
use tesdf_cli::terminal::parse;

/// Arguments of `tesdf-lab screw`.
#[derive(clap::Args)]
pub struct Args {
    /// A scene file with the criterion `screw`
    scene: PathBuf,
    /// Geometries of the turning body, one run for each: mesh or .tesdf files [default: the
    /// geometry of the scene]
    #[arg(long, value_name = "FILE", num_args = 1..)]
    geometries: Vec<PathBuf>,
    /// Backlash of each geometry along the axis, µm, in place of the criterion's
    #[arg(long, value_name = "UM", value_delimiter = ',', requires = "geometries")]
    backlash: Vec<f64>,
    /// Time steps, ms
    #[arg(long, value_name = "MS", value_delimiter = ',', default_value = "1,3,5")]
    time_steps: Vec<f64>,
    /// Detector modes
    #[arg(long, value_parser = parse::named::<DetectorMode>(), value_delimiter = ',', default_value = "node,face,exact")]
    modes: Vec<DetectorMode>,
    /// Numbers of re-detections
    #[arg(long, value_name = "N", value_delimiter = ',', default_value = "0,1,2")]
    redetections: Vec<u32>,
    /// Duration, s, in place of the scene's
    #[arg(long, value_name = "SECONDS")]
    duration: Option<f64>,
    /// Number of measurements of the penetration during a run
    #[arg(long, value_name = "N", default_value_t = 10)]
    measurements: u64,
}

const COLUMNS: [&str; 15] = [
    "body",
    "step, ms",
    "mode",
    "re-detections",
    "contacts",
    "penetration, µm",
    "as detected, µm",
    "travel, mm",
    "turns",
    "from pitch, µm",
    "of ideal travel",
    "of ideal acceleration",
    "energy kept",
    "detection + solution, ms per step",
    "criterion",
];

pub fn run(args: &Args) -> Result<(), Failure> {
    heading::print()?;
    output::line(
        "- *Penetration*: by the exact clearance of the bodies (to 10 nm) at times spread over the run, not by the detector \
         under test.\n\
         - *From pitch*: the largest difference between travel and turns × pitch.\n\
         - *Ideal*: the frictionless screw without play, with a = g / (1 + (k_z / (p / 2π))²). k_z is the nut's radius \
         of gyration, p the pitch.\n",
    )?;
    output::head(&COLUMNS, 1)?;
    let mut loaded = LoadedScene::read(&args.scene)?;
    loaded.scene.duration = args.duration.unwrap_or(loaded.scene.duration);
    loaded.scene.record.contacts_every = 0;
    let screw = loaded.scene.criterion.get::<ScrewCriterion>();
    let screw = screw.ok_or_else(|| format!("{}: it has no criterion.screw", args.scene.display()))?;
    let scenes = match args.geometries.is_empty() {
        true => vec![(screw.body.clone(), loaded.clone())],
        false => args
            .geometries
            .iter()
            .map(|file| with_geometry(&loaded, &screw.body, file.clone()))
            .collect::<Result<_, _>>()?,
    };
    if !args.backlash.is_empty() && args.backlash.len() != scenes.len() {
        return Err(format!("{} backlashes for {} geometries", args.backlash.len(), scenes.len()).into());
    }
    for (k, (name, mut loaded)) in scenes.into_iter().enumerate() {
        if let Some(play) = args.backlash.get(k) {
            loaded.scene.criterion.set(ScrewCriterion { backlash: play * 1e-6, ..screw.clone() });
        }
        let system = loaded.system()?;
        for &mode in &args.modes {
            loaded.scene.detector.choose(mode);
            for (&step, &redetections) in
                args.time_steps.iter().flat_map(|step| args.redetections.iter().map(move |n| (step, n)))
            {
                loaded.scene.time_step = step * 1e-3;
                loaded.scene.solver.redetections = redetections;
                let start = [name.clone(), step.to_string(), mode.to_string()];
                let (summary, depth) = one(&loaded, system.clone(), args.measurements)?;
                print(start.into_iter().chain([redetections.to_string()]), &summary, depth)?;
            }
        }
    }
    Ok(())
}

fn with_geometry(loaded: &LoadedScene, body: &str, file: PathBuf) -> Result<(String, LoadedScene), Failure> {
    let mut loaded = loaded.clone();
    let name = file.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    let file = std::path::absolute(file)?;
    for section in loaded.scene.bodies.iter_mut().map(|b| b.get_mut()).filter(|b| b.name == body) {
        (section.asset, section.mesh) = match file.extension().is_some_and(|e| e == "tesdf") {
            true => (Some(file.clone()), None),
            false => (None, Some(file.clone())),
        };
    }
    Ok((name, loaded))
}

/// Runs the scene. Returns its summary and the greatest penetration at the measurements, m.
fn one(loaded: &LoadedScene, system: System, measurements: u64) -> Result<(Summary, f64), Failure> {
    let mut engine = loaded.newton(system)?;
    let (mut depth, mut failure) = (0.0_f64, None);
    let (_, summary) = simulate(&loaded.scene, &mut engine, |moment: &Moment<'_>| {
        let part = |step: u64| step * measurements / moment.steps;
        if part(moment.step) != part(moment.step - 1) {
            // The error is returned after the run.
            match penetration(moment.system) {
                Ok(deeper) => depth = depth.max(deeper),
                Err(e) => failure = Some(e),
            }
        }
        ControlFlow::Continue(())
    })?;
    failure.map_or(Ok((summary, depth)), |e| Err(e.into()))
}

fn print(start: impl Iterator<Item = String>, summary: &Summary, depth: f64) -> Result<(), Failure> {
    let Some(screw) = summary.report::<ScrewReport>() else { return Err("the run has no screw".into()) };
    let rest = [
        format!("{:.0}", summary.mean_contacts),
        format!("{:.2}", depth * 1e6),
        format!("{:.2}", summary.deepest_penetration * 1e6),
        format!("{:.4}", screw.travel * 1e3),
        format!("{:.4}", screw.turns),
        format!("{:.1}", screw.largest_pitch_error * 1e6),
        format!("{:.3}", screw.travel_of_analytic),
        format!("{:.3}", screw.acceleration / screw.analytic_acceleration),
        format!("{:.3}", screw.energy),
        format!("{:.2} + {:.2}", summary.detection_ms, summary.solution_ms),
        if screw.failures.is_empty() { "met".into() } else { screw.failures.join("; ") },
    ];
    output::row(&start.chain(rest).collect::<Vec<_>>())
}

/// Tolerance of a penetration: 10 nm.
const TOLERANCE: Length = Length::Absolute(1e-8);

/// The greatest overlap of any two bodies by their exact clearance, m; 0 when none overlap.
fn penetration(system: &System) -> Result<f64, CollideError> {
    let scene = system.scene();
    let bodies = system.bodies();
    let mut depth = 0.0_f64;
    for (i, a) in bodies.iter().enumerate() {
        for b in &bodies[i + 1..] {
            let found = clearance(scene, a.instance, b.instance, &ClearanceOptions { tolerance: TOLERANCE })?;
            depth = depth.max(-found.distance);
        }
    }
    Ok(depth)
}
