//! `tesdf inspect FILE`
use std::path::PathBuf;

/// Arguments of `tesdf inspect`.
#[derive(clap::Args, Debug)]
pub struct Args {
    /// A .tesdf file
    pub file: PathBuf,
    /// Print the result as JSON
    #[arg(long)]
    pub json: bool,
}
