//! `tesdf-bench algorithm-1`
use std::path::PathBuf;

use clap::ValueEnum;
use tesdf::Length;
use tesdf::domain::gmsh::{GmshOptions, tetrahedralise};
use tesdf::encode::{Domain, EncodeOptions, Encoder, Method, Refinement, Sampling};
use tesdf_gpu::SampleCounter;

use crate::input::{Input, Preset};
use crate::{Failure, heading, output};

/// Arguments of `tesdf-bench algorithm-1`.
#[derive(clap::Args)]
pub struct Args {
    /// The meshes that would be encoded
    #[arg(required = true)]
    meshes: Vec<PathBuf>,
    /// Domains: of Gmsh with a band of 5 % of the diagonal, its tetrahedra as they are, or the bisection domain
    #[arg(long, value_enum, value_delimiter = ',', default_values_t = [DomainName::Gmsh, DomainName::Bisection])]
    domain: Vec<DomainName>,
    /// Q: samples along an edge of a tetrahedron, less one
    #[arg(long, default_value_t = 128)]
    resolution: u32,
    /// In every so manieth cell some blocks of samples are looked into, for what they are left with
    #[arg(long, default_value_t = 50)]
    every: usize,
    /// How many blocks of such a cell
    #[arg(long, default_value_t = 20)]
    blocks: usize,
    /// Floating-point operations per second of a device, for the estimate [default: a quarter of an H200's 66.9e12 in 32 bits]
    #[arg(long, default_value_t = 0.25 * 66.9e12)]
    speed: f64,
}

/// Ways to cut space into tetrahedra.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum DomainName {
    Gmsh,
    Bisection,
}

/// Operations of a distance in `tesdf-gpu`'s `kernels/sample.rs`, sums and products counted alike: four heights over planes at 6, three
/// feet on edges at 8, three distances to edges at 13, nine comparisons and choices.
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
        "Counted, not timed. Q = {}. *Candidates*: what Lemma 1 leaves of the faces. *Sample × candidate*: the distances of Algorithm 1, \
         which lines 12 and 14 both take: seconds are for twice as many. *Left to a block*: what Lemma 1, asked again for 8 × 8 × 4 samples, \
         leaves of them, the mean of {} blocks of every {}th cell; *distances*: what the device then measures, those for asking included. \
         Seconds: {OPERATIONS} operations per distance at {:.1e} per second.\n",
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
    let options =
        EncodeOptions { method: Method::Sampled(sampling), refinement, ..Preset::Default.options() };
    let counter = SampleCounter::new(args.every, args.blocks);
    Encoder::new().options(options).domain(domain).sampler(&counter).encode(&input.solid)?;
    let counts = counter.counts();
    let seconds = |distances: f64| format!("{:.1}", distances * OPERATIONS / args.speed);
    output::row(&[
        input.name.clone(),
        format!("{name:?}"),
        counts.cells.to_string(),
        format!("{:.0}", counts.candidates as f64 / counts.cells.max(1) as f64),
        counts.most_candidates.to_string(),
        counts.samples.to_string(),
        format!("{:.2e}", counts.pairs as f64),
        seconds(2.0 * counts.pairs as f64),
        format!("{:.1}", counts.survivors()),
        format!("{:.2e}", counts.distances()),
        seconds(counts.distances()),
    ])
}
