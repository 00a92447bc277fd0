//! `tesdf clearance A.tesdf B.tesdf`: the distance or overlap of two bodies.
use tesdf::Length;
use tesdf::collide::{Clearance, ClearanceOptions, InstanceId, clearance};

use crate::collide::Bodies;
use crate::terminal::parse;
use crate::terminal::report::{self, Failure, Outcome};

/// Arguments of `tesdf clearance`.
#[derive(clap::Args, Debug)]
pub struct Args {
    /// The two bodies.
    #[command(flatten)]
    pub bodies: Bodies,
    /// Maximum error, in the meshes' unit [default: 1e-8 of the smaller body's diagonal]
    #[arg(long, value_name = "T", value_parser = parse::number, allow_hyphen_values = true)]
    pub tolerance: Option<f64>,
    /// Print the result as a JSON object
    #[arg(long)]
    pub json: bool,
}

/// Prints the clearance of two bodies.
///
/// # Errors
/// A file cannot be opened, an option is out of range, or stdout cannot be written.
pub fn run(args: &Args) -> Result<Outcome, Failure> {
    let mut options = ClearanceOptions::default();
    if let Some(tolerance) = args.tolerance {
        options.tolerance = Length::Absolute(tolerance);
    }
    let (scene, [a, b]) = args.bodies.scene()?;
    let found = clearance(&scene, a, b, &options).map_err(Failure::new)?;
    if args.json {
        report::json(&found)?;
    } else {
        report::table(&rows(&found, [a, b]))?;
    }
    Ok(Outcome::Good)
}

/// The table that users see of a clearance.
pub fn rows(found: &Clearance, [a, b]: [InstanceId; 2]) -> Vec<(&'static str, String)> {
    let what = match (found.distance < 0.0, found.overlap) {
        (true, _) => "they overlap",
        (false, true) => "they overlap: their surfaces coincide, with both bodies on the same side",
        (false, false) if found.distance == 0.0 => "they touch",
        (false, false) => "apart",
    };
    let normal = found.normal;
    let mut rows = vec![
        ("clearance", format!("{:e} ({what})", found.distance)),
        ("point on a", format!("({}) of face {a}:{}", report::point(found.point_a), found.face_a)),
        ("point on b", format!("({}) of face {b}:{}", report::point(found.point_b), found.face_b)),
        ("normal from b to a", format!("({:.6} {:.6} {:.6})", normal.x, normal.y, normal.z)),
        ("field", format!("instance {}", found.field)),
    ];
    if !found.converged {
        let at_least = found.lower_bound;
        rows.push((
            "accuracy",
            format!("not within the tolerance, but the clearance is at least {at_least:e}"),
        ));
    }
    rows
}
