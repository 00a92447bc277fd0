//! `tesdf toi A.tesdf B.tesdf`: the time of impact of two moving bodies.
use serde::Serialize;
use tesdf::Length;
use tesdf::collide::{Clearance, Motion, TimeOfImpact, TimeOfImpactOptions, time_of_impact};

use crate::clearance::rows as clearance_rows;
use crate::collide::Bodies;
use crate::terminal::parse;
use crate::terminal::report::{self, Failure, Outcome};

/// Arguments of `tesdf toi`.
#[derive(clap::Args, Debug)]
pub struct Args {
    /// The two bodies.
    #[command(flatten)]
    pub bodies: Bodies,
    /// Velocity of A's origin, and angular velocity about it in radians; without it A rests
    #[arg(long, value_name = "\"vx vy vz wx wy wz\"", value_parser = parse::velocity, allow_hyphen_values = true)]
    pub velocity_a: Option<Motion>,
    /// Velocity and angular velocity of B
    #[arg(long, value_name = "\"vx vy vz wx wy wz\"", value_parser = parse::velocity, allow_hyphen_values = true)]
    pub velocity_b: Option<Motion>,
    /// Screw motion of A: a point and the direction of the axis, the angular speed in radians, and
    /// the travel along the axis per turn
    #[arg(long, value_name = "\"px py pz ax ay az omega pitch\"", value_parser = parse::screw, allow_hyphen_values = true, conflicts_with = "velocity_a")]
    pub screw_a: Option<Motion>,
    /// Screw motion of B
    #[arg(long, value_name = "\"px py pz ax ay az omega pitch\"", value_parser = parse::screw, allow_hyphen_values = true, conflicts_with = "velocity_b")]
    pub screw_b: Option<Motion>,
    /// Follow the motion from time 0 to this time
    #[arg(long, value_name = "T", value_parser = parse::number, allow_hyphen_values = true, default_value_t = TimeOfImpactOptions::default().end)]
    pub end: f64,
    /// Bodies touch when they are at most this far apart, in the meshes' unit [default: 1e-6 of the
    /// smaller body's diagonal]
    #[arg(long, value_name = "L", value_parser = parse::number, allow_hyphen_values = true)]
    pub tolerance: Option<f64>,
    /// Maximum number of steps of a pair of parts of the surfaces
    #[arg(long, value_name = "N", default_value_t = TimeOfImpactOptions::default().iterations)]
    pub iterations: u32,
    /// Print the result as a JSON object; its `verdict` is impact, free or undecided, and its `time`
    /// is null when the bodies do not touch or it is not known
    #[arg(long)]
    pub json: bool,
}

/// The output of `--json`.
#[derive(Serialize)]
struct Json {
    verdict: &'static str,
    /// Of the impact.
    time: Option<f64>,
    /// Up to this time, the bodies are apart.
    free_until: f64,
    end: f64,
    touches: bool,
    iterations: u32,
    /// At the impact, or where the verdict is undecided.
    #[serde(flatten)]
    clearance: Option<Clearance>,
}

/// Prints the time at which two bodies first touch.
///
/// # Errors
/// A file cannot be opened, an option is out of range, or stdout cannot be written.
pub fn run(args: &Args) -> Result<Outcome, Failure> {
    let mut options =
        TimeOfImpactOptions { end: args.end, iterations: args.iterations, ..Default::default() };
    if let Some(tolerance) = args.tolerance {
        options.tolerance = Length::Absolute(tolerance);
    }
    let motion_a = args.screw_a.or(args.velocity_a).unwrap_or_default();
    let motion_b = args.screw_b.or(args.velocity_b).unwrap_or_default();
    let (scene, [a, b]) = args.bodies.scene()?;
    let found = time_of_impact(&scene, a, b, motion_a, motion_b, &options).map_err(Failure::new)?;
    if args.json {
        report::json(&Json {
            verdict: found.verdict(),
            time: found.impact().map(|impact| impact.time),
            free_until: found.free_until(),
            end: args.end,
            touches: found.impact().is_some(),
            iterations: found.iterations(),
            clearance: found.clearance().copied(),
        })?;
        return Ok(Outcome::Good);
    }
    let (time, clearance) = match &found {
        TimeOfImpact::Free { end, .. } => {
            report::text(&format!("no impact up to time {end}\n"))?;
            return Ok(Outcome::Good);
        }
        TimeOfImpact::Impact(impact) => {
            let what = if impact.time == 0.0 { "at the start" } else { "they touch" };
            (("time", format!("{:e} ({what})", impact.time)), impact.clearance)
        }
        TimeOfImpact::Undecided(free) => {
            let what = "what comes then is not known; try a larger --iterations or --tolerance";
            (("free up to", format!("{:e} ({what})", free.time)), free.clearance)
        }
    };
    let mut rows = vec![time];
    rows.extend(clearance_rows(&clearance, [a, b]));
    rows.push(("steps", found.iterations().to_string()));
    report::table(&rows)?;
    Ok(Outcome::Good)
}
