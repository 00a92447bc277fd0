//! Table II: memory, times of the three phases and narrow-phase queries of the scenarios, in
//! recorded poses.
mod measure;
mod text;

use std::path::PathBuf;
use tesdf::base::Named as _;
use tesdf_cli::terminal::parse;

use serde::Serialize;

use super::OutputArgs;
use super::output::Sink;
use super::paper::{TABLE_2, Table2};
use measure::Row;
use tesdf::encode::Preset;
use tesdf_cli::terminal::device::{self, Choice};
use tesdf_cli::terminal::progress::Bar;
use tesdf_cli::terminal::report::{Failure, note};

/// Arguments of Table II.
#[derive(clap::Args, Clone, Debug)]
pub struct Args {
    /// Scenarios, separated by commas [default: all that have recorded poses; with --quick bolt-nut
    /// and peg-in-hole]
    #[arg(long, alias = "scene", value_enum, value_delimiter = ',')]
    pub scenarios: Option<Vec<Scenario>>,
    /// Folder of the recorded poses; `tesdf-lab record` makes them of runs
    #[arg(long, value_name = "FOLDER", default_value = "lab/recordings")]
    pub recordings: PathBuf,
    /// Maximum number of frames of a scenario [default: all; with --quick 2]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    pub frames: Option<u32>,
    /// Number of measurements per frame [default: 3; with --quick 1]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=10_000))]
    pub repeat: Option<u32>,
    /// Preset of the encoder
    #[arg(long, value_parser = parse::named::<Preset>(), default_value_t = Preset::Compact)]
    pub preset: Preset,
    /// Where contacts are found
    #[arg(long, value_name = "DEVICE", value_parser = Choice::parse, default_value_t = Choice::Processor, help = device::help("contacts are found"))]
    pub device: Choice,
    /// Measure two scenarios, two frames of each, once
    #[arg(long)]
    pub quick: bool,
    /// Where the result goes.
    #[command(flatten)]
    pub output: OutputArgs,
}

/// The scenarios of Table II.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, clap::ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub enum Scenario {
    /// Two grippers assemble pegs and nuts
    RoboAssembly,
    /// Three chains hoist a platform
    ChainedSam,
    /// A gearbox shifts through five gears
    EngineTransmission,
    /// A nut turns down its bolt
    BoltNut,
    /// A peg slides into its hole
    PegInHole,
    /// 128 shafts come apart
    PileOfShafts,
}

impl Scenario {
    const ALL: [Self; 6] = [
        Self::RoboAssembly,
        Self::ChainedSam,
        Self::EngineTransmission,
        Self::BoltNut,
        Self::PegInHole,
        Self::PileOfShafts,
    ];

    /// Name of its files, without the extension, and in the rows.
    fn name(self) -> &'static str {
        match self {
            Self::RoboAssembly => "robo-assembly",
            Self::ChainedSam => "chained-sam",
            Self::EngineTransmission => "engine-transmission",
            Self::BoltNut => "bolt-nut",
            Self::PegInHole => "peg-in-hole",
            Self::PileOfShafts => "pile-of-shafts",
        }
    }

    /// The paper's row.
    fn paper(self) -> &'static Table2 {
        &TABLE_2[self as usize]
    }
}

/// E_max of the paper's scenarios.
const MAX_ENTRIES: u32 = 32;

/// The output of `--format json`.
#[derive(Serialize)]
struct Table {
    table: u32,
    quick: bool,
    preset: &'static str,
    device: String,
    repeat: u32,
    rows: Vec<Row>,
}

impl Args {
    fn scenarios(&self) -> Vec<Scenario> {
        match (&self.scenarios, self.quick) {
            (Some(chosen), _) => chosen.clone(),
            (None, true) => vec![Scenario::BoltNut, Scenario::PegInHole],
            (None, false) => Scenario::ALL.into_iter().filter(|&s| self.file(s).exists()).collect(),
        }
    }

    fn file(&self, scenario: Scenario) -> PathBuf {
        self.recordings.join(scenario.name()).with_extension("json")
    }

    fn frames(&self) -> usize {
        self.frames.map_or(if self.quick { 2 } else { usize::MAX }, |frames| frames as usize)
    }

    fn repeat(&self) -> u32 {
        self.repeat.unwrap_or(if self.quick { 1 } else { 3 })
    }
}

/// Measures all scenarios, and prints the table.
///
/// # Errors
/// A file cannot be read, a mesh cannot be encoded, the device is missing or fails, or the result
/// cannot be written.
pub fn run(args: &Args) -> Result<(), Failure> {
    let scenarios = args.scenarios();
    if scenarios.is_empty() {
        let folder = args.recordings.display();
        return Err(Failure::new(format!("{folder}: there are no recorded poses"))
            .hint("give the folder `lab/recordings` of the repository to --recordings"));
    }
    let files: Vec<PathBuf> = scenarios.iter().map(|&scenario| args.file(scenario)).collect();
    let sink = Sink::open(&args.output, "table2", &files)?;
    let device = args.device.open()?;
    let mut table = Table {
        table: 2,
        quick: args.quick,
        preset: args.preset.name(),
        device: device.as_ref().map_or("cpu".into(), |device| device.name().to_string()),
        repeat: args.repeat(),
        rows: Vec::new(),
    };
    let bar = Bar::new("encoding");
    for (scenario, file) in scenarios.into_iter().zip(&files) {
        for max_entries in [Some(MAX_ENTRIES), None] {
            let row = measure::row(args, (scenario, file), max_entries, device.as_ref(), &bar)?;
            note(&text::line(&row));
            table.rows.push(row);
        }
    }
    sink.print(&table, &text::csv(&table.rows), &text::markdown(&table))
}
