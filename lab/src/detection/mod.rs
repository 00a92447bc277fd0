//! Measures the cost of a detection, stage by stage, on the processor or on a device.
mod arguments;
mod clearance;
mod collide;
pub(crate) mod frames;
mod hashes;
mod heap;
#[cfg(feature = "gpu")]
mod kernels;
#[cfg(feature = "gpu")]
pub(crate) mod on_device;
mod poses;
mod record;
pub(crate) mod report;
mod worlds;

use tesdf_cli::terminal::report::Failure;

/// Measurements of detection.
#[derive(clap::Subcommand, Debug)]
pub enum Command {
    /// Detect the contacts of recorded or generated poses; print time, launches, bytes and queries
    Collide(arguments::Args),
    /// Measure the clearance of random pairs of bodies that are deep in each other
    Clearance(clearance::Args),
    /// Measure the search for pairs in a heap of many bodies, anew in each step and kept
    Heap(heap::Args),
    /// Compile all kernels for a CUDA device, which need not be there, and keep them for later
    /// calls; print registers, stack, spilled bytes and seconds of each
    #[cfg(feature = "gpu")]
    Kernels(kernels::Args),
    /// Write a file of poses with overlapping bodies, from a seed
    Poses(poses::Args),
    /// Keep some poses of a run in a small file, for measurements on other machines
    Record(record::Args),
    /// Detect the contacts of many worlds of two bodies, as `lab/scripts/python_worlds.py` does; print
    /// JSON
    Worlds(worlds::Args),
}

/// Runs a measurement.
///
/// # Errors
/// A file cannot be read or written, or a device fails.
pub fn run(command: &Command) -> Result<(), Failure> {
    match command {
        Command::Collide(args) => collide::run(args),
        Command::Clearance(args) => clearance::run(args),
        Command::Heap(args) => heap::run(args),
        #[cfg(feature = "gpu")]
        Command::Kernels(args) => kernels::run(args),
        Command::Poses(args) => poses::run(args),
        Command::Record(args) => record::run(args),
        Command::Worlds(args) => worlds::run(args),
    }
}
