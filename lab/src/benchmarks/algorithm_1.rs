//! `tesdf-lab algorithm-1`: counts the distances that Algorithm 1 of the paper computes.
use std::path::PathBuf;

use clap::ValueEnum;
use tesdf::Length;
use tesdf::domain::gmsh::{GmshOptions, tetrahedralise};
use tesdf::encode::{Domain, EncodeOptions, Encoder, Method, Refinement, Sampling};
use tesdf_gpu::SampleCounter;

use super::input::{Input, Preset};
use super::{Failure, heading, output};

/// Arguments of `tesdf-lab algorithm-1`.
#[derive(clap::Args)]
pub struct Args {
    /// Mesh files; they are encoded with Algorithm 1
    #[arg(required = true)]
    meshes: Vec<PathBuf>,
    /// Domains: `gmsh` has the tetrahedra of Gmsh, not bisected, with a band of 5 % of the
    /// diagonal; `bisection` is the bisection domain
    #[arg(long, value_enum, value_delimiter = ',', default_values_t = [DomainName::Gmsh, DomainName::Bisection])]
    domain: Vec<DomainName>,
    /// Resolution Q: a tetrahedron's edge has Q + 1 samples
    #[arg(long, default_value_t = 128)]
    resolution: u32,
    /// Counts the candidates of blocks of samples in every N-th cell
    #[arg(long, default_value_t = 50)]
    every: usize,
    /// Number of blocks in each of these cells
    #[arg(long, default_value_t = 20)]
    blocks: usize,
    /// Floating-point operations per second of a device, for the estimated time [default: a quarter
    /// of the 66.9e12 of an H200 in 32 bits]
    #[arg(long, default_value_t = 0.25 * 66.9e12)]
    speed: f64,
}

/// Methods that divide space into tetrahedra.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum DomainName {
    Gmsh,
    Bisection,
}

/// Number of operations of one distance in `kernels/encode/sampled.rs` of `tesdf-gpu`. Each sum and
/// each product counts as one: 6 for each of four heights over planes, 8 for each of three foot
/// points on edges, 13 for each of three distances to edges, and 9 comparisons and selections.
const OPERATIONS: f64 = 96.0;

const COLUMNS: [&str; 11] = [
    "mesh",
    "domain",
    "cells",
    "candidates per cell",
    "most",
    "samples",
    "sample × candidate",
    "as the paper has it, s",
    "left to a block",
    "distances",
    "s",
];

pub fn run(args: &Args) -> Result<(), Failure> {
    heading::print()?;
    output::line(&format!(
        "Counted, not timed. Q = {}.\n\n\
         - *Candidates*: the faces that Lemma 1 keeps.\n\
         - *Sample × candidate*: the number of distances in Algorithm 1. Its lines 12 and 14 both compute them, so the \
         seconds are for twice this number.\n\
         - *Left to a block*: the candidates that remain when Lemma 1 is applied again to a block of 8 × 8 × 4 samples, \
         on average over {} blocks of every {}th cell.\n\
         - *Distances*: the number that the device then computes, including those for Lemma 1 and those of idle \
         threads.\n\
         - *Seconds*: {OPERATIONS} operations per distance at {:.1e} per second.\n",
        args.resolution, args.blocks, args.every, args.speed
    ))?;
    output::head(&COLUMNS, 2)?;
    for path in &args.meshes {
        let input = Input::read(path)?;
        for &name in &args.domain {
            row(args, &input, name)?;
        }
    }
    Ok(())
}

fn row(args: &Args, input: &Input, name: DomainName) -> Result<(), Failure> {
    let conforming = match name {
        DomainName::Bisection => None,
        DomainName::Gmsh => {
            let band = Some(Length::OfDiagonal(0.05));
            Some(tetrahedralise(&input.solid, &GmshOptions { band, ..GmshOptions::default() })?)
        }
    };
    let domain = conforming.as_ref().map_or(Domain::Bisection, Domain::Conforming);
    let refinement = if conforming.is_some() { Refinement::None } else { Refinement::ByCost };
    let sampling = Sampling { resolution: args.resolution, ..Sampling::PAPER };
    let options = EncodeOptions {
        method: Method::Sampled(sampling),
        refinement,
        ..EncodeOptions::preset(Preset::Default)
    };
    let counter = SampleCounter::new(args.every, args.blocks);
    Encoder::new().options(options).domain(domain).sampler(&counter).encode(&input.solid)?;
    let counts = counter.counts();
    let seconds = |distances: f64| format!("{:.1}", distances * OPERATIONS / args.speed);
    output::row(&[
        input.name.clone(),
        format!("{name:?}"),
        counts.cells.to_string(),
        format!("{:.0}", counts.candidates as f64 / counts.cells.max(1) as f64),
        counts.max_candidates.to_string(),
        counts.samples.to_string(),
        format!("{:.2e}", counts.pairs as f64),
        seconds(2.0 * counts.pairs as f64),
        format!("{:.1}", counts.survivors()),
        format!("{:.2e}", counts.distances()),
        seconds(counts.distances()),
    ])
}
