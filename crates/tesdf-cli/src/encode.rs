//! `tesdf encode MESH -o FILE`
use std::num::NonZeroUsize;
use std::path::PathBuf;

use clap::ValueEnum;
use tesdf::geometry::Aabb;

use crate::parse;

/// Arguments of `tesdf encode`.
#[derive(clap::Args, Debug)]
pub struct Args {
    /// Mesh: STL, OBJ, PLY, OFF, glTF or GLB
    pub mesh: PathBuf,
    /// The file to write; an existing one is replaced
    #[arg(short, long, value_name = "FILE")]
    pub output: PathBuf,
    /// How the space in and around the solid is cut into tetrahedra
    #[arg(long, value_enum, default_value_t = Domain::Bisection)]
    pub domain: Domain,
    /// How the closest faces of each tetrahedron are found
    #[arg(long, value_enum, default_value_t = Encoder::Certified)]
    pub encoder: Encoder,
    /// A point on the curve of memory and speed; all are exact
    #[arg(long, value_enum, default_value_t = Preset::Default)]
    pub preset: Preset,
    /// Width of the band around the mesh's box that is encoded too, mesh unit [default: 5 % of its diagonal]
    #[arg(long, value_name = "LENGTH", value_parser = parse::length, allow_hyphen_values = true)]
    pub band: Option<f64>,
    /// A box that is encoded too, mesh unit; may be given several times
    #[arg(long = "region", value_name = "x0 y0 z0 x1 y1 z1", value_parser = parse::region, allow_hyphen_values = true)]
    pub regions: Vec<Aabb>,
    /// Name of the mesh's unit, recorded in the file; nothing is scaled
    #[arg(long, value_name = "NAME")]
    pub unit: Option<String>,
    /// Number of threads; the file is the same for every number [default: one per core]
    #[arg(long, value_name = "N")]
    pub threads: Option<NonZeroUsize>,
    /// Print the result as JSON
    #[arg(long)]
    pub json: bool,
}

/// Ways to cut space into tetrahedra.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Domain {
    /// Cubes and their halves, finer near the surface; no other program is needed
    Bisection,
}

/// Ways to find the closest faces of a tetrahedron.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Encoder {
    /// Proven: no face that can be closest is left out
    Certified,
}

/// Points on the curve of memory and speed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Preset {
    /// Fast queries
    Default,
    /// Quickest to encode
    Fast,
    /// Smallest
    Compact,
}
