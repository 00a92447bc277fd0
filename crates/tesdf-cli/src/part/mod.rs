//! `tesdf part NAME -o FILE`: makes the mesh of a machine part.
use std::path::{Path, PathBuf};

use clap::{Subcommand, ValueEnum};
use serde::Serialize;
use tesdf::glam::DVec3;
use tesdf::mesh::{MeshFormat, WriteFormat, check, read_bytes, write_bytes};
use tesdf::{SolidMesh, TriangleMesh};
use tesdf_parts::{PartError, Resolution};
use tesdf_sim::MassProperties;

use crate::terminal::output::{self, Consent};
use crate::terminal::parse;
use crate::terminal::report::{self, Failure, Outcome, count};

mod fasteners;
mod fits;
mod grasp;
mod transmission;

/// Arguments of `tesdf part`.
#[derive(clap::Args, Debug)]
#[command(arg_required_else_help = true)]
pub struct Args {
    /// The part.
    #[command(subcommand)]
    pub part: Part,
}

/// The parts.
#[derive(Subcommand, Debug)]
pub enum Part {
    /// Hexagon head bolt with an ISO metric thread (ISO 4014)
    ///
    /// Its axis is z, its tip at z = 0. The thread has the basic profile of ISO 68-1.
    Bolt(fasteners::Bolt),
    /// Hexagon nut with an ISO metric thread (ISO 4032)
    ///
    /// Its axis is z, its lower face at z = 0. At the same pose its thread fits that of a bolt. It
    /// may move up by z while it turns counter-clockwise by z / pitch turns.
    Nut(fasteners::Nut),
    /// Peg whose cross-section has lobes
    ///
    /// Its axis is z. The radius of its cross-section is RADIUS + AMPLITUDE cos(LOBES φ).
    Peg(fits::Peg),
    /// Round block with a blind hole for a lobed peg
    ///
    /// Its axis is z, and the hole is open at the top.
    Hole(fits::Hole),
    /// Involute spur gear (ISO 53), with hub and dog clutch if asked
    ///
    /// Its axis is z, and the middle of its first tooth is on +x. Hub and dog teeth are on top.
    Gear(transmission::Gear),
    /// Shift sleeve: splined bore, groove for a fork, dog teeth on both ends
    ///
    /// Its axis is z. It engages with the dog teeth of a gear when it is turned by half of their
    /// pitch.
    Sleeve(transmission::Sleeve),
    /// Stepped shaft with keyways and splines
    ///
    /// Its axis is z. Keyways are on the side of -y.
    Shaft(transmission::Shaft),
    /// Chain link
    ///
    /// It is in the plane z = 0, long in x. The next link is turned by 90° about x, and moved along
    /// x by the pitch that is printed.
    Link(fits::Link),
    /// Spool: a drum between two flanges, with a helical groove if asked
    ///
    /// Its axis is z.
    Spool(fits::Spool),
    /// Finger of a parallel gripper
    ///
    /// It is a bar along +z whose pad looks to +x and is in the plane x = 0.
    Finger(grasp::Finger),
    /// Spoon
    ///
    /// It lies along +x, and its bowl is open to +z.
    Spoon(grasp::Spoon),
}

/// The unit of the coordinates in the file.
#[derive(ValueEnum, Clone, Copy, Debug, PartialEq, Eq)]
pub enum Unit {
    /// Metres, as in scenes of `tesdf simulate`
    M,
    /// Millimetres
    Mm,
}

impl Unit {
    fn name(self) -> &'static str {
        match self {
            Self::M => "m",
            Self::Mm => "mm",
        }
    }

    fn per_metre(self) -> f64 {
        match self {
            Self::M => 1.0,
            Self::Mm => 1e3,
        }
    }
}

/// The options that all parts share.
#[derive(clap::Args, Debug)]
pub struct Common {
    /// Output file: .ply (keeps every digit), .obj or .stl; an existing file is replaced. A pipe or
    /// device is written to, as PLY unless its name has another extension
    #[arg(short, long, value_name = "FILE", value_parser = parse::output())]
    pub output: PathBuf,
    /// Whether a read-only output is replaced.
    #[command(flatten)]
    pub consent: Consent,
    /// Unit of the coordinates in the file
    #[arg(long, value_enum, default_value_t = Unit::M)]
    pub unit: Unit,
    /// Segments of a full turn
    #[arg(long, value_name = "N", default_value_t = 96, conflicts_with = "deviation")]
    pub segments: usize,
    /// Largest distance of a chord from its curve, such as 10um, instead of --segments
    #[arg(long, value_name = "LENGTH", value_parser = parse::metres)]
    pub deviation: Option<f64>,
    /// Print the result as JSON
    #[arg(long)]
    pub json: bool,
}

impl Common {
    fn resolution(&self) -> Resolution {
        self.deviation.map_or(Resolution::Segments(self.segments), Resolution::Deviation)
    }
}

/// A part that was made.
struct Made {
    solid: SolidMesh,
    /// What else to know about it.
    facts: Vec<(&'static str, String)>,
}

/// A part's own options.
trait Make {
    /// Makes the part.
    fn make(&self, resolution: Resolution) -> Result<Made, PartError>;
}

/// The output of `--json`. Lengths are in metres, whatever the unit of the file.
#[derive(Serialize)]
struct Report<'a> {
    part: &'a str,
    output: String,
    unit: &'a str,
    faces: usize,
    vertices: usize,
    min: [f64; 3],
    max: [f64; 3],
    volume: f64,
}

/// Makes a part, writes its mesh, and prints its size.
///
/// # Errors
/// A dimension is impossible, or the file cannot be written.
pub fn run(args: &Args) -> Result<Outcome, Failure> {
    let (name, common, part): (_, _, &dyn Make) = match &args.part {
        Part::Bolt(part) => ("bolt", &part.common, part),
        Part::Nut(part) => ("nut", &part.common, part),
        Part::Peg(part) => ("peg", &part.common, part),
        Part::Hole(part) => ("hole", &part.common, part),
        Part::Gear(part) => ("gear", &part.common, part),
        Part::Sleeve(part) => ("sleeve", &part.common, part),
        Part::Shaft(part) => ("shaft", &part.common, part),
        Part::Link(part) => ("link", &part.common, part),
        Part::Spool(part) => ("spool", &part.common, part),
        Part::Finger(part) => ("finger", &part.common, part),
        Part::Spoon(part) => ("spoon", &part.common, part),
    };
    let output = output::open(&common.output, &[], common.consent)?;
    let format = match common.output.extension() {
        None if output.file_path().is_none() => WriteFormat::Ply,
        _ => WriteFormat::of_path(&common.output).map_err(Failure::new)?,
    };
    let made = part
        .make(common.resolution())
        .map_err(|e| Failure::new(e).hint(format!("tesdf part {name} --help lists all dimensions")))?;
    let mesh = made.solid.mesh();
    let bytes = write_bytes(&scaled(mesh, common.unit)?, format).map_err(Failure::new)?;
    output::write(&output, &bytes)?;

    let bounds = mesh.bounds();
    let faces = (0..mesh.faces().len()).map(|face| mesh.triangle(face));
    let volume = MassProperties::of_triangles(faces).map_err(Failure::new)?.mass;
    let report = Report {
        part: name,
        output: common.output.display().to_string(),
        unit: common.unit.name(),
        faces: mesh.faces().len(),
        vertices: mesh.vertices().len(),
        min: bounds.min.to_array(),
        max: bounds.max.to_array(),
        volume,
    };
    if common.json {
        report::json(&report)?;
    } else {
        report::table(&rows(&report, &made.facts, bounds.extent()))?;
    }
    if !format.is_exact() && !reads_back(&bytes, &common.output)? {
        report::warning(&format!(
            "{}: not encodable, because the format rounds coordinates to 32 bits",
            common.output.display()
        ));
        report::hint("write .ply, which keeps every digit");
        return Ok(Outcome::NotGood);
    }
    if let Some(path) = output.file_path() {
        let (mesh, asset, unit) = (path.display(), path.with_extension("tesdf"), common.unit.name());
        report::hint(&format!("tesdf encode {mesh} -o {} --unit {unit}", asset.display()));
    }
    Ok(Outcome::Good)
}

/// The mesh in the unit of the file.
fn scaled(mesh: &TriangleMesh, unit: Unit) -> Result<TriangleMesh, Failure> {
    let vertices = mesh.vertices().iter().map(|p| *p * unit.per_metre()).collect();
    TriangleMesh::new(vertices, mesh.faces().to_vec()).map_err(Failure::new)
}

/// Whether a file whose coordinates were rounded can be encoded.
fn reads_back(bytes: &[u8], path: &Path) -> Result<bool, Failure> {
    let rounded =
        read_bytes(bytes, MeshFormat::Stl).map_err(|e| Failure::new(format!("{}: {e}", path.display())))?;
    Ok(check(&rounded.mesh).encodable)
}

/// The table that users see.
fn rows(report: &Report, facts: &[(&'static str, String)], size: DVec3) -> Vec<(&'static str, String)> {
    let [x, y, z] = size.to_array().map(mm);
    let mut rows = vec![
        ("part", report.part.to_string()),
        ("mesh", format!("{}, {}", count(report.faces, "face"), count(report.vertices, "vertex"))),
        ("size", format!("{x} × {y} × {z} mm")),
        ("volume", format!("{} cm³", four_digits(report.volume * 1e6))),
    ];
    rows.extend(facts.iter().cloned());
    let unit = if report.unit == "m" { "metres" } else { "millimetres" };
    rows.push(("written to", format!("{}, in {unit}", report.output)));
    rows
}

/// A length in millimetres, to 0.1 µm.
fn mm(metres: f64) -> String {
    let text = format!("{:.4}", metres * 1e3);
    text.trim_end_matches('0').trim_end_matches('.').to_string()
}

/// A number with four significant digits.
fn four_digits(value: f64) -> String {
    format!("{}", format!("{value:.3e}").parse().unwrap_or(value))
}
