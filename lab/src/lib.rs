//! The laboratory of tesdf: everything that its authors measure and its users do not call.
//!
//! - [`tables`]: Tables I to IV and Figures 8 and 9 of the paper, beside the paper's figures.
//! - [`detection`]: detection stage by stage, on the processor or on a device.
//! - [`benchmarks`]: the tables of `docs/benchmarks.md`, and ratios to peers.
//! - [`scenes`]: scenes of the paper whose criteria the house does not have.
//! - [`on_grid`]: errors of encoded distances on a grid, for Tables I and IV.
//! - [`voxel`]: voxel grids, which Table III compares with.
//!
//! Each table names its processor, date and command ([`heading`]). Compare speeds within one run only.
use std::process::ExitCode;

use clap::{Parser, Subcommand};
use tesdf::base::Isa;
use tesdf_cli::terminal::interrupt;
use tesdf_cli::terminal::report::{self, Outcome};

pub mod benchmarks;
pub mod detection;
pub mod heading;
pub mod on_grid;
pub mod reference;
pub mod scenes;
pub mod tables;
pub mod voxel;

/// Measurements of tesdf; each command prints one table.
#[derive(Parser)]
#[command(name = "tesdf-lab", version, arg_required_else_help = true)]
struct Cli {
    #[command(subcommand)]
    command: Command,
    /// Use this instruction set at most, as on a processor without the wider ones
    #[arg(long, global = true, value_parser = instruction_set)]
    isa: Option<Isa>,
}

#[derive(Subcommand)]
enum Command {
    #[command(flatten)]
    Table(tables::Table),
    #[command(flatten)]
    Detection(detection::Command),
    #[command(flatten)]
    Benchmark(benchmarks::Command),
    /// Simulate the bodies of a scene and write the run, as `tesdf simulate` does, with the criteria
    /// of the scenes in `lab/scenes`, too
    Simulate(scenes::Args),
}

/// Reads the name of an instruction set that this processor has.
fn instruction_set(name: &str) -> Result<Isa, String> {
    let all = Isa::of_processor();
    all.iter().copied().find(|isa| format!("{isa:?}").eq_ignore_ascii_case(name)).ok_or_else(|| {
        format!("not an instruction set of this processor; expected one of {all:?}, in any case")
    })
}

/// Runs the command in the arguments of this process.
pub fn main() -> ExitCode {
    let cli = match Cli::try_parse() {
        Ok(cli) => cli,
        Err(e) => {
            report::usage(&e);
            return ExitCode::from(u8::try_from(e.exit_code()).unwrap_or(2));
        }
    };
    if let Err(failure) = interrupt::install() {
        report::error(&failure);
        return ExitCode::from(2);
    }
    if let Some(isa) = cli.isa {
        isa.limit_to();
    }
    let result = match &cli.command {
        Command::Table(table) => tables::run(table).map(|()| Outcome::Good),
        Command::Detection(command) => detection::run(command).map(|()| Outcome::Good),
        Command::Benchmark(command) => benchmarks::run(command).map(|()| Outcome::Good),
        Command::Simulate(args) => scenes::run(args),
    };
    match result {
        Ok(Outcome::Good) => ExitCode::SUCCESS,
        Ok(Outcome::NotGood) => ExitCode::from(1),
        Err(failure) => {
            report::error(&failure);
            ExitCode::from(2)
        }
    }
}
