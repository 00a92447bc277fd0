//! `tesdf encode MESH -o FILE`: encodes a mesh.
use std::path::PathBuf;
use std::sync::atomic::Ordering;
use std::time::Instant;

use serde::Serialize;
use tesdf::asset::about::{Repair, Source, Statistics};
use tesdf::base::{InsideRule, unit};
use tesdf::domain::tetrahedra_files;
use tesdf::encode::{DomainChoice, EncodeOptions, Encoder, Method};
use tesdf::mesh::{
    Defect, LoadReport, LoadedSolid, MeshFormat, ReadSolidError, RepairReport, Severity, SolidMesh,
    SolidOptions,
};
use tesdf::{Certificate, Progress, TeSdf};
use tesdf_sim::robot::RobotFormat;

use crate::terminal::device::{self, Choice};
use crate::terminal::interrupt;
use crate::terminal::mesh_file::CadArgs;
use crate::terminal::output;
use crate::terminal::output::Consent;
use crate::terminal::parse;
use crate::terminal::progress::watched;
use crate::terminal::report::{self, Failure, Outcome};

pub(crate) mod choices;
mod robot;
mod split;

use crate::encode_all::Batch;
use crate::encode_all::meshes::Mesh;
use choices::encode;
pub use choices::{ChoiceArgs, RepairChoice};

const ENCODED_HELP: &str = "Mesh file: STL, OBJ, PLY, OFF, glTF, GLB, 3MF, or STEP, IGES, BREP by the program Gmsh; or a \
                            robot description, URDF or MJCF, whose collision meshes are all encoded";

/// Arguments of `tesdf encode`.
#[derive(clap::Args, Debug)]
pub struct Args {
    /// The mesh file or robot description.
    #[arg(help = ENCODED_HELP, value_parser = parse::mesh())]
    pub mesh: PathBuf,
    /// Output file; an existing file is replaced, a pipe or device is written to. Folder of the
    /// assets and their manifest with --split and for robot descriptions
    #[arg(short, long, value_name = "FILE|FOLDER", value_parser = parse::output())]
    pub output: PathBuf,
    /// Encode each object of the file into an asset of its own, with its name: objects of OBJ, 3MF
    /// and glTF, solids of STEP, IGES, BREP and ASCII STL; where a file has fewer than two of them,
    /// its connected components
    #[arg(long)]
    pub split: bool,
    /// How finely CAD files become triangles.
    #[command(flatten)]
    pub cad: CadArgs,
    /// Where `package://NAME/` of a URDF file leads; may be given several times [default:
    /// ROS_PACKAGE_PATH, AMENT_PREFIX_PATH, and folders above the file]
    #[arg(long = "package", value_name = "NAME=PATH", value_parser = robot::package)]
    pub packages: Vec<(String, PathBuf)>,
    /// Whether a read-only output is replaced.
    #[command(flatten)]
    pub consent: Consent,
    /// The options of the encoder.
    #[command(flatten)]
    pub choices: ChoiceArgs,
    /// Where samples are evaluated
    #[arg(long, value_name = "DEVICE", value_parser = Choice::parse, default_value_t = Choice::Processor, help = device::help("samples are looked at"))]
    pub device: Choice,
    /// Number of threads; the file does not depend on it [default: one per core]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    pub threads: Option<u16>,
    /// Print the result as JSON
    #[arg(long)]
    pub json: bool,
}

fn exactness(certificate: &Certificate) -> String {
    let exact = match (certificate.delta_of_diagonal(), certificate.exactness_distance()) {
        (Some(delta), None) => format!("to {delta:.1e} of the diagonal, proven"),
        (Some(delta), Some(within)) => {
            format!("to {delta:.1e} of the diagonal up to {within:.4e} from the surface, proven")
        }
        (None, _) => "not proven: faces between samples may be missing".into(),
    };
    match certificate.jumps() {
        true => format!("{exact}; the sign changes in holes of the mesh, where the distance is not 0"),
        false => exact,
    }
}

/// The output of `--json`. All ids start from 0.
#[derive(Serialize)]
struct Report<'a> {
    file: String,
    output: String,
    load: &'a LoadReport,
    warnings: &'a [Defect],
    /// All changes of `--repair auto`; `null` when nothing was repaired.
    repair: Option<&'a RepairReport>,
    bytes: usize,
    bytes_per_face: f64,
    seconds: f64,
    options: &'a EncodeOptions,
    source: &'a Source,
    statistics: &'a Statistics,
    certificate: &'a Certificate,
}

/// Reads, checks and encodes a mesh, and saves the result in one step at the end.
///
/// # Errors
/// The mesh cannot be read or has no well-defined inside, an option does not apply to it, the file
/// cannot be written, or Ctrl-C was pressed. The output file is then unchanged.
pub fn run(args: &Args) -> Result<Outcome, Failure> {
    if let Some(format) = RobotFormat::of_path(&args.mesh).map_err(Failure::new)? {
        return robot::run(args, format);
    }
    if !args.packages.is_empty() {
        return Err(Failure::new(format!(
            "--package is of URDF files, and {} is none; leave it out",
            args.mesh.display()
        )));
    }
    if args.split {
        return split::run(args);
    }
    let output = output::open(&args.output, &args.inputs(), args.consent)?;
    if MeshFormat::of_path(&args.output).is_ok() {
        let output = args.output.display();
        return Err(Failure::new(format!(
            "{output}: the extension is that of a mesh, but an asset would be written"
        ))
        .hint(format!("-o {}", args.output.with_extension("tesdf").display())));
    }
    let start = Instant::now();
    args.cad.check(&args.mesh)?;
    let choices = args.choices.choices();
    let options = choices.options().map_err(Failure::new)?;
    let how =
        SolidOptions { inside: options.inside, repair: args.choices.repair_mode(), cad: args.cad.options() };
    let loaded = SolidMesh::load(&args.mesh, &how).map_err(|e| refused(args, &e))?;
    let source = loaded.source();
    let LoadedSolid { solid, report: load, repaired, .. } = loaded;
    let options = options.or_unit(load.unit.as_deref());
    load.notes.iter().for_each(|note| report::warning(note));
    let conflict = unit::conflict(load.unit.as_deref(), args.choices.unit.as_deref());
    conflict.iter().for_each(|found| report::warning(found));
    if let Some(found) = &repaired {
        report::note(&format!("repaired {}", Repair::from(found)));
    }
    warn(solid.warnings());

    let interrupted = interrupt::flag();
    let progress = Progress::default();
    if options.method == Method::Certified && args.device != Choice::Processor {
        return Err(Failure::new("--device only applies to the sampled encoder; add --encoder sampled"));
    }
    let sampler = args.device.sampler()?;
    let encoded = watched(&progress, interrupted, || {
        let encoder = Encoder::new().options(options).source(source).sampler(&*sampler).progress(&progress);
        encode(&solid, &args.mesh, &choices, encoder, &progress)
    });
    if interrupted.load(Ordering::Relaxed) {
        return Err(Failure::new(format!("interrupted; {} is unchanged", args.output.display())));
    }
    let asset = encoded?;
    output::write(&output, &asset.to_bytes().map_err(Failure::new)?)?;
    let seconds = start.elapsed().as_secs_f64();
    let repair = repaired.as_ref().map(|found| &found.repaired.report);
    print(args, &Before { load: &load, warnings: solid.warnings(), repair }, &asset, seconds)?;
    Ok(Outcome::Good)
}

impl Args {
    /// The encoding of several meshes into the folder of the output.
    fn batch(&self, meshes: Vec<Mesh>) -> Result<Batch<'_>, Failure> {
        if self.device != Choice::Processor {
            return Err(Failure::new(
                "--device is for one mesh; leave it out for --split and robot descriptions",
            ));
        }
        Ok(Batch {
            meshes,
            from: &self.mesh,
            output: &self.output,
            choices: &self.choices,
            cad: self.cad.clone(),
            shard: None,
            jobs: None,
            threads: self.threads,
            json: self.json,
        })
    }

    /// All files that the command reads.
    fn inputs(&self) -> Vec<PathBuf> {
        let mut inputs = tesdf::mesh::files(&self.mesh);
        if let DomainChoice::File(path) = &self.choices.domain {
            inputs.extend(tetrahedra_files(path));
        }
        inputs
    }
}

/// Number of defects of each kind that are printed; `tesdf check` prints more.
const SHOWN: usize = 3;

fn warn(defects: &[Defect]) {
    for (i, defect) in defects.iter().enumerate() {
        let alike = |d: &&Defect| d.kind == defect.kind && d.severity == defect.severity;
        let print = if defect.severity == Severity::Note { report::note } else { report::warning };
        match defects[..i].iter().filter(alike).count() {
            before if before < SHOWN => print(&defect.message),
            SHOWN => print(&format!(
                "... {} {} in all; `tesdf check` lists them",
                defects.iter().filter(alike).count(),
                defect.kind
            )),
            _ => {}
        }
    }
}

/// What was found and changed before the encoding.
struct Before<'a> {
    load: &'a LoadReport,
    warnings: &'a [Defect],
    repair: Option<&'a RepairReport>,
}

fn print(args: &Args, before: &Before, asset: &TeSdf, seconds: f64) -> Result<(), Failure> {
    let about = asset.about();
    let statistics = &about.statistics;
    let bytes = asset.as_bytes().len();
    let bytes_per_face = bytes as f64 / statistics.faces as f64;
    let [file, output] = [&args.mesh, &args.output].map(|path| path.display().to_string());
    if args.json {
        let &Before { load, warnings, repair } = before;
        return report::json(&Report {
            file,
            output,
            load,
            warnings,
            repair,
            bytes,
            bytes_per_face,
            seconds,
            options: &about.options,
            source: &about.source,
            statistics,
            certificate: about.certificate(),
        });
    }
    let cells = statistics.listed_cells + statistics.far_cells;
    let mean = statistics.entries as f64 / statistics.listed_cells.max(1) as f64;
    report::table(&[
        ("mesh", format!("{file}, {}", report::count(statistics.faces, "face"))),
        ("file", format!("{output}, {}, {bytes_per_face:.0} per face", report::size(bytes))),
        ("cells", format!("{cells}, of which {} with a list", statistics.listed_cells)),
        ("lists", format!("{mean:.1} faces on average, at most {}", statistics.longest_list)),
        ("inside", about.certificate().inside().to_string()),
        ("exact", exactness(about.certificate())),
        ("time", format!("{seconds:.1} s")),
    ])
}

/// Why a mesh is refused, with the commands that would take it.
fn refused(args: &Args, error: &ReadSolidError) -> Failure {
    let failure = Failure::new(error);
    let ReadSolidError::NotSolid { source, .. } = error else { return failure };
    let (mesh, output) = (args.mesh.display(), args.output.display());
    let mut ways: Vec<String> = Vec::new();
    if let Some(options) = source.suggestion() {
        ways.push(format!(
            "`tesdf repair {mesh} -o FILE.ply{options}`, or `--repair auto` here, makes it encodable"
        ));
    } else {
        ways.push(format!("`tesdf check {mesh}` lists all defects"));
    }
    ways.extend(source.rules().iter().map(|rule| match rule {
        InsideRule::Sheet { thickness } => {
            format!("`--inside sheet --thickness {thickness}` takes its faces as sheets")
        }
        rule => format!("`tesdf encode {mesh} -o {output} --inside {}` takes it as it is", rule.name()),
    }));
    failure.hint(ways.join("; "))
}
