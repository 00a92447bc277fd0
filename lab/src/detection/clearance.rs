//! `tesdf-lab clearance MESH…`: the cost of the clearance of bodies that are deep in each other.
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Instant;

use serde::Serialize;
use tesdf::collide::{ClearanceOptions, CollideError, Instance, Pose, Scene, clearance};
use tesdf::glam::DVec3;
use tesdf::{EncodeOptions, TeSdf};
use tesdf_cli::terminal::interrupt;
use tesdf_cli::terminal::report::{self, Failure};

use super::frames::geometry;
use super::poses::{in_cube, rotation};
use super::report::ms;
use crate::heading;

/// Arguments of `tesdf-lab clearance`.
#[derive(clap::Args, Debug)]
pub struct Args {
    /// The bodies: mesh files or `.tesdf` files
    #[arg(required = true, value_name = "MESH|ASSET")]
    pub bodies: Vec<PathBuf>,
    /// Number of random pairs of bodies, each in a random pose
    #[arg(long, value_name = "N", default_value_t = 200, value_parser = clap::value_parser!(u32).range(1..=100_000))]
    pub pairs: u32,
    /// Seed of the pairs and their poses
    #[arg(long, value_name = "SEED", default_value_t = 1)]
    pub seed: u64,
    /// Print all pairs, as a JSON array
    #[arg(long)]
    pub json: bool,
}

/// The clearance of a pair. Lengths are relative to the diagonal of the smaller body.
#[derive(Serialize)]
struct Measured {
    a: String,
    b: String,
    distance: f64,
    /// No point is deeper than this.
    lower_bound: f64,
    converged: bool,
    ms: f64,
}

/// A body and its name.
type Body = (Arc<TeSdf>, String);

/// Measures the clearance of random pairs and prints the result.
///
/// # Errors
/// A file cannot be read, or its mesh cannot be encoded.
pub fn run(args: &Args) -> Result<(), Failure> {
    let interrupted = interrupt::flag();
    let open = |path: &PathBuf| -> Result<Body, Failure> {
        Ok((geometry(path, &EncodeOptions::default(), interrupted)?, name(path)))
    };
    let bodies = args.bodies.iter().map(open).collect::<Result<Vec<_>, _>>()?;
    let mut random = fastrand::Rng::with_seed(args.seed);
    let pair = |_| {
        let [a, b] = [0, 1].map(|_| &bodies[random.usize(..bodies.len())]);
        measure(a, b, &mut random).map_err(|e| Failure::new(format!("{} and {}: {e}", a.1, b.1)))
    };
    let pairs = (0..args.pairs).map(pair).collect::<Result<Vec<Measured>, _>>()?;
    if args.json {
        report::json(&pairs)?;
    } else {
        report::text(&text(pairs))?;
    }
    Ok(())
}

fn name(path: &Path) -> String {
    path.file_stem().unwrap_or_default().to_string_lossy().into_owned()
}

/// Body *a* has the diagonal 1, body *b* one of 0.5 to 1.5. The centres of a ball inside of each
/// are close to each other.
fn measure(
    (a, name_a): &Body,
    (b, name_b): &Body,
    random: &mut fastrand::Rng,
) -> Result<Measured, CollideError> {
    let mut scene = Scene::new();
    let (size, at) = (0.5 + random.f64(), 0.1 * in_cube(random));
    let mut add = |asset: &Arc<TeSdf>, size: f64, at: DVec3| {
        let scale = size / asset.bounds().extent().length();
        let shape = scene.add_shape(asset.clone())?;
        let center = scene.shape(shape)?.inner_ball().map_or(asset.bounds().center(), |(center, _)| center);
        let rotation = rotation(random);
        let pose = Pose::new(at - rotation * (scale * center), rotation)?;
        scene.add(Instance { scale, ..Instance::new(shape, pose) })
    };
    let a = add(a, 1.0, DVec3::ZERO)?;
    let b = add(b, size, at)?;
    let options = ClearanceOptions::default();
    let start = Instant::now();
    let found = clearance(&scene, a, b, &options)?;
    let ms = ms(start.elapsed());
    let smaller = size.min(1.0);
    Ok(Measured {
        a: name_a.clone(),
        b: name_b.clone(),
        distance: found.distance / smaller,
        lower_bound: found.lower_bound / smaller,
        converged: found.converged,
        ms,
    })
}

/// Heading, spread of the times, and the slowest pairs.
fn text(mut pairs: Vec<Measured>) -> String {
    pairs.sort_by(|x, y| y.ms.total_cmp(&x.ms));
    let count = |is: &dyn Fn(&Measured) -> bool| pairs.iter().filter(|p| is(p)).count();
    let share = |of: f64| pairs[((pairs.len() - 1) as f64 * (1.0 - of)) as usize].ms;
    let mut text = heading::lines();
    let total = pairs.iter().map(|p| p.ms).sum::<f64>();
    let _ = writeln!(
        text,
        "- {} pairs, {} overlap, {} not converged",
        pairs.len(),
        count(&|p| p.distance < 0.0),
        count(&|p| !p.converged)
    );
    let _ = writeln!(
        text,
        "- ms per pair: mean {:.3}, median {:.3}, 90 % within {:.3}, 99 % within {:.3}\n",
        total / pairs.len() as f64,
        share(0.5),
        share(0.9),
        share(0.99)
    );
    let _ =
        writeln!(text, "| a | b | clearance / smaller diagonal | converged | ms |\n|---|---|---:|---|---:|");
    for p in pairs.iter().take(SLOWEST) {
        let _ = writeln!(text, "| {} | {} | {:.9} | {} | {:.2} |", p.a, p.b, p.distance, p.converged, p.ms);
    }
    text
}

/// Number of pairs in the table.
const SLOWEST: usize = 10;
