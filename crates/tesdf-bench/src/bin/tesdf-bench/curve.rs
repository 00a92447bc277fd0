//! `tesdf-bench curve`: memory against speed.
use std::hint::black_box;
use std::path::PathBuf;

use rayon::ThreadPoolBuilder;
use tesdf::encode::EncodeOptions;
use tesdf::inspect::{InspectOptions, inspect};

use crate::input::{Input, Preset};
use crate::output::mb;
use crate::timing::{PASSES, best_pass};
use crate::{Failure, heading, output, points};

/// Arguments of `tesdf-bench curve`.
#[derive(clap::Args)]
pub struct Args {
    /// A mesh file; it is repaired first if necessary
    mesh: PathBuf,
    /// Values of `byte_worth`, which trades memory for speed
    #[arg(long, value_delimiter = ',', default_value = "0.03,0.05,0.075,0.1,0.15,0.25,0.5", value_parser = positive, allow_negative_numbers = true)]
    byte_worth: Vec<f64>,
    /// Values of `tighten_levels`: levels of bisection below each cell that shorten its list
    #[arg(long, value_delimiter = ',', default_value = "0,3,6,12")]
    tighten_levels: Vec<u32>,
    /// Number of points near the surface
    #[arg(long, default_value_t = 100_000, value_parser = clap::value_parser!(u32).range(1..))]
    points: u32,
    /// Seed of the random points
    #[arg(long, default_value_t = 1)]
    seed: u64,
}

const COLUMNS: [&str; 10] = [
    "byte_worth",
    "tighten_levels",
    "preset",
    "cells",
    "mean list",
    "lists and tree, MB",
    "read near",
    "ns per query",
    "ns per query, batch",
    "encode, s",
];

pub fn run(args: &Args) -> Result<(), Failure> {
    let input = Input::read(&args.mesh)?;
    heading::print()?;
    let mesh = input.solid.mesh();
    output::line(&format!(
        "{}, {} faces. *Read* and times are at {} points near the surface (±{} % of the diagonal), f32, one thread, the best of \
         {PASSES} passes; *lists and tree* as in the table of memory; encode on {} threads. Seed {}.\n",
        input.name,
        mesh.faces().len(),
        args.points,
        points::NEAR * 100.0,
        rayon::current_num_threads(),
        args.seed
    ))?;
    output::head(&COLUMNS, 3)?;
    let near = points::near_surface(mesh, args.points as usize, args.seed);
    let one = ThreadPoolBuilder::new().num_threads(1).build()?;
    let nanoseconds = |seconds: f64| format!("{:.0}", seconds / near.len() as f64 * 1e9);
    for &byte_worth in &args.byte_worth {
        for &tighten_levels in &args.tighten_levels {
            let options = EncodeOptions { byte_worth, tighten_levels, ..EncodeOptions::default() };
            let preset = [Preset::Default, Preset::Fast, Preset::Compact]
                .into_iter()
                .find(|p| p.options() == options)
                .map_or("", Preset::name);
            let (asset, seconds) = input.encode(&options)?;
            let found = inspect(&asset, &InspectOptions { samples: 1, seed: args.seed });
            let reads: usize = near.iter().map(|&p| asset.reads(p).total()).sum();
            let single = best_pass(|| {
                for &p in &near {
                    black_box(asset.query_f32(black_box(p)));
                }
            });
            let batch = one.install(|| {
                best_pass(|| {
                    black_box(asset.query_batch_f32(black_box(&near)));
                })
            });
            output::row(&[
                byte_worth.to_string(),
                tighten_levels.to_string(),
                preset.into(),
                (found.counts.listed_cells + found.counts.far_cells).to_string(),
                format!("{:.2}", found.lists.mean),
                mb(found.memory.lists_and_tree),
                format!("{:.2}", reads as f64 / near.len() as f64),
                nanoseconds(single),
                nanoseconds(batch),
                format!("{seconds:.2}"),
            ])?;
        }
    }
    Ok(())
}

fn positive(text: &str) -> Result<f64, String> {
    let expected = || format!("{text} is not a finite number above 0");
    text.parse().ok().filter(|x: &f64| x.is_finite() && *x > 0.0).ok_or_else(expected)
}
