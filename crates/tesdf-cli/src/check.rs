//! `tesdf check MESH`: reports the defects of a mesh.
use std::path::{Path, PathBuf};

use serde::Serialize;
use tesdf::base::InsideRule;
use tesdf::mesh::{CheckReport, DefectKind, LoadReport, TriangleMesh, check, other_rules, repair_auto};

use crate::terminal::mesh_file::{self, CadArgs};
use crate::terminal::report::{self, Failure, Outcome};

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
    does: Does,
}

/// What the command of a suggestion does.
enum Does {
    /// It repairs the mesh.
    Repair,
    /// It encodes the mesh under another rule.
    Encode,
    /// It encodes the mesh as a sheet of a thickness that is not known.
    EncodeSheet,
}

/// What to do with a mesh that cannot be encoded.
pub fn next(way: Option<&Suggestion>) -> String {
    let Some(Suggestion { command, does }) = way else {
        return "no repair makes it encodable; scale or move it in the program that made it".into();
    };
    match does {
        Does::Repair => format!("{command} makes it encodable"),
        Does::Encode => format!("no repair makes it encodable; {command} encodes it as it is"),
        Does::EncodeSheet => format!(
            "no repair makes it encodable, and it encloses nothing; {command} encodes its faces as sheets: give the \
             thickness of the part in place of this one, which is some 1 % of the diagonal"
        ),
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
    if let Some(options) = repair_auto(mesh).ok().flatten().and_then(|found| found.options) {
        let suffix = if path.extension().is_some_and(|e| e == "ply") { "-repaired" } else { "" };
        let command = format!("tesdf repair {name} -o {stem}{suffix}.ply{options}");
        return Some(Suggestion { command, does: Does::Repair });
    }
    let (rule, does) = match *other_rules(mesh, found).first()? {
        InsideRule::Sheet { thickness } => (format!("sheet --thickness {thickness}"), Does::EncodeSheet),
        rule => (rule.name().to_string(), Does::Encode),
    };
    Some(Suggestion { command: format!("tesdf encode {name} -o {stem}.tesdf --inside {rule}"), does })
}
