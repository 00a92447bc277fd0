//! `tesdf check MESH`
use std::path::PathBuf;

use serde::Serialize;
use tesdf::mesh::{CheckReport, LoadReport, RepairOptions, TriangleMesh, check, repair};

use tesdf_terminal::mesh_file;
use tesdf_terminal::report::{self, Failure, Outcome};

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
        report::text(&format!("{text}{found}\n"))?;
    }
    if found.encodable {
        return Ok(Outcome::Good);
    }
    report::hint(&next(args, &loaded.mesh));
    Ok(Outcome::NotGood)
}

/// What to do about a mesh that is not encodable: `tesdf repair`, where that changes something.
fn next(args: &Args, mesh: &TriangleMesh) -> String {
    let command = format!("tesdf repair {} -o FILE.ply", args.mesh.display());
    match repair(mesh, &RepairOptions::default()) {
        Ok(repaired) if repaired.report.encodable => format!("{command} makes it encodable"),
        Ok(repaired) if repaired.report.changes_something() => {
            format!("{command} mends a part of it; mend the rest where the mesh was made")
        }
        _ => format!(
            "nothing of it can be mended without guessing: mend the mesh where it was made; where cracks are open, {command} \
             --weld-tolerance T closes those up to T wide"
        ),
    }
}
