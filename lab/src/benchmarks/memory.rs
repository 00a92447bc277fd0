//! `tesdf-lab memory`: bytes and faces read per query, by preset.
use std::path::PathBuf;
use tesdf::base::Named as _;
use tesdf::encode::EncodeOptions;

use rayon::prelude::*;
use tesdf::TeSdf;
use tesdf::asset::CellKind;
use tesdf::glam::DVec3;
use tesdf::inspect::{InspectOptions, inspect};

use tesdf_cli::terminal::parse;

use super::input::{Input, Preset};
use super::output::{mb, percent};
use super::{Failure, heading, output, points};

/// Arguments of `tesdf-lab memory`.
#[derive(clap::Args)]
pub struct Args {
    /// Mesh files; they are repaired first if necessary
    #[arg(required = true)]
    meshes: Vec<PathBuf>,
    /// Presets of the encoder
    #[arg(long, value_parser = parse::named::<Preset>(), value_delimiter = ',', default_value = "default,fast,compact")]
    presets: Vec<Preset>,
    /// Number of points near the surface, and of points in the domain
    #[arg(long, default_value_t = 100_000, value_parser = clap::value_parser!(u32).range(1..))]
    points: u32,
    /// Seed of the random points
    #[arg(long, default_value_t = 1)]
    seed: u64,
}

const COLUMNS: [&str; 16] = [
    "mesh",
    "preset",
    "faces",
    "cells",
    "mean list",
    "lists and tree, MB",
    "file, MB",
    "file, B per face",
    "paper account, MiB",
    "read near",
    "read in domain",
    "fallback, of domain",
    "fallback near, points",
    "nearest fallback, of diagonal",
    "encode, s",
    "threads",
];

pub fn run(args: &Args) -> Result<(), Failure> {
    heading::print()?;
    output::line(&format!(
        "- *Lists and tree*: sections `domain.*` and `lists.*`, and the table of entries that opening derives from \
         them.\n\
         - *Paper account*: 4 bytes for each list entry, 16 for each cell with a list, and 12 for each vertex of a \
         conforming domain that is none of the mesh.\n\
         - *Fallback*: the face tree, which answers points in cells without a list.\n\
         - *Read*: list entries, or faces and nodes of the tree where the fallback answers, per query; mean over {n} \
         points each, *near* the surface (±{near} % of the diagonal) and uniform *in the domain*.\n\
         - *Fallback near*: points within {near} % of the diagonal from the surface, of both kinds, that the face \
         tree answers.\n\
         - *Nearest fallback*: least distance from the surface of the corners, edge middles and centroids of the \
         cells without a list.\n\n\
         MB is 10^6 bytes. Seed {seed}.\n",
        n = args.points,
        near = points::NEAR * 100.0,
        seed = args.seed
    ))?;
    output::head(&COLUMNS, 2)?;
    for path in &args.meshes {
        let input = Input::read(path)?;
        let mesh = input.solid.mesh();
        let near = points::near_surface(mesh, args.points as usize, args.seed);
        for preset in &args.presets {
            let (asset, seconds) = input.encode(&EncodeOptions::preset(*preset))?;
            let found = inspect(&asset, &InspectOptions { samples: 1, seed: args.seed });
            let domain = points::in_domain(&asset, args.points as usize, args.seed);
            let reach = points::NEAR * mesh.diagonal();
            let [near, domain] = [&near, &domain].map(|points| Fallback::of(&asset, points, reach));
            let file = found.memory.file;
            output::row(&[
                input.name.clone(),
                preset.name().into(),
                found.counts.faces.to_string(),
                (found.counts.listed_cells + found.counts.far_cells).to_string(),
                format!("{:.2}", found.lists.mean),
                mb(found.memory.lists_and_tree),
                mb(file),
                format!("{:.1}", file as f64 / found.counts.faces as f64),
                format!("{:.3}", found.memory.paper_mib),
                format!("{:.2}", near.reads),
                format!("{:.2}", domain.reads),
                percent(domain.share),
                (near.close + domain.close).to_string(),
                nearest_fallback(&asset).map_or("none".into(), |d| percent(d / mesh.diagonal())),
                format!("{seconds:.2}"),
                rayon::current_num_threads().to_string(),
            ])?;
        }
    }
    Ok(())
}

/// What queries at some points read, and how many of them the face tree answers.
struct Fallback {
    /// Mean number of list entries, faces and nodes that a query reads.
    reads: f64,
    /// Fraction of the points that the face tree answers.
    share: f64,
    /// Number of these points within reach of the surface.
    close: usize,
}

impl Fallback {
    fn of(asset: &TeSdf, points: &[DVec3], reach: f64) -> Self {
        let (reads, fallback, close) = points
            .par_iter()
            .map(|&p| {
                let reads = asset.reads(p);
                let fallback = reads.list_entries == 0;
                let close = fallback && asset.signed_distance(p).abs() <= reach;
                (reads.total(), usize::from(fallback), usize::from(close))
            })
            .reduce(|| (0, 0, 0), |a, b| (a.0 + b.0, a.1 + b.1, a.2 + b.2));
        let count = points.len() as f64;
        Self { reads: reads as f64 / count, share: fallback as f64 / count, close }
    }
}

/// Smallest distance from the surface to a cell without a list, measured at the corners, edge
/// midpoints and centroids of these cells.
fn nearest_fallback(asset: &TeSdf) -> Option<f64> {
    let mut probes = Vec::new();
    asset.visit_cells(|cell| {
        if matches!(cell.kind, CellKind::FarInside | CellKind::FarOutside) {
            let c = cell.corners;
            probes.push(0.25 * c.iter().sum::<DVec3>());
            for i in 0..4 {
                probes.extend((i..4).map(|j| 0.5 * (c[i] + c[j])));
            }
        }
    });
    probes.par_iter().map(|&p| asset.signed_distance_f32(p).abs()).reduce_with(f64::min)
}
