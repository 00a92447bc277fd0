//! `tesdf import FILE.json -o FILE.tesdf`: an asset of a JSON file of TES-Encoder.
use std::path::PathBuf;
use std::slice;

use tesdf::TeSdf;
use tesdf::encode::ImportJsonError;

use crate::terminal::output::{self, Consent};
use crate::terminal::parse;
use crate::terminal::report::{self, Failure, Outcome};

/// Arguments of `tesdf import`.
#[derive(clap::Args, Debug)]
pub struct Args {
    /// A JSON file of TES-Encoder, the program of the paper's authors
    ///
    /// The surface and the tetrahedra are checked: they must conform to each other, and each
    /// tetrahedron must be on the side of its group. The lists stay as they are. Nothing is proved
    /// of them, until `tesdf verify --prove` proves every cell or shows where a list misses a face.
    #[arg(value_parser = parse::input())]
    pub file: PathBuf,
    /// Output .tesdf file; an existing file is replaced, a pipe or device is written to
    #[arg(short, long, value_name = "FILE", value_parser = parse::output())]
    pub output: PathBuf,
    /// Whether a read-only output is replaced.
    #[command(flatten)]
    pub consent: Consent,
}

/// Imports the file.
///
/// # Errors
/// The file cannot be read, a value in it does not fit, the tetrahedra do not conform to the
/// surface, or the output cannot be written.
pub fn run(args: &Args) -> Result<Outcome, Failure> {
    let output = output::open(&args.output, slice::from_ref(&args.file), args.consent)?;
    let asset = TeSdf::import_json(&args.file).map_err(|e| match e {
        ImportJsonError::Read { .. } => Failure::new(e),
        _ => Failure::new(format!("{}: {e}", args.file.display())),
    })?;
    output::write(&output, &asset.to_bytes().map_err(Failure::new)?)?;
    let statistics = &asset.about().statistics;
    let mean = statistics.entries as f64 / statistics.listed_cells as f64;
    report::table(&[
        ("asset", args.output.display().to_string()),
        ("faces", statistics.faces.to_string()),
        ("tetrahedra", statistics.listed_cells.to_string()),
        ("mean list", format!("{mean:.1} faces, longest {}", statistics.longest_list)),
        (
            "exact",
            "not proven; `tesdf verify --prove` proves the lists or finds those that miss a face".into(),
        ),
    ])?;
    Ok(Outcome::Good)
}
