//! `tesdf check MESH`
use std::path::PathBuf;

use serde::Serialize;
use tesdf::mesh::{CheckReport, LoadReport, check};

use crate::mesh_file;
use crate::report::{self, Failure, Outcome};

/// Arguments of `tesdf check`.
#[derive(clap::Args, Debug)]
pub struct Args {
    /// Mesh: STL, OBJ, PLY, OFF, glTF or GLB
    pub mesh: PathBuf,
    /// Print the result as JSON
    #[arg(long)]
    pub json: bool,
}

/// What `--json` prints; all ids are 0-based.
#[derive(Serialize)]
struct Report<'a> {
    file: String,
    load: &'a LoadReport,
    check: &'a CheckReport,
}

/// Reads and checks a mesh and prints what was found.
///
/// # Errors
/// The mesh cannot be read, or stdout cannot be written.
pub fn run(args: &Args) -> Result<Outcome, Failure> {
    let loaded = mesh_file::read(&args.mesh)?;
    let found = check(&loaded.mesh);
    if args.json {
        let file = args.mesh.display().to_string();
        report::json(&Report { file, load: &loaded.report, check: &found })?;
    } else {
        let text = mesh_file::describe(&args.mesh, &loaded.report);
        report::result(format!("{text}{found}\n").as_bytes())?;
    }
    if found.encodable {
        return Ok(Outcome::Good);
    }
    report::hint(&format!("tesdf repair {} -o FILE.ply mends what needs no guessing", args.mesh.display()));
    Ok(Outcome::NotGood)
}
