//! `tesdf-bench`: the tables of `docs/benchmarks.md`, each one command, as Markdown on stdout (`batch`, `collide-peers`: JSON).
//!
//! Every table says on which processor, when and by which command it was made. Speeds are meant as ratios within one run.
use std::process::ExitCode;

use clap::{Parser, Subcommand};

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
}

#[derive(Subcommand)]
enum Command {
    /// Time of a signed distance with closest point and gradient, against parry3d and a face tree
    Query(MeshesAndPoints),
    /// Time of one batch over points of a file, as JSON for `scripts/python_batch.py`
    Batch(batch::Args),
    /// Bytes, and faces read per query, by preset
    Memory(memory::Args),
    /// Time, peak memory and hash of one encode
    Encode(encode::Args),
    /// Distances of Algorithm 1 at a resolution, as the paper has it and as a device measures them
    #[command(name = "algorithm-1")]
    Algorithm1(algorithm_1::Args),
    /// Memory against speed over the encoder's options
    Curve(curve::Args),
    /// Largest errors and sign mistakes against brute force
    Exactness(MeshesAndPoints),
    /// Time and size of fans, needles and stray vertices, against another mesh
    Slender(slender::Args),
    /// A nut on a bolt: travel, energy, penetration and time by clearance, time step and detector
    Screw(screw::Args),
    /// Time of a detection as a scene grows: instances in a row, worlds side by side
    Scaling(scaling::Args),
    /// What a deformed mesh costs, by the share that has moved: cells looked at, stale, and time against encoding anew
    Reencode(reencode::Args),
    /// How far Frank-Wolfe iterations are off the exact minimum, on two bodies in contact
    FrankWolfe(frank_wolfe::Args),
    /// Contacts of two posed meshes, ours and parry3d's, with the true clearances, as JSON for `scripts/peers.py`
    CollidePeers(collide_peers::Args),
}

fn main() -> ExitCode {
    let result = match &Cli::parse().command {
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
