//! `tesdf repair MESH -o FILE`: repairs a mesh.
use std::path::PathBuf;

use serde::Serialize;
use tesdf::mesh::{
    LoadReport, MeshFormat, RepairOptions, RepairReport, WriteFormat, check, files, read_bytes, repair,
    write_bytes,
};

use tesdf_terminal::mesh_file::{self, CadArgs};
use tesdf_terminal::output::{self, Consent};
use tesdf_terminal::parse;
use tesdf_terminal::report::{self, Failure, Outcome};

/// Arguments of `tesdf repair`.
#[derive(clap::Args, Debug)]
pub struct Args {
    /// The mesh file.
    #[arg(help = mesh_file::MESH_HELP)]
    pub mesh: PathBuf,
    /// Output file: .ply (keeps every digit), .obj or .stl; an existing file is replaced. A pipe or
    /// device is written to, as PLY unless its name has another extension
    #[arg(short, long, value_name = "FILE")]
    pub output: PathBuf,
    /// Whether a read-only output is replaced.
    #[command(flatten)]
    pub consent: Consent,
    /// Merge vertices that are closer than this, and close cracks up to this width, in the mesh's
    /// unit [default: merge bitwise equal positions only]
    #[arg(long, value_name = "T", value_parser = parse::length, allow_hyphen_values = true)]
    pub weld_tolerance: Option<f64>,
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
    output: String,
    load: &'a LoadReport,
    repair: &'a RepairReport,
}

/// Repairs a mesh, writes it, and prints the changes and the remaining defects.
///
/// # Errors
/// The mesh cannot be read or has no valid face, or the result cannot be written.
pub fn run(args: &Args) -> Result<Outcome, Failure> {
    let output = output::open(&args.output, &files(&args.mesh), args.consent)?;
    // A wrong extension is reported before the work.
    let format = match args.output.extension() {
        None if output.file_path().is_none() => WriteFormat::Ply,
        _ => WriteFormat::of_path(&args.output).map_err(Failure::new)?,
    };
    let loaded = args.cad.read(&args.mesh)?;
    let options = RepairOptions { weld_tolerance: args.weld_tolerance, ..RepairOptions::DEFAULT };
    let repaired =
        repair(&loaded.mesh, &options).map_err(|e| Failure::new(format!("{}: {e}", args.mesh.display())))?;
    let bytes = write_bytes(&repaired.mesh, format).map_err(Failure::new)?;
    output::write(&output, &bytes)?;
    let [file, output] = [&args.mesh, &args.output].map(|path| path.display().to_string());
    let found = &repaired.report;
    if args.json {
        report::json(&Report { file, output: output.clone(), load: &loaded.report, repair: found })?;
    } else {
        let text = mesh_file::describe(&args.mesh, &loaded.report);
        report::text(&format!("{text}{found}\nwritten to {output}\n"))?;
    }
    if !found.encodable {
        report::hint(match args.weld_tolerance {
            None => "--weld-tolerance T merges vertices up to T apart and closes cracks up to T",
            Some(_) => "repair the rest in the program that made the mesh, or try another --weld-tolerance",
        });
        return Ok(Outcome::NotGood);
    }
    if !format.is_exact() {
        // Rounding may close or open the mesh after the repair.
        let rounded =
            read_bytes(&bytes, MeshFormat::Stl).map_err(|e| Failure::new(format!("{output}: {e}")))?;
        if !check(&rounded.mesh).encodable {
            report::warning(&format!(
                "{output}: not encodable, because the format rounds coordinates to 32 bits"
            ));
            report::hint("write .ply, which keeps every digit");
            return Ok(Outcome::NotGood);
        }
    }
    Ok(Outcome::Good)
}
