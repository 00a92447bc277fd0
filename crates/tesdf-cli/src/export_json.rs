//! `tesdf export FILE.tesdf -o FILE.json`: an asset as JSON of TES-Encoder.
use std::slice;

use crate::export::Args;
use crate::terminal::report::{self, Failure, Outcome};
use crate::terminal::{asset_file, output};

/// Writes the asset.
///
/// # Errors
/// The asset cannot be opened, it has no conforming domain, an option of runs is given, or the file
/// cannot be written.
pub fn run(args: &Args) -> Result<Outcome, Failure> {
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
    if !args.output.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("json")) {
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
