//! `tesdf repair MESH -o FILE`
use std::path::PathBuf;

use crate::parse;

/// Arguments of `tesdf repair`.
#[derive(clap::Args, Debug)]
pub struct Args {
    /// Mesh: STL, OBJ, PLY, OFF, glTF or GLB
    pub mesh: PathBuf,
    /// The file to write, .ply (keeps every digit), .obj or .stl; an existing one is replaced
    #[arg(short, long, value_name = "FILE")]
    pub output: PathBuf,
    /// Merge vertices closer than this and close cracks up to it, mesh unit [default: bitwise equal positions only]
    #[arg(long, value_name = "T", value_parser = parse::length, allow_hyphen_values = true)]
    pub weld_tolerance: Option<f64>,
    /// Print the result as JSON
    #[arg(long)]
    pub json: bool,
}
