//! `tesdf-lab batch`: times batch queries at the points of a file.
use std::hint::black_box;
use std::path::PathBuf;

use rayon::ThreadPoolBuilder;
use serde_json::json;
use tesdf::TeSdf;
use tesdf::glam::DVec3;
use tesdf::query::Precision;

use super::timing::best_pass;
use super::{Failure, output};

/// Arguments of `tesdf-lab batch`.
#[derive(clap::Args)]
pub struct Args {
    /// A .tesdf file
    asset: PathBuf,
    /// A file of points: x y z of each point as little-endian f64
    points: PathBuf,
    /// Number of threads
    #[arg(long, default_value_t = 1)]
    threads: usize,
}

/// Prints the time of `query_batch` over all points for each precision, in seconds: the best of
/// several passes.
pub fn run(args: &Args) -> Result<(), Failure> {
    let asset = TeSdf::open(&args.asset)?;
    let at = |e: &dyn std::fmt::Display| Failure::from(format!("{}: {e}", args.points.display()));
    let bytes = std::fs::read(&args.points).map_err(|e| at(&e))?;
    let (rows, rest) = bytes.as_chunks::<24>();
    if !rest.is_empty() {
        return Err(at(&format!("{} bytes; expected a multiple of 24, three f64 per point", bytes.len())));
    }
    let coordinate = |row: &[u8; 24], axis: usize| {
        let mut bytes = [0; 8];
        bytes.copy_from_slice(&row[8 * axis..8 * axis + 8]);
        f64::from_le_bytes(bytes)
    };
    let points: Vec<DVec3> =
        rows.iter().map(|row| DVec3::from_array([0, 1, 2].map(|axis| coordinate(row, axis)))).collect();
    let pool = ThreadPoolBuilder::new().num_threads(args.threads).build()?;
    let seconds = |precision| {
        pool.install(|| {
            best_pass(|| {
                black_box(asset.query_batch_with(black_box(&points), precision));
            })
        })
    };
    let (f32, f64) = (seconds(Precision::F32), seconds(Precision::F64));
    output::line(
        &json!({ "f32": f32, "f64": f64, "threads": args.threads, "points": points.len() }).to_string(),
    )
}
