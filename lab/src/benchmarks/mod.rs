//! The tables of `docs/benchmarks.md`. Each command prints one table as Markdown; `batch` and `peers`
//! print JSON.
use clap::Subcommand;

#[cfg(feature = "gpu")]
mod algorithm_1;
mod batch;
mod clearance;
mod encode;
mod frank_wolfe;
mod heading;
mod input;
mod memory;
mod output;
mod parry;
mod peers;
mod points;
mod poses;
mod query;
mod reencode;
mod scaling;
mod screw;
mod slender;
mod timing;

/// Why a benchmark could not run: what was found, where, and what to do.
type Failure = Box<dyn std::error::Error + Send + Sync>;

/// The benchmarks.
#[derive(Subcommand)]
pub enum Command {
    /// Time of a signed distance with closest point and gradient, against parry3d and a face tree
    Query(query::Args),
    /// Time of one batch over points of a file, as JSON for `lab/scripts/python_batch.py`
    Batch(batch::Args),
    /// Bytes of the asset and faces read per query, by preset
    Memory(memory::Args),
    /// Time, peak memory and hash of one encode
    Encode(encode::Args),
    /// Number of distances of Algorithm 1 at a resolution: in the paper's formulation, and as a
    /// device computes them
    #[cfg(feature = "gpu")]
    #[command(name = "algorithm-1")]
    Algorithm1(algorithm_1::Args),
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
    /// `lab/scripts/peers.py`
    Peers(peers::Args),
}

/// Runs a benchmark.
///
/// # Errors
/// A file cannot be read, or its mesh cannot be encoded.
pub fn run(command: &Command) -> Result<(), tesdf_cli::terminal::report::Failure> {
    let result = match command {
        Command::Query(args) => query::run(args),
        Command::Batch(args) => batch::run(args),
        Command::Memory(args) => memory::run(args),
        Command::Encode(args) => encode::run(args),
        #[cfg(feature = "gpu")]
        Command::Algorithm1(args) => algorithm_1::run(args),
        Command::Slender(args) => slender::run(args),
        Command::Screw(args) => screw::run(args),
        Command::Scaling(args) => scaling::run(args),
        Command::Reencode(args) => reencode::run(args),
        Command::FrankWolfe(args) => frank_wolfe::run(args),
        Command::Peers(args) => peers::run(args),
    };
    result.map_err(tesdf_cli::terminal::report::Failure::new)
}
