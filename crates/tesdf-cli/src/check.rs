//! `tesdf check MESH`
use std::path::PathBuf;

/// Arguments of `tesdf check`.
#[derive(clap::Args, Debug)]
pub struct Args {
    /// Mesh: STL, OBJ, PLY, OFF, glTF or GLB
    pub mesh: PathBuf,
    /// Print the result as JSON
    #[arg(long)]
    pub json: bool,
}
