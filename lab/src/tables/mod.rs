//! `tesdf-lab table1|table2|table3|table4|fig8|fig9`: measures Tables I to IV and Figures 8
//! and 9 of the paper, next to the paper's figures.
//!
//! The meshes of the repository (`meshes`) are encoded in a domain with both encoders, with full
//! and with truncated lists (`measure`). The assets are compared with exact distances on a grid.
//! The rows (`table1`, `table4`) are printed as Markdown, CSV or JSON. Table II detects the
//! contacts of recorded poses (`table2`). Table III simulates two scenes with voxel grids and with
//! encoded meshes (`table3`). The figures simulate a pile of shafts with truncated lists, and
//! detect its contacts (`pile`).
mod deformed;
mod detector;
mod domains;
mod measure;
mod meshes;
mod output;
mod paper;
mod pile;
mod table1;
mod table2;
mod table3;
mod table4;

use std::path::PathBuf;
use tesdf_cli::terminal::parse;

use crate::on_grid::MAX_FINENESS;
use meshes::{MESHES, Mesh};
use output::Sink;
use tesdf::domain::tetrahedra_files;
use tesdf::encode::Preset;

use tesdf_cli::terminal::device::{self, Choice};
use tesdf_cli::terminal::output::Consent;
use tesdf_cli::terminal::report::Failure;

/// Tables and figures of the paper.
#[derive(clap::Subcommand, Clone, Debug)]
pub enum Table {
    /// Table I: memory, largest error and bands of several meshes, with full lists and with at most
    /// 32 faces per list
    Table1(TableArgs),
    /// Table II: memory, times of the broad, middle and narrow phase, and narrow-phase queries of
    /// the scenarios, in recorded poses
    Table2(table2::Args),
    /// Table III: a nut on its bolt and a peg in its hole, simulated with voxel grids of several
    /// resolutions and with encoded meshes; success or the kind of failure, and memory
    Table3(table3::Args),
    /// Table IV: the same figures for the shaft, with at most 32, 64, ... 288 faces per list
    Table4(TableArgs),
    /// Figure 8: penetrations in a pile of shafts by frame, with nodes, faces and the exact
    /// minimum, with full lists and with at most 32 faces per list
    Fig8(pile::fig8::Args),
    /// Figure 9: time of the narrow phase at the start and the end of the pile, with at most 32,
    /// 64, ... 288 faces per list
    Fig9(pile::fig9::Args),
}

/// Arguments of a table.
#[derive(clap::Args, Clone, Debug)]
pub struct TableArgs {
    /// Division of space into tetrahedra; several values, separated by commas, give separate rows
    #[arg(long, value_enum, value_delimiter = ',', default_value = "bisection")]
    pub domain: Vec<DomainName>,
    /// Preset of the encoder
    #[arg(long, value_parser = parse::named::<Preset>(), default_value_t = Preset::Default)]
    pub preset: Preset,
    /// Number of grid points along the diagonal of a mesh [default: 1024; with --quick 64]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=i64::from(MAX_FINENESS)))]
    pub grid: Option<u32>,
    /// Resolution Q of the sampled encoder: an edge of a tetrahedron has Q + 1 samples [default:
    /// 32; with --quick 4; on a device the paper's value for each mesh]
    #[arg(long, value_name = "Q")]
    pub resolution: Option<u32>,
    /// Where samples are evaluated
    #[arg(long, value_name = "DEVICE", value_parser = Choice::parse, default_value_t = Choice::Processor, help = device::help("samples are looked at"))]
    pub device: Choice,
    /// Use a coarse grid and few samples, and in Table I only the smaller meshes
    #[arg(long)]
    pub quick: bool,
    /// Names of the meshes, separated by commas [default: all meshes of the table]
    #[arg(long, value_name = "NAMES", value_delimiter = ',')]
    pub meshes: Option<Vec<String>>,
    /// Folder of the meshes: `data` of the repository
    #[arg(long, value_name = "FOLDER", default_value = "data")]
    pub data: PathBuf,
    /// Where the result goes.
    #[command(flatten)]
    pub output: OutputArgs,
}

/// Format and destination of a table.
#[derive(clap::Args, Clone, Debug)]
pub struct OutputArgs {
    /// Format of the result
    #[arg(long, value_enum, default_value_t = Format::Md)]
    pub format: Format,
    /// Write the result in all formats to this folder, which is created if necessary, instead of
    /// printing it
    #[arg(short, long, value_name = "FOLDER", conflicts_with = "format")]
    pub output: Option<PathBuf>,
    /// Whether a read-only output is replaced.
    #[command(flatten)]
    pub consent: Consent,
}

/// Methods that divide space into tetrahedra.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum DomainName {
    /// Bisected tetrahedra of a cube; needs no other program
    Bisection,
    /// Tetrahedra that conform to the surface, as in the paper; needs Gmsh
    Gmsh,
}

/// Formats of a result.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum Format {
    /// Markdown with command, date and processor
    Md,
    /// CSV, one row per line
    Csv,
    /// JSON, with full precision
    Json,
}

impl TableArgs {
    /// The files of all meshes, which no output may replace.
    fn mesh_files(&self) -> Vec<PathBuf> {
        MESHES.iter().flat_map(|mesh| tetrahedra_files(self.data.join(mesh.path))).collect()
    }

    /// Number of voxels along the diagonal; without options as in the paper.
    fn fineness(&self) -> u32 {
        self.grid.unwrap_or(if self.quick { 64 } else { 1 << 10 })
    }

    fn resolution(&self, mesh: &Mesh) -> u32 {
        self.resolution.unwrap_or(match (self.quick, &self.device) {
            (true, _) => 4,
            (false, Choice::Processor) => 32,
            (false, _) => mesh.paper_resolution(),
        })
    }
}

/// Measures and prints the table.
///
/// # Errors
/// A mesh cannot be read or encoded, Gmsh is missing or fails, or the result cannot be written.
pub fn run(table: &Table) -> Result<(), Failure> {
    // The output files are opened before the work, which takes minutes to hours.
    match table {
        Table::Table1(args) => table1::run(args, &Sink::open(&args.output, "table1", &args.mesh_files())?),
        Table::Table4(args) => table4::run(args, &Sink::open(&args.output, "table4", &args.mesh_files())?),
        Table::Table2(args) => table2::run(args),
        Table::Table3(args) => table3::run(args),
        Table::Fig8(args) => pile::fig8::run(args),
        Table::Fig9(args) => pile::fig9::run(args),
    }
}
