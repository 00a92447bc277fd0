//! `tesdf evaluate table1|table4`: Tables I and IV of the paper, measured, beside the paper's figures.
//!
//! In go the meshes of the repository (`meshes`); each is encoded in a domain with both encoders, with full lists and with
//! truncated ones (`measure`), and compared with exact distances on a grid. Out come rows (`table1`, `table4`)
//! as Markdown, CSV or JSON.
mod deformed;
mod domains;
mod measure;
mod meshes;
mod output;
mod paper;
mod table1;
mod table4;

use std::path::PathBuf;

use meshes::Mesh;
use output::Sink;
use tesdf::evaluate::EvaluateOptions;

use tesdf_terminal::device::{self, Choice};
use tesdf_terminal::output::Consent;
use tesdf_terminal::report::{Failure, Outcome};

/// Arguments of `tesdf evaluate`.
#[derive(clap::Args, Debug)]
pub struct Args {
    /// Which table
    #[command(subcommand)]
    pub table: Table,
}

/// Tables of the paper.
#[derive(clap::Subcommand, Clone, Debug)]
pub enum Table {
    /// Table I: memory, largest error and bands of several meshes, full lists and at most 32 faces
    Table1(TableArgs),
    /// Table IV: the same of the shaft, for lists of at most 32, 64, ... 288 faces
    Table4(TableArgs),
}

/// Arguments of a table.
#[derive(clap::Args, Clone, Debug)]
pub struct TableArgs {
    /// How space is cut into tetrahedra; several are separated by commas and give rows each
    #[arg(long, value_enum, value_delimiter = ',', default_value = "bisection")]
    pub domain: Vec<DomainName>,
    /// Points of the grid along the diagonal of a mesh [default: 1024; with --quick 64]
    #[arg(long, value_name = "N")]
    pub grid: Option<u32>,
    /// Q of the sampled encoder: samples per edge of a tetrahedron [default: 32; with --quick 4; on a device the paper's of each mesh]
    #[arg(long, value_name = "Q")]
    pub resolution: Option<u32>,
    /// Where samples are looked at
    #[arg(long, value_name = "DEVICE", value_parser = Choice::parse, default_value_t = Choice::Processor, help = device::help("samples are looked at"))]
    pub device: Choice,
    /// A coarse grid, few samples, and in Table I the smaller meshes alone
    #[arg(long)]
    pub quick: bool,
    /// Meshes by the names of their rows, separated by commas [default: all of the table]
    #[arg(long, value_name = "NAMES", value_delimiter = ',')]
    pub meshes: Option<Vec<String>>,
    /// The folder with the meshes: `data` of the repository
    #[arg(long, value_name = "FOLDER", default_value = "data")]
    pub data: PathBuf,
    /// Form of the result
    #[arg(long, value_enum, default_value_t = Format::Md)]
    pub format: Format,
    /// Write the result in every form to this folder, which is made where it is not there, instead of printing it
    #[arg(short, long, value_name = "FOLDER", conflicts_with = "format")]
    pub output: Option<PathBuf>,
    /// Whether a read-only output is replaced.
    #[command(flatten)]
    pub consent: Consent,
}

/// Ways to cut space into tetrahedra.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum DomainName {
    /// Cubes and their halves; no other program is needed
    Bisection,
    /// Tetrahedra that conform to the surface, by Gmsh, which must be installed: as in the paper
    Gmsh,
}

/// Forms of a result.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum Format {
    /// Markdown, with command, date and processor above
    Md,
    /// One row per line
    Csv,
    /// Figures with full precision
    Json,
}

impl TableArgs {
    fn evaluate_options(&self) -> EvaluateOptions {
        let usual = if self.quick { 64 } else { 1 << 10 };
        EvaluateOptions { fineness: self.grid.unwrap_or(usual), ..EvaluateOptions::default() }
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
/// A mesh cannot be read or encoded, Gmsh is not there or fails, or the result cannot be written.
pub fn run(args: &Args) -> Result<Outcome, Failure> {
    // Files are opened before the work of minutes to hours, whose result they take.
    match &args.table {
        Table::Table1(args) => table1::run(args, &Sink::open(args, "table1")?)?,
        Table::Table4(args) => table4::run(args, &Sink::open(args, "table4")?)?,
    }
    Ok(Outcome::Good)
}
