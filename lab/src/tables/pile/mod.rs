//! Figures 8 and 9: deep penetrations in a pile of shafts, and the time of the narrow phase, by the
//! greatest length of the lists (Sec. VII-D of the paper).
//!
//! `scene` reads the pile and replaces its geometry, `fig8` simulates it, `fig9` detects its
//! contacts at the beginning and at the end. `plot` draws curves.
pub mod fig8;
pub mod fig9;
mod plot;
mod scene;

use std::path::PathBuf;

use serde::Serialize;
use tesdf::TeSdf;
use tesdf::encode::Deformation;
use tesdf::save::Destination;

use super::domains::{Subject, open};
use super::measure::{Cells, Setup};
use super::meshes::{MESHES, SHAFT};
use super::output::{Sink, Text, open_in_folder};
use super::{DomainName, OutputArgs};
use plot::Plot;
use scene::Pile;
use tesdf_cli::terminal::device::{self, Choice};
use tesdf_cli::terminal::output;
use tesdf_cli::terminal::report::Failure;

/// What both figures need.
#[derive(clap::Args, Clone, Debug)]
pub struct PileArgs {
    /// Division of space into tetrahedra; several values, separated by commas, give separate rows
    #[arg(long, value_enum, value_delimiter = ',', default_value = "bisection")]
    pub domain: Vec<DomainName>,
    /// Where contacts are found
    #[arg(long, value_name = "DEVICE", value_parser = Choice::parse, default_value_t = Choice::Processor, help = device::help("contacts are found"))]
    pub device: Choice,
    /// Take the 24 shafts in the middle, 10 frames, and few settings
    #[arg(long)]
    pub quick: bool,
    /// Number of shafts, the nearest to the middle [default: all; with --quick 24]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(2..))]
    pub shafts: Option<u16>,
    /// Folder of the scene: `scenes` of the repository, beside `data`
    #[arg(long, value_name = "FOLDER", default_value = "scenes")]
    pub scenes: PathBuf,
    /// Folder of the meshes: `data` of the repository
    #[arg(long, value_name = "FOLDER", default_value = "data")]
    pub data: PathBuf,
    /// Where the result goes.
    #[command(flatten)]
    pub output: OutputArgs,
}

/// The output of `--format json`, with the settings of the figure.
#[derive(Serialize)]
struct Figure<Settings, Row> {
    figure: u32,
    quick: bool,
    device: String,
    shafts: usize,
    #[serde(flatten)]
    settings: Settings,
    rows: Vec<Row>,
}

/// The pile, and where the measurements of a figure go.
struct Study {
    number: u32,
    pile: Pile,
    sink: Sink,
    picture: Option<Destination>,
}

impl Study {
    /// Reads the pile for a figure of this number.
    ///
    /// # Errors
    /// The scene or its mesh cannot be read, or a file cannot be written.
    fn open(args: &PileArgs, number: u32) -> Result<Self, Failure> {
        let pile = Pile::read(args)?;
        let (name, inputs) = (format!("fig{number}"), pile.loaded.geometry_files());
        let sink = Sink::open(&args.output, &name, &inputs)?;
        let picture = open_in_folder(&args.output, &format!("{name}.svg"), &inputs)?;
        Ok(Self { number, pile, sink, picture })
    }

    /// The figure, still without rows. Its contacts are found on `device`.
    fn figure<Settings, Row>(
        &self,
        args: &PileArgs,
        device: String,
        settings: Settings,
    ) -> Figure<Settings, Row> {
        let shafts = self.pile.exact.bodies().len() - 1;
        Figure { figure: self.number, quick: args.quick, device, shafts, settings, rows: Vec::new() }
    }

    /// Writes the curves, and prints the figure.
    ///
    /// # Errors
    /// Stdout or a file cannot be written.
    fn print(&self, figure: &impl Serialize, csv: &Text, markdown: &str, plot: &Plot) -> Result<(), Failure> {
        if let Some(picture) = &self.picture {
            output::write(picture, plot.svg().as_bytes())?;
        }
        self.sink.print(figure, csv, markdown)
    }
}

/// The shaft in a domain, ready to be encoded.
struct Shaft {
    subject: Subject,
    setup: Setup,
}

impl Shaft {
    /// Opens the mesh, and makes its tetrahedra.
    ///
    /// # Errors
    /// The mesh cannot be read, or Gmsh is missing or fails.
    fn open(args: &PileArgs, domain: DomainName) -> Result<Self, Failure> {
        let mesh = MESHES.iter().find(|mesh| mesh.path == SHAFT);
        let mesh = mesh.ok_or_else(|| Failure::new(format!("there is no mesh {SHAFT}")))?;
        let subject = open(mesh, &args.data, domain)?;
        let setup = Setup::certified(&subject, Cells::Plain, Deformation::None);
        Ok(Self { subject, setup })
    }

    /// Name of the domain in the rows.
    fn domain(&self) -> &str {
        &self.subject.name
    }

    /// The shaft with lists of at most `max_entries` faces; with all faces for `None`.
    ///
    /// # Errors
    /// The errors of the encoder.
    fn encode(&self, max_entries: Option<u32>) -> Result<TeSdf, Failure> {
        let setup = match max_entries {
            Some(max_entries) => self.setup.truncated(max_entries),
            None => self.setup.clone(),
        };
        Ok(setup.encode(&self.subject, &tesdf::encode::Processor)?.0)
    }
}

/// E_max in words.
fn e_max(max_entries: Option<u32>) -> String {
    max_entries.map_or("full".into(), |entries| entries.to_string())
}
