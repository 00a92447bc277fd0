//! `tesdf repair MESH -o FILE`: repairs a mesh.
use std::path::PathBuf;

use serde::Serialize;
use tesdf::mesh::{
    LoadReport, MeshFormat, RepairOptions, RepairReport, Repaired, ShellOrientation, TriangleMesh,
    WriteFormat, check, closing_tolerance, files, read_bytes, repair, repair_auto, write_bytes,
};

use crate::terminal::mesh_file::{self, CadArgs};
use crate::terminal::output::{self, Consent};
use crate::terminal::parse;
use crate::terminal::report::{self, Failure, Outcome};

/// Arguments of `tesdf repair`.
#[derive(clap::Args, Debug)]
pub struct Args {
    /// The mesh file.
    #[arg(help = mesh_file::MESH_HELP, value_parser = parse::mesh())]
    pub mesh: PathBuf,
    /// Output file: .ply (keeps every digit), .obj or .stl; an existing file is replaced. A pipe or
    /// device is written to, as PLY unless its name has another extension
    #[arg(short, long, value_name = "FILE", value_parser = parse::output())]
    pub output: PathBuf,
    /// Whether a read-only output is replaced.
    #[command(flatten)]
    pub consent: Consent,
    /// Try the repairs one after the other, and take the first that makes the mesh encodable: the
    /// default ones, --orient, --weld-tolerance auto, --fill-holes
    #[arg(long, conflicts_with_all = ["weld_tolerance", "orient", "fill_holes"])]
    pub auto: bool,
    /// Merge vertices that are closer than this, and close cracks up to this width, in the mesh's
    /// unit; `auto` takes the least of 1e-7 to 1e-4 of the diagonal that closes the cracks
    /// [default: merge bitwise equal positions only]
    #[arg(long, value_name = "T|auto", value_parser = weld, allow_hyphen_values = true)]
    pub weld_tolerance: Option<Weld>,
    /// Turn all closed shells outward, or inward where they are cavities, also shells that meet
    /// others and surfaces that are connected over edges with more than two faces
    #[arg(long)]
    pub orient: bool,
    /// Fill holes with triangles between their vertices: flat holes in their plane, others with the
    /// smallest folds and then the least area; MAX is the largest number of edges of a hole
    /// [default of MAX: no limit]
    #[arg(long, value_name = "MAX", num_args = 0..=1, default_missing_value = "all", value_parser = edges)]
    pub fill_holes: Option<u32>,
    /// Replace shells that overlap by the surface of their union: tesdf cannot do this; the message
    /// says what to do instead
    #[arg(long)]
    pub union: bool,
    /// How finely CAD files become triangles.
    #[command(flatten)]
    pub cad: CadArgs,
    /// Print the result as JSON
    #[arg(long)]
    pub json: bool,
}

/// A weld tolerance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Weld {
    /// A length, in the mesh's unit.
    Within(f64),
    /// The least one that closes the cracks.
    Auto,
}

/// Parses a length, or `auto`.
///
/// # Errors
/// The message says what was found.
pub fn weld(text: &str) -> Result<Weld, String> {
    match text {
        "auto" => Ok(Weld::Auto),
        _ => parse::length(text).map(Weld::Within),
    }
}

/// Parses a number of edges, or `all`.
///
/// # Errors
/// The message says what was found.
pub fn edges(text: &str) -> Result<u32, String> {
    match text.parse() {
        _ if text == "all" => Ok(u32::MAX),
        Ok(edges) if edges >= 3 => Ok(edges),
        _ => {
            Err("expected a number of edges, 3 or more, or nothing; give the mesh before this option".into())
        }
    }
}

/// The output of `--json`. All ids start from 0.
#[derive(Serialize)]
struct Report<'a> {
    file: String,
    output: String,
    load: &'a LoadReport,
    repair: &'a RepairReport,
    /// The flags that make the same changes.
    flags: String,
}

impl Args {
    fn options(&self, mesh: &TriangleMesh) -> RepairOptions {
        RepairOptions {
            weld_tolerance: match self.weld_tolerance {
                None => None,
                Some(Weld::Within(length)) => Some(length),
                Some(Weld::Auto) => closing_tolerance(mesh),
            },
            shells: if self.orient { ShellOrientation::All } else { ShellOrientation::Separate },
            fill_holes: self.fill_holes,
            ..RepairOptions::DEFAULT
        }
    }

    /// The repaired mesh, and the options that were used.
    fn repair(&self, mesh: &TriangleMesh) -> Result<(Repaired, RepairOptions), Failure> {
        let failed = |e| Failure::new(format!("{}: {e}", self.mesh.display()));
        if self.auto {
            if let Some(found) = repair_auto(mesh).map_err(failed)? {
                return Ok((found.repaired, found.options.unwrap_or_default()));
            }
            report::note("no repair makes the mesh encodable; only the default ones were made");
        }
        let options = self.options(mesh);
        Ok((repair(mesh, &options).map_err(failed)?, options))
    }
}

/// Repairs a mesh, writes it, and prints the changes and the remaining defects.
///
/// # Errors
/// The mesh cannot be read or has no valid face, or the result cannot be written.
pub fn run(args: &Args) -> Result<Outcome, Failure> {
    if args.union {
        return Err(Failure::new(format!("{}: --union: tesdf cannot unite shells", args.mesh.display())).hint(
            "encode the mesh as it is: shells that overlap count as one solid, and only distances inside it refer to \
             the walls within; or unite them in a program for solids, such as Manifold or Blender",
        ));
    }
    let output = output::open(&args.output, &files(&args.mesh), args.consent)?;
    // A wrong extension is reported before the work.
    let format = match args.output.extension() {
        None if output.file_path().is_none() => WriteFormat::Ply,
        _ => WriteFormat::of_path(&args.output).map_err(Failure::new)?,
    };
    let loaded = args.cad.read(&args.mesh)?;
    let (repaired, options) = args.repair(&loaded.mesh)?;
    let bytes = write_bytes(&repaired.mesh, format).map_err(Failure::new)?;
    output::write(&output, &bytes)?;
    let [file, output] = [&args.mesh, &args.output].map(|path| path.display().to_string());
    let found = &repaired.report;
    if args.json {
        let flags = options.to_string().trim_start().to_string();
        report::json(&Report { file, output: output.clone(), load: &loaded.report, repair: found, flags })?;
    } else {
        let text = mesh_file::describe(&args.mesh, &loaded.report);
        report::text(&format!("{text}{found}\nwritten to {output}\n"))?;
    }
    if !found.encodable {
        let as_read = check(&loaded.mesh);
        report::hint(&crate::check::next(
            crate::check::suggestion(&args.mesh, &loaded.mesh, &as_read).as_ref(),
        ));
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
