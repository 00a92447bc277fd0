//! `tesdf-lab reencode`: the cost of re-encoding a deformed mesh.
use std::ops::ControlFlow;
use std::path::PathBuf;
use std::time::Instant;

use tesdf::domain::ConformingMesh;
use tesdf::domain::gmsh::{GmshOptions, tetrahedralise};
use tesdf::encode::{Domain, EncodeOptions, Encoder, Refinement};
use tesdf::glam::{DQuat, DVec3};
use tesdf::verify::{VerifyOptions, verify};
use tesdf::{Length, TeSdf};

use super::input::{Input, Preset};
use super::{Failure, heading, output};

/// Arguments of `tesdf-lab reencode`.
#[derive(clap::Args)]
pub struct Args {
    /// A mesh file; it is deformed in a Gmsh domain with a band of 5 % of the diagonal
    mesh: PathBuf,
    /// Fractions of the length, from one end, that are bent
    #[arg(long, value_delimiter = ',', default_values_t = [0.02, 0.05, 0.1, 0.2, 0.5, 1.0])]
    shares: Vec<f64>,
    /// Bending angle at the end, degrees per length of the mesh
    #[arg(long, default_value_t = 5.0)]
    bend: f64,
    /// Number of points at which the re-encoded asset is compared with brute force
    #[arg(long, default_value_t = 5000)]
    samples: usize,
}

const COLUMNS: [&str; 9] = [
    "bent, of the length",
    "vertices moved",
    "cells looked at",
    "cells stale",
    "move and refit, ms",
    "find and re-encode, ms",
    "encode anew, ms",
    "share of that",
    "largest error / diagonal after",
];

pub fn run(args: &Args) -> Result<(), Failure> {
    let input = Input::read(&args.mesh)?;
    let band = Some(Length::OfDiagonal(0.05));
    let domain = tetrahedralise(&input.solid, &GmshOptions { band, ..GmshOptions::default() })?;
    let options = EncodeOptions { refinement: Refinement::None, ..EncodeOptions::preset(Preset::Default) };
    let encode = || -> Result<(TeSdf, f64), Failure> {
        let start = Instant::now();
        let asset = Encoder::new()
            .options(options.clone())
            .domain(Domain::Conforming(&domain))
            .encode(&input.solid)?;
        Ok((asset, 1e3 * start.elapsed().as_secs_f64()))
    };
    let (rest, anew) = encode()?;
    heading::print()?;
    output::line(&format!(
        "{}: {} tetrahedra as Gmsh made them, {} cells with a list. One end is bent about a transverse axis, by {} degrees per \
         length; the rest stays. All threads.\n",
        input.name,
        domain.tetrahedra().len(),
        rest.about().statistics.listed_cells,
        args.bend
    ))?;
    output::head(&COLUMNS, 1)?;
    for &share in &args.shares {
        let moves = bent(&domain, &rest, share, args.bend.to_radians());
        let mut asset = rest.clone();
        let start = Instant::now();
        let moved = asset.move_vertices(&moves)?;
        let moving = 1e3 * start.elapsed().as_secs_f64();
        if !moved.inverted.is_empty() {
            return Err(format!("{} tetrahedra were turned over; bend it less", moved.inverted.len()).into());
        }
        let start = Instant::now();
        let reencoded = asset.reencode_stale()?;
        let reencoding = 1e3 * start.elapsed().as_secs_f64();
        let report =
            verify(&asset, &VerifyOptions { samples: args.samples, seed: 1 }, |_| ControlFlow::Continue(()))?;
        if !report.passed {
            return Err(format!("bent by a share of {share}, it is not exact after re-encoding").into());
        }
        let percent = |n: usize, of: usize| format!("{:.1} %", 100.0 * n as f64 / of as f64);
        output::row(&[
            format!("{:.0} %", 100.0 * share),
            percent(moves.len(), domain.vertices().len()),
            percent(reencoded.checked, reencoded.cells),
            percent(reencoded.stale.len(), reencoded.cells),
            format!("{moving:.1}"),
            format!("{reencoding:.0}"),
            format!("{anew:.0}"),
            format!("{:.2}", reencoding / anew),
            format!("{:.1e}", report.precisions[1].largest_error_of_diagonal),
        ])?;
    }
    Ok(())
}

/// The vertices in the last `share` of the longest axis, rotated about a transverse axis. The angle
/// grows with the distance from the start of the bend.
fn bent(domain: &ConformingMesh, rest: &TeSdf, share: f64, angle: f64) -> Vec<(u32, DVec3)> {
    let bounds = rest.bounds();
    let extent = bounds.extent();
    let along = (0..3).fold(0, |best, k| if extent[k] > extent[best] { k } else { best });
    let across = DVec3::AXES[(along + 1) % 3];
    let from = bounds.max[along] - share * extent[along];
    let mut pivot = bounds.center();
    pivot[along] = from;
    let moved = |p: DVec3| {
        let beyond = (p[along] - from) / extent[along];
        (beyond > 0.0).then(|| pivot + DQuat::from_axis_angle(across, angle * beyond) * (p - pivot))
    };
    (0..).zip(domain.vertices()).filter_map(|(id, &p)| moved(p).map(|q| (id, q))).collect()
}
