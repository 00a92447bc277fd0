//! `tesdf check MESH`: reports the defects of a mesh.
use std::path::{Path, PathBuf};

use serde::Serialize;
use tesdf::mesh::{CheckReport, LoadReport, Topology, TriangleMesh, check, repair_auto};

use tesdf_terminal::mesh_file;
use tesdf_terminal::report::{self, Failure, Outcome};

/// Arguments of `tesdf check`.
#[derive(clap::Args, Debug)]
pub struct Args {
    /// Mesh file: STL, OBJ, PLY, OFF, glTF or GLB
    pub mesh: PathBuf,
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
    let loaded = mesh_file::read(&args.mesh)?;
    let found = check(&loaded.mesh);
    let command = (!found.encodable).then(|| suggestion(&args.mesh, &loaded.mesh));
    if args.json {
        let file = args.mesh.display().to_string();
        let suggestion = command.as_ref().map(|found| found.command.clone());
        report::json(&Report { file, load: &loaded.report, check: &found, suggestion })?;
    } else {
        let text = mesh_file::describe(&args.mesh, &loaded.report);
        report::text(&format!("{text}{found}\n"))?;
    }
    let Some(command) = command else { return Ok(Outcome::Good) };
    report::hint(&command.text());
    Ok(Outcome::NotGood)
}

/// A way on for a mesh that cannot be encoded as it is.
struct Suggestion {
    command: String,
    /// Whether the command repairs the mesh.
    repairs: bool,
}

impl Suggestion {
    fn text(&self) -> String {
        match self.repairs {
            true => format!("{} makes it encodable", self.command),
            false => format!("no repair makes it encodable; {} encodes it as it is", self.command),
        }
    }
}

/// What to do with a mesh that cannot be encoded.
pub fn next(path: &Path, mesh: &TriangleMesh) -> String {
    suggestion(path, mesh).text()
}

/// The repair that makes the mesh encodable, or the rule for its inside that takes it as it is.
fn suggestion(path: &Path, mesh: &TriangleMesh) -> Suggestion {
    let (name, stem) = (path.display(), path.with_extension(""));
    let stem = stem.file_name().unwrap_or_default().display();
    let repaired = repair_auto(mesh).ok().flatten().and_then(|found| found.options);
    let command = match repaired {
        Some(options) if path.extension().is_some_and(|e| e == "ply") => {
            format!("tesdf repair {name} -o {stem}-repaired.ply{options}")
        }
        Some(options) => format!("tesdf repair {name} -o {stem}.ply{options}"),
        None if Topology::new(mesh.faces()).is_closed() => {
            format!("tesdf encode {name} -o {stem}.tesdf --inside nonzero")
        }
        None => format!("tesdf encode {name} -o {stem}.tesdf --inside generalized"),
    };
    Suggestion { command, repairs: repaired.is_some() }
}
