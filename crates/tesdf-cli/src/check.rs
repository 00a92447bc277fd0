//! `tesdf check MESH`: reports the defects of a mesh.
use std::path::{Path, PathBuf};

use serde::Serialize;
use tesdf::mesh::{CheckReport, DefectKind, LoadReport, Topology, TriangleMesh, check, repair_auto};

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
    /// The command that makes the mesh work, found by trying; `null` when it works as it is.
    suggestion: Option<String>,
}

/// Reads and checks a mesh, and prints the result.
///
/// # Errors
/// The mesh cannot be read, or stdout cannot be written.
pub fn run(args: &Args) -> Result<Outcome, Failure> {
    let loaded = args.cad.read(&args.mesh)?;
    let found = check(&loaded.mesh);
    let way = suggestion(&args.mesh, &loaded.mesh, &found);
    if args.json {
        let file = args.mesh.display().to_string();
        let suggestion = way.as_ref().map(|way| way.command.clone());
        report::json(&Report { file, load: &loaded.report, check: &found, suggestion })?;
    } else {
        let text = mesh_file::describe(&args.mesh, &loaded.report);
        report::text(&format!("{text}{found}\n"))?;
    }
    if found.encodable {
        return Ok(Outcome::Good);
    }
    report::hint(&next(way.as_ref()));
    Ok(Outcome::NotGood)
}

/// A way on for a mesh that cannot be encoded as it is.
pub struct Suggestion {
    command: String,
    /// Whether the command repairs the mesh.
    repairs: bool,
}

/// What to do with a mesh that cannot be encoded.
pub fn next(way: Option<&Suggestion>) -> String {
    match way {
        Some(Suggestion { command, repairs: true }) => format!("{command} makes it encodable"),
        Some(Suggestion { command, repairs: false }) => {
            format!("no repair makes it encodable; {command} encodes it as it is")
        }
        None => "no repair makes it encodable; scale or move it in the program that made it".into(),
    }
}

/// The repair that makes a mesh encodable, or the rule for its inside that takes it as it is.
/// `None` when it is encodable, or no rule takes it.
pub fn suggestion(path: &Path, mesh: &TriangleMesh, found: &CheckReport) -> Option<Suggestion> {
    let out_of_range = found.defects.iter().any(|defect| defect.kind == DefectKind::OutOfRange);
    if found.encodable || out_of_range {
        return None;
    }
    let (name, stem) = (path.display(), path.with_extension(""));
    let stem = stem.file_name().unwrap_or_default().display();
    let repaired = repair_auto(mesh).ok().flatten().and_then(|found| found.options);
    let rule = match found.winding {
        Some([0, 0]) => "sheet --thickness T",
        Some(_) => "nonzero",
        None if Topology::new(mesh.faces()).is_closed() => "nonzero",
        None => "generalized",
    };
    let command = match repaired {
        Some(options) if path.extension().is_some_and(|e| e == "ply") => {
            format!("tesdf repair {name} -o {stem}-repaired.ply{options}")
        }
        Some(options) => format!("tesdf repair {name} -o {stem}.ply{options}"),
        None => format!("tesdf encode {name} -o {stem}.tesdf --inside {rule}"),
    };
    Some(Suggestion { command, repairs: repaired.is_some() })
}
