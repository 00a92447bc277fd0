//! Many points at once, on all processors: the mean distance over a grid, and the volume from the
//! number of grid points inside.
//!
//! `cargo run --release --example batch -- [MESH]`; the default is a torus of 1.924 28e-5 m³.
use std::error::Error;
use std::time::Instant;

use tesdf::glam::DVec3;
use tesdf::{Encoder, Preset, SolidMesh};

/// Number of points along each axis.
const GRID: usize = 64;

fn main() -> Result<(), Box<dyn Error>> {
    let torus = concat!(env!("CARGO_MANIFEST_DIR"), "/../../data/procedural/torus_5k.obj");
    let solid = SolidMesh::read(std::env::args_os().nth(1).unwrap_or(torus.into()))?;
    let bounds = solid.mesh().bounds();
    let asset = Encoder::new().preset(Preset::Fast).encode(&solid)?;

    let middle = |i: usize| (i as f64 + 0.5) / GRID as f64;
    let points: Vec<DVec3> = (0..GRID.pow(3))
        .map(|i| DVec3::new(middle(i % GRID), middle(i / GRID % GRID), middle(i / GRID / GRID)))
        .map(|unit| bounds.min + unit * bounds.extent())
        .collect();

    let start = Instant::now();
    let answers = asset.query_batch_f32(&points);
    let seconds = start.elapsed().as_secs_f64();
    let inside = answers.iter().filter(|a| a.signed_distance < 0.0).count();
    let mean = answers.iter().map(|a| a.signed_distance.abs()).sum::<f64>() / points.len() as f64;
    println!("{} points in {:.1} ms, mean distance {mean:e}", points.len(), 1e3 * seconds);

    // The volume by the divergence theorem, exact, against the share of the points that are inside.
    let volume: f64 = (0..solid.mesh().faces().len())
        .map(|f| solid.mesh().triangle(f).map(|p| p - bounds.center()))
        .map(|[a, b, c]| a.cross(b).dot(c) / 6.0)
        .sum();
    let counted = bounds.extent().element_product() * inside as f64 / points.len() as f64;
    println!("volume {volume:e}, counted {counted:e}");
    assert!((counted / volume - 1.0).abs() < 0.05);

    // Answers come in the order of the points, the same as one by one.
    for i in (0..points.len()).step_by(997) {
        assert_eq!(answers[i], asset.query_f32(points[i]));
    }
    Ok(())
}
