//! `tesdf devices`: lists the compute devices.
use crate::terminal::report::{Failure, Outcome};

#[cfg(feature = "gpu")]
mod list;

/// Arguments of `tesdf devices`.
#[derive(clap::Args, Debug)]
pub struct Args {
    /// Print the devices as a JSON array
    #[arg(long)]
    pub json: bool,
}

/// Lists the devices.
///
/// # Errors
/// There is no device, stdout cannot be written, or the tool was built without the feature `gpu`.
#[cfg(feature = "gpu")]
pub fn run(args: &Args) -> Result<Outcome, Failure> {
    list::run(args)
}

/// Reports that this tool was built without devices.
///
/// # Errors
/// Always. The message says how to build the tool with the feature `gpu`.
#[cfg(not(feature = "gpu"))]
pub fn run(_: &Args) -> Result<Outcome, Failure> {
    Err(crate::terminal::device::built_without(""))
}
