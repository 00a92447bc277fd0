//! `tesdf check MESH…`: reports the defects of meshes.
use std::path::{Path, PathBuf};

use serde::Serialize;
use tesdf::base::InsideRule;
use tesdf::mesh::{CheckReport, DefectKind, LoadReport, TriangleMesh, check, other_rules, repair_auto};
use tesdf_sim::MassProperties;

use crate::terminal::files::{self, Found, Solid};
use crate::terminal::mesh_file::{self, CadArgs};
use crate::terminal::parse;
use crate::terminal::report::{self, Failure, Outcome};

/// Arguments of `tesdf check`.
#[derive(clap::Args, Debug)]
pub struct Args {
    /// The mesh files.
    #[arg(value_name = "MESH", required = true, help = mesh_file::MESH_HELP, value_parser = parse::mesh())]
    pub meshes: Vec<PathBuf>,
    /// How finely CAD files become triangles.
    #[command(flatten)]
    pub cad: CadArgs,
    /// Print the result as JSON: an object, or of several files a list of them
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
    /// `null` when the mesh cannot be encoded.
    solid: Option<Solid>,
}

/// Reads and checks meshes, and prints the results.
///
/// # Errors
/// A mesh cannot be read, or stdout cannot be written.
pub fn run(args: &Args) -> Result<Outcome, Failure> {
    files::each(&args.meshes, args.json, |path| check_one(args, path))
}

fn check_one(args: &Args, path: &Path) -> Result<Found, Failure> {
    let loaded = args.cad.read(path)?;
    let (mesh, found) = (&loaded.mesh, check(&loaded.mesh));
    let way = suggestion(path, mesh, &found);
    let properties = || MassProperties::of_triangles((0..mesh.faces().len()).map(|face| mesh.triangle(face)));
    let solid = found.encodable.then(properties).and_then(Result::ok).map(Solid::of);
    let result = if args.json {
        let file = path.display().to_string();
        let suggestion = way.as_ref().map(|way| way.command.clone());
        report::to_json(&Report { file, load: &loaded.report, check: &found, suggestion, solid })? + "\n"
    } else {
        let unit = loaded.report.unit.as_ref().map_or(String::new(), |unit| format!(" {unit}"));
        let solid = solid.map_or(String::new(), |solid| report::columns(&solid.rows(&unit)));
        format!("{}{solid}{found}\n", mesh_file::describe(path, &loaded.report))
    };
    Ok(match found.encodable {
        true => Found { outcome: Outcome::Good, result, hint: None },
        false => Found { outcome: Outcome::NotGood, result, hint: Some(next(way.as_ref())) },
    })
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
