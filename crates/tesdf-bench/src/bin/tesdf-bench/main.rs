//! `tesdf-bench`: the benchmarks of `docs/benchmarks.md`. Each command prints one table as
//! Markdown; `batch` and `collide-peers` print JSON.
//!
//! Each table names its processor, date and command. Compare speeds within one run only.
use std::process::ExitCode;

use clap::{Parser, Subcommand};
use tesdf::base::Isa;

mod algorithm_1;
mod batch;
mod clearance;
mod collide_peers;
mod curve;
mod encode;
mod exactness;
mod frank_wolfe;
mod heading;
mod input;
mod memory;
mod output;
mod parry;
mod points;
mod poses;
mod query;
mod reencode;
mod reference;
mod scaling;
mod screw;
mod slender;
mod timing;

use input::MeshesAndPoints;

/// Why a benchmark could not run: what was found, where, and what to do.
type Failure = Box<dyn std::error::Error + Send + Sync>;

/// Benchmarks of tesdf; each prints one table.
#[derive(Parser)]
#[command(name = "tesdf-bench", version, arg_required_else_help = true)]
struct Cli {
    #[command(subcommand)]
    command: Command,
    /// Use this instruction set at most, as on a processor without the wider ones
    #[arg(long, global = true, value_parser = instruction_set)]
    isa: Option<Isa>,
}

/// Reads the name of an instruction set that this processor has.
fn instruction_set(name: &str) -> Result<Isa, String> {
    let all = Isa::of_processor();
    all.iter().copied().find(|isa| format!("{isa:?}").eq_ignore_ascii_case(name)).ok_or_else(|| {
        format!("not an instruction set of this processor; expected one of {all:?}, in any case")
    })
}

#[derive(Subcommand)]
enum Command {
    /// Time of a signed distance with closest point and gradient, against parry3d and a face tree
    Query(MeshesAndPoints),
    /// Time of one batch over points of a file, as JSON for `scripts/python_batch.py`
    Batch(batch::Args),
    /// Bytes of the asset and faces read per query, by preset
    Memory(memory::Args),
    /// Time, peak memory and hash of one encode
    Encode(encode::Args),
    /// Number of distances of Algorithm 1 at a resolution: in the paper's formulation, and as a
    /// device computes them
    #[command(name = "algorithm-1")]
    Algorithm1(algorithm_1::Args),
    /// Memory against speed, over the options of the encoder
    Curve(curve::Args),
    /// Largest errors and sign mistakes against brute force
    Exactness(MeshesAndPoints),
    /// Time and size of meshes with fans, needles and stray vertices, relative to another mesh
    Slender(slender::Args),
    /// A nut on a bolt: travel, energy, penetration and time, by clearance, time step and detector
    /// mode
    Screw(screw::Args),
    /// Time of a detection as a scene grows: more instances in a row, or more worlds
    Scaling(scaling::Args),
    /// Cost of re-encoding a deformed mesh, by the fraction of vertices that moved
    Reencode(reencode::Args),
    /// Error of Frank-Wolfe iterations relative to the exact minimum, on two bodies in contact
    FrankWolfe(frank_wolfe::Args),
    /// Contacts of two posed meshes, from tesdf and parry3d, with the true clearances, as JSON for
    /// `scripts/peers.py`
    CollidePeers(collide_peers::Args),
}

fn main() -> ExitCode {
    let cli = Cli::parse();
    if let Some(isa) = cli.isa {
        isa.limit_to();
    }
    let result = match &cli.command {
        Command::Query(args) => query::run(args),
        Command::Batch(args) => batch::run(args),
        Command::Memory(args) => memory::run(args),
        Command::Encode(args) => encode::run(args),
        Command::Algorithm1(args) => algorithm_1::run(args),
        Command::Curve(args) => curve::run(args),
        Command::Exactness(args) => exactness::run(args),
        Command::Slender(args) => slender::run(args),
        Command::Screw(args) => screw::run(args),
        Command::Scaling(args) => scaling::run(args),
        Command::Reencode(args) => reencode::run(args),
        Command::FrankWolfe(args) => frank_wolfe::run(args),
        Command::CollidePeers(args) => collide_peers::run(args),
    };
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => {
            eprintln!("error: {failure}");
            ExitCode::from(2)
        }
    }
}
