//! `tesdf check MESH`: reports the defects of a mesh.
use std::path::PathBuf;

use serde::Serialize;
use tesdf::mesh::{CheckReport, LoadReport, RepairOptions, TriangleMesh, check, repair};

use tesdf_terminal::mesh_file::{self, CadArgs};
use tesdf_terminal::report::{self, Failure, Outcome};

/// Arguments of `tesdf check`.
#[derive(clap::Args, Debug)]
pub struct Args {
    /// The mesh file.
    #[arg(help = mesh_file::MESH_HELP)]
    pub mesh: PathBuf,
    /// How finely CAD files become triangles.
    #[command(flatten)]
    pub cad: CadArgs,
    /// Print the result as JSON
    #[arg(long)]
    pub json: bool,
}

/// The output of `--json`. All ids start from 0.
#[derive(Serialize)]
struct Report<'a> {
    file: String,
    load: &'a LoadReport,
    check: &'a CheckReport,
}

/// Reads and checks a mesh, and prints the result.
///
/// # Errors
/// The mesh cannot be read, or stdout cannot be written.
pub fn run(args: &Args) -> Result<Outcome, Failure> {
    let loaded = args.cad.read(&args.mesh)?;
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

/// The hint for a mesh that cannot be encoded: `tesdf repair`, if it changes something.
fn next(args: &Args, mesh: &TriangleMesh) -> String {
    let command = format!("tesdf repair {} -o FILE.ply", args.mesh.display());
    match repair(mesh, &RepairOptions::default()) {
        Ok(repaired) if repaired.report.encodable => format!("{command} makes it encodable"),
        Ok(repaired) if repaired.report.changes_something() => {
            format!("{command} repairs a part of it; repair the rest in the program that made the mesh")
        }
        _ => format!(
            "the mesh cannot be repaired without guessing: repair it in the program that made it, or close cracks up to a width \
             T with {command} --weld-tolerance T"
        ),
    }
}
