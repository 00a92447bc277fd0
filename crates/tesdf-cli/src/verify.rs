//! `tesdf verify FILE`
use std::path::PathBuf;

/// Arguments of `tesdf verify`.
#[derive(clap::Args, Debug)]
pub struct Args {
    /// A .tesdf file
    pub file: PathBuf,
    /// Number of points that are compared with brute force
    #[arg(long, value_name = "N", default_value_t = 10_000)]
    pub samples: u32,
    /// Print the result as JSON
    #[arg(long)]
    pub json: bool,
}
