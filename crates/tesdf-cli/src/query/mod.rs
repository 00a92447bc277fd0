//! `tesdf query FILE --points PTS.csv`
mod points;

use std::fs::File;
use std::path::PathBuf;

use rayon::prelude::*;
use tesdf::glam::DVec3;

pub use points::{PointsError, read, write};

use crate::report::{self, Failure, Outcome};

/// Arguments of `tesdf query`.
#[derive(clap::Args, Debug)]
pub struct Args {
    /// A .tesdf file
    pub file: PathBuf,
    /// CSV file with the columns x, y and z in the mesh's unit; others are ignored
    #[arg(long, value_name = "CSV")]
    pub points: PathBuf,
}

/// What the surface closest to a point is like.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Answer {
    /// Signed distance, negative inside; mesh unit.
    pub signed_distance: f64,
    /// Unit gradient, outwards.
    pub gradient: DVec3,
    /// Closest point on the surface, mesh unit.
    pub closest: DVec3,
    /// Face of the closest point, 0-based.
    pub face: u32,
}

/// Reads the points, asks `answer` for each that is finite, from several threads, and prints the rows in order.
///
/// # Errors
/// The points cannot be read, naming line and column, or stdout cannot be written.
pub fn run(args: &Args, answer: impl Fn(DVec3) -> Option<Answer> + Sync) -> Result<Outcome, Failure> {
    let at = |e: &dyn std::fmt::Display| Failure::new(format!("{}: {e}", args.points.display()));
    let file = File::open(&args.points).map_err(|e| at(&e))?;
    let points =
        read(file).map_err(|e| at(&e).hint("expected a CSV file whose header has the columns x, y, z"))?;
    let answers: Vec<_> = points.par_iter().map(|&p| if p.is_finite() { answer(p) } else { None }).collect();
    let mut table = Vec::new();
    write(&mut table, &points, &answers).map_err(|e| Failure::new(format!("cannot write the rows: {e}")))?;
    report::result(&table)?;
    Ok(Outcome::Good)
}
