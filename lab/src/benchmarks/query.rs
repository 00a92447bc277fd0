//! `tesdf-lab query`: time of a query, against parry3d and a face tree.
use std::hint::black_box;
use std::path::PathBuf;
use tesdf::base::Named as _;
use tesdf::encode::EncodeOptions;
use tesdf_cli::terminal::parse;

use parry3d::math::Vector;
use rayon::{ThreadPool, ThreadPoolBuilder};
use tesdf::TeSdf;
use tesdf::glam::DVec3;
use tesdf::query::Precision;

use super::input::{Input, Preset};
use super::parry::Peer;
use super::timing::{PASSES, best_pass};
use super::{Failure, heading, output, parry, points};
use crate::reference::Reference;

/// Arguments of `tesdf-lab query`.
#[derive(clap::Args)]
pub struct Args {
    /// Mesh files; they are repaired first if necessary
    #[arg(required = true)]
    meshes: Vec<PathBuf>,
    /// Preset of the encoder
    #[arg(long, value_parser = parse::named::<Preset>(), default_value_t = Preset::Default)]
    preset: Preset,
    /// Number of points of each kind per mesh
    #[arg(long, default_value_t = 100_000, value_parser = clap::value_parser!(u32).range(1..))]
    points: u32,
    /// Seed of the random points
    #[arg(long, default_value_t = 1)]
    seed: u64,
}

const COLUMNS: [&str; 9] = [
    "mesh",
    "points",
    "contender",
    "ns per query",
    "parry3d / this",
    "tree / this",
    "read per query",
    "largest error / diagonal",
    "sign mistakes",
];

pub fn run(args: &Args) -> Result<(), Failure> {
    heading::print()?;
    output::line(&format!(
        "One thread, preset `{}`, {} points of each kind, seed {}; the best of {PASSES} passes after a warm-up pass. \
         All contenders return the signed distance, closest point and gradient. tesdf also returns the face, and its \
         time includes locating the cell of the point.\n\n\
         - *Near*: points uniform on the surface, then moved by up to ±{} % of the diagonal along the normal. \
         *Box*: uniform in the mesh's bounds.\n\
         - *Face tree*: the tree over all faces of the same asset in f32, without the lists; eight faces per leaf, \
         SIMD over faces, signs from the closest feature.\n\
         - *Read*: list entries, or faces and nodes of the tree.\n\
         - *Errors* are relative to an f64 tree over the mesh as read. *Sign mistakes* are relative to winding \
         numbers, where the distance is at least 1e-6 (f64: 1e-12) of the diagonal.\n",
        args.preset.name(),
        args.points,
        args.seed,
        points::NEAR * 100.0
    ))?;
    output::head(&COLUMNS, 3)?;
    let one = ThreadPoolBuilder::new().num_threads(1).build()?;
    for path in &args.meshes {
        let input = Input::read(path)?;
        let mesh = input.solid.mesh();
        let peer = Peer::new(mesh).map_err(|e| format!("{}: {e}", path.display()))?;
        let (asset, _) = input.encode(&EncodeOptions::preset(args.preset))?;
        let reference = Reference::new(mesh);
        let count = args.points as usize;
        for (kind, points) in [
            ("near", points::near_surface(mesh, count, args.seed)),
            ("box", points::in_box(mesh.bounds(), count, args.seed)),
        ] {
            let truth = reference.signed_distances(&points);
            let rows = contest(&asset, &peer, &one, &points);
            let (parry, tree) = (rows[0].seconds, rows[1].seconds);
            for row in &rows {
                let (error, mistakes) = row.compare(&truth, mesh.diagonal());
                output::row(&[
                    input.name.clone(),
                    kind.into(),
                    row.name.into(),
                    format!("{:.0}", row.seconds / count as f64 * 1e9),
                    format!("{:.2}", parry / row.seconds),
                    format!("{:.2}", tree / row.seconds),
                    row.reads.map_or("".into(), |r| format!("{r:.2}")),
                    format!("{error:.1e}"),
                    mistakes.to_string(),
                ])?;
            }
        }
    }
    Ok(())
}

/// The results of one contender at points of one kind.
struct Row {
    name: &'static str,
    seconds: f64,
    /// Mean number of list entries, or of faces and nodes, that a query reads.
    reads: Option<f64>,
    /// The signed distances that the contender found.
    found: Vec<f64>,
    /// Signs are not compared at points nearer to the surface than this fraction of the diagonal.
    sign_from: f64,
}

/// Measures all contenders: parry3d first, then the face tree.
fn contest(asset: &TeSdf, peer: &Peer, one: &ThreadPool, points: &[DVec3]) -> [Row; 5] {
    // The points are rounded before the time is measured.
    let rounded: Vec<Vector> = points.iter().map(|&p| parry::point(p)).collect();
    let mean = |reads: &dyn Fn(DVec3) -> usize| {
        Some(points.iter().map(|&p| reads(p)).sum::<usize>() as f64 / points.len() as f64)
    };
    let list_reads = mean(&|p| asset.reads(p).total());
    let tree_reads = mean(&|p| asset.reads_by_tree(p).total());
    let single = |name, precision, reads, sign_from| Row {
        name,
        seconds: best_pass(|| {
            for &p in points {
                black_box(asset.query_with(black_box(p), precision));
            }
        }),
        reads,
        found: points.iter().map(|&p| asset.query_with(p, precision).signed_distance).collect(),
        sign_from,
    };
    [
        Row {
            name: parry::NAME,
            seconds: best_pass(|| {
                for &p in &rounded {
                    let answer = peer.query(black_box(p));
                    black_box((answer.signed_distance, answer.gradient, answer.closest_point));
                }
            }),
            reads: None,
            found: rounded.iter().map(|&p| f64::from(peer.query(p).signed_distance)).collect(),
            sign_from: 1e-6,
        },
        Row {
            name: "tesdf, face tree alone, f32",
            seconds: best_pass(|| {
                for &p in points {
                    black_box(asset.query_by_tree_f32(black_box(p)));
                }
            }),
            reads: tree_reads,
            found: points.iter().map(|&p| asset.query_by_tree_f32(p).signed_distance).collect(),
            sign_from: 1e-6,
        },
        single("tesdf, one by one, f32", Precision::F32, list_reads, 1e-6),
        Row {
            name: "tesdf, batch, f32",
            seconds: one.install(|| {
                best_pass(|| {
                    black_box(asset.query_batch_f32(black_box(points)));
                })
            }),
            reads: list_reads,
            found: asset.query_batch_f32(points).iter().map(|a| a.signed_distance).collect(),
            sign_from: 1e-6,
        },
        single("tesdf, one by one, f64", Precision::F64, None, 1e-12),
    ]
}

impl Row {
    /// The largest error of an absolute distance as a fraction of the diagonal, and the number of
    /// wrong signs.
    fn compare(&self, truth: &[f64], diagonal: f64) -> (f64, usize) {
        let (mut largest, mut mistakes) = (0.0f64, 0);
        for (&found, &expected) in self.found.iter().zip(truth) {
            let error = (found.abs() - expected.abs()).abs() / diagonal;
            // NaN counts as an infinite error.
            largest = largest.max(if error.is_nan() { f64::INFINITY } else { error });
            let wrong = found.is_sign_negative() != expected.is_sign_negative();
            mistakes += usize::from(wrong && expected.abs() > self.sign_from * diagonal);
        }
        (largest, mistakes)
    }
}
