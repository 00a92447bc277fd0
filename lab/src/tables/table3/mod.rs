//! Table III: success, failures and memory of voxel grids and of encoded meshes in two tight fits.
mod assets;
mod cell;
mod memory;
mod scenario;
mod text;

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::Arc;
use tesdf::base::Named as _;
use tesdf_cli::terminal::parse;

use serde::Serialize;
use tesdf_sim::scene_file::LoadedScene;

use super::OutputArgs;
use super::detector::Shared;
use super::output::Sink;
use crate::voxel::VoxelDetector;
use assets::Assets;
use cell::{Cell, Setup};
use memory::{Encoded, Grids, Voxels, geometries};
pub use scenario::Scenario;
use tesdf::encode::Preset;
use tesdf_cli::terminal::device::{self, Choice};
use tesdf_cli::terminal::progress::Bar;
use tesdf_cli::terminal::report::{Failure, note};

/// Arguments of Table III.
#[derive(clap::Args, Clone, Debug)]
pub struct Args {
    /// Scenes, separated by commas
    #[arg(long, value_enum, value_delimiter = ',', default_value = "bolt-nut,peg-in-hole")]
    pub scenarios: Vec<Scenario>,
    /// Time steps in ms, separated by commas; only those of the paper have voxels [default:
    /// 1,3,5,10; with --quick 5]
    #[arg(long, value_name = "MS", value_delimiter = ',')]
    pub time_steps: Option<Vec<f64>>,
    /// Tolerances in µm, separated by commas; a scene takes those that it has. Only those of the
    /// paper have voxels [default: all; with --quick the largest]
    #[arg(long, value_name = "UM", value_delimiter = ',')]
    pub tolerances: Option<Vec<u32>>,
    /// Number of voxel columns, from the lowest quality on [default: 4; with --quick 1]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u8).range(0..=4))]
    pub qualities: Option<u8>,
    /// What is tested against the distance fields [default: node,face; with --quick node]
    #[arg(long, value_enum, value_delimiter = ',')]
    pub features: Option<Vec<Features>>,
    /// Preset of the encoder
    #[arg(long, value_parser = parse::named::<Preset>(), default_value_t = Preset::Compact)]
    pub preset: Preset,
    /// Where contacts with encoded meshes are found
    #[arg(long, value_name = "DEVICE", value_parser = Choice::parse, default_value_t = Choice::Processor, help = device::help("contacts with encoded meshes are found"))]
    pub device: Choice,
    /// Run one time step, tolerance and voxel quality of each scene, and the nut for 0.06 s
    #[arg(long)]
    pub quick: bool,
    /// Folder of the scenes: `scenes` of the repository, beside `data`
    #[arg(long, value_name = "FOLDER", default_value = "scenes")]
    pub scenes: PathBuf,
    /// Where the result goes.
    #[command(flatten)]
    pub output: OutputArgs,
}

/// What of a body is tested against the distance field of another.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, clap::ValueEnum)]
#[serde(rename_all = "snake_case")]
pub enum Features {
    /// The vertices
    Node,
    /// The faces, by Frank–Wolfe
    Face,
}

impl Features {
    fn name(self) -> &'static str {
        match self {
            Self::Node => "node",
            Self::Face => "face",
        }
    }
}

/// The output of `--format json`.
#[derive(Serialize)]
struct Table {
    table: u32,
    quick: bool,
    preset: &'static str,
    encoded: Vec<Encoded>,
    voxels: Vec<Voxels>,
    cells: Vec<Cell>,
}

impl Args {
    fn tolerances(&self, scenario: Scenario) -> Vec<u32> {
        let all = scenario.tolerances();
        match (&self.tolerances, self.quick) {
            (Some(chosen), _) => all.into_iter().filter(|t| chosen.contains(t)).collect(),
            (None, true) => vec![all[0]],
            (None, false) => all.to_vec(),
        }
    }

    fn qualities(&self, scenario: Scenario) -> &'static [[u32; 2]] {
        let count = self.qualities.unwrap_or(if self.quick { 1 } else { 4 });
        &scenario.paper().qualities[..usize::from(count)]
    }

    fn time_steps(&self) -> Vec<f64> {
        self.time_steps.clone().unwrap_or(if self.quick { vec![5.0] } else { vec![1.0, 3.0, 5.0, 10.0] })
    }

    fn features(&self) -> Vec<Features> {
        let usual = if self.quick { vec![Features::Node] } else { vec![Features::Node, Features::Face] };
        self.features.clone().unwrap_or(usual)
    }
}

/// Runs all cells, and prints the table.
///
/// # Errors
/// A scene or mesh cannot be read, the device is missing, or the result cannot be written.
pub fn run(args: &Args) -> Result<(), Failure> {
    if let Some(step) = args.time_steps().into_iter().find(|step| !(*step > 0.0 && step.is_finite())) {
        return Err(Failure::new(format!("--time-steps: {step}; expected positive numbers, in ms")));
    }
    let sink = Sink::open(&args.output, "table3", &[])?;
    let exact = Shared::open(&args.device)?;
    let assets = Assets::new(args.preset)?;
    let mut table = Table {
        table: 3,
        quick: args.quick,
        preset: args.preset.name(),
        encoded: Vec::new(),
        voxels: Vec::new(),
        cells: Vec::new(),
    };
    for &scenario in &args.scenarios {
        let mut grids = Grids::default();
        let mut last = None;
        for tolerance in args.tolerances(scenario) {
            let changed = of_tolerance(args, (scenario, tolerance), &assets, &exact, &mut grids, &mut table)?;
            last = Some(changed);
        }
        if let Some(geometries) = last {
            table.voxels.extend(geometries.iter().flat_map(|geometry| grids.release(geometry)));
        }
    }
    sink.print(&table, &text::csv(&table.cells), &text::markdown(args, &table))
}

/// Runs the cells of a scene at a tolerance. Returns its meshes.
fn of_tolerance(
    args: &Args,
    (scenario, tolerance): (Scenario, u32),
    assets: &Assets,
    exact: &Shared,
    grids: &mut Grids,
    table: &mut Table,
) -> Result<[memory::Geometry; 2], Failure> {
    let bar = Bar::new("encoding");
    let mut loaded = scenario.scene(args, tolerance, assets)?;
    let system = loaded.system().map_err(Failure::new)?;
    let files = scenario.bodies().map(|name| asset(&loaded, name));
    let geometries = geometries(scenario, &system, files)?;
    table.encoded.push(Encoded::of(scenario, tolerance, &geometries));
    let distance = loaded.scene.detector.contact_distance.unwrap_or(0.0);
    let is_of_paper = args.time_steps().iter().any(|&step| scenario.is_of_paper(tolerance, step));
    let grids_of_paper = if is_of_paper { args.qualities(scenario) } else { &[] };
    for voxels in grids_of_paper.iter().copied().map(Some).chain([None]) {
        let detector = match voxels {
            None => exact.clone(),
            Some(qualities) => {
                let mut of_shapes = BTreeMap::new();
                for (geometry, quality) in geometries.iter().zip(qualities) {
                    let grid = grids.get((scenario, tolerance), geometry, quality, distance, &bar)?;
                    of_shapes.insert(geometry.shape, grid);
                }
                Shared(Arc::new(VoxelDetector::new(of_shapes)))
            }
        };
        for features in args.features() {
            for time_step in args.time_steps() {
                if voxels.is_some() && !scenario.is_of_paper(tolerance, time_step) {
                    continue;
                }
                bar.stage("simulating");
                scenario::set(&mut loaded, features, time_step);
                let setup = Setup { scenario, tolerance, voxels, features, time_step };
                let cell = setup.run(&loaded, system.clone(), detector.clone(), |share| bar.set(share))?;
                note(&text::line(&cell));
                table.cells.push(cell);
            }
        }
    }
    // The next tolerance has another mesh of this body.
    let changing = geometries.iter().filter(|geometry| geometry.body == scenario.fitted());
    table.voxels.extend(changing.flat_map(|geometry| grids.release(geometry)));
    Ok(geometries)
}

/// The asset file of a body of a scene.
fn asset(loaded: &LoadedScene, name: &str) -> PathBuf {
    let section = loaded.scene.bodies.iter().map(|b| b.get_ref()).find(|b| b.name == name);
    section.and_then(|body| body.asset.clone()).unwrap_or_default()
}
