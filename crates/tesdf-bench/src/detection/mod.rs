//! `tesdf bench`: what detection costs on a device, stage by stage.
mod collide;
mod frames;
#[cfg(feature = "gpu")]
mod on_device;
mod poses;
mod report;

use tesdf_terminal::report::{Failure, Outcome};

/// Arguments of `tesdf bench`.
#[derive(clap::Args, Debug)]
pub struct Args {
    #[command(subcommand)]
    what: What,
}

#[derive(clap::Subcommand, Debug)]
enum What {
    /// Detect the contacts of recorded or generated poses, and print time, launches, bytes and queries
    Collide(collide::Args),
    /// Write a file of poses: bodies in overlap, from a seed
    Poses(poses::Args),
}

/// Runs a benchmark.
///
/// # Errors
/// A file that cannot be read or written, or a device that fails.
pub fn run(args: &Args) -> Result<Outcome, Failure> {
    match &args.what {
        What::Collide(args) => collide::run(args),
        What::Poses(args) => poses::run(args),
    }
}
