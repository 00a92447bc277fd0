//! `tesdf query FILE --points PTS.csv`: signed distances at points.
mod points;

use std::io::{self, IsTerminal};
use std::path::PathBuf;

use tesdf::input;

pub use points::{HEADER, PointsError, read, write};

use crate::terminal::asset_file;
use crate::terminal::parse;
use crate::terminal::progress::Bar;
use crate::terminal::report::{self, Failure, Outcome};

/// Arguments of `tesdf query`.
#[derive(clap::Args, Debug)]
pub struct Args {
    /// A .tesdf file
    #[arg(value_parser = parse::input())]
    pub file: PathBuf,
    /// CSV file with the columns x, y and z in the mesh's unit; other columns are ignored
    #[arg(long, value_name = "CSV", value_parser = parse::input())]
    pub points: PathBuf,
}

/// Number of points that are answered before their rows are written: enough work for all threads,
/// and some MB of text.
const CHUNK: usize = 1 << 15;

/// Reads the points, answers them in f64, and prints the rows in order. A point that is not finite
/// has a row without an answer.
///
/// # Errors
/// The asset or the points cannot be read, or stdout cannot be written. Errors in the points name
/// the line and column.
pub fn run(args: &Args) -> Result<Outcome, Failure> {
    if args.file == args.points && args.file.starts_with("/dev/stdin") {
        return Err(Failure::new("the asset and the points cannot both come from the standard input")
            .hint("give one of them as a file"));
    }
    let asset = asset_file::open(&args.file)?;
    let at = |e: &dyn std::fmt::Display| Failure::new(format!("{}: {e}", args.points.display()));
    let bytes = input::read(&args.points).map_err(|e| at(&e))?;
    let points =
        read(&bytes).map_err(|e| at(&e).hint("expected a CSV file whose header has the columns x, y, z"))?;
    // Rows on the terminal show the progress themselves.
    let bar = (!io::stdout().is_terminal()).then(|| Bar::new("querying"));
    report::result(HEADER.as_bytes())?;
    let mut rows = Vec::new();
    for (i, chunk) in points.chunks(CHUNK).enumerate() {
        rows.clear();
        write(&mut rows, chunk, &asset.query_batch(chunk))
            .map_err(|e| Failure::new(format!("cannot write the rows: {e}")))?;
        report::result(&rows)?;
        if let Some(bar) = &bar {
            bar.set((i * CHUNK + chunk.len()) as f64 / points.len() as f64);
        }
    }
    Ok(Outcome::Good)
}
