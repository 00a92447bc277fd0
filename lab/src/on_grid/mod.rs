//! Compares encoded distances with exact distances on a regular grid, as in Tables I and IV of the
//! paper.
//!
//! Input: one or more assets of the same mesh, and the fineness of the grid. Output: for each asset
//! a [`BandReport`] with the largest error and the error-free bands around the surface.
//!
//! The exact distance is computed once per point for all assets, from a tree over all faces of the
//! mesh, without lists and cells. The grid is streamed: nothing is stored per point. The reports are the same for
//! any number of threads.
mod grid;
mod report;

use std::sync::atomic::{AtomicU64, Ordering};

use rayon::prelude::*;
use tesdf::TeSdf;
use tesdf::glam::DVec3;
use tesdf::mesh::{MeshError, TriangleMesh};
use tesdf::query::internal::cell_at;

use crate::reference::Reference;
pub use grid::{Grid, MAX_FINENESS};
pub use report::BandReport;
use report::Tally;

/// Errors up to this fraction of the diagonal count as zero.
pub const EXACT: f64 = 1e-6;

/// Compares each asset with the exact signed distance of its mesh, in `f64`, at all grid points
/// that lie in its domain. `fineness` is the number of voxels along the diagonal of the mesh's
/// bounds, 1 to [`MAX_FINENESS`]. The assets encode the same closed mesh.
///
/// `progress` receives the completed fraction, 0 to 1, from any thread. Runs in the current rayon
/// pool.
///
/// # Errors
/// The mesh in the first asset is not valid.
pub fn compare(
    assets: &[&TeSdf],
    fineness: u32,
    progress: impl Fn(f64) + Sync,
) -> Result<Vec<BandReport>, MeshError> {
    let Some(first) = assets.first() else { return Ok(Vec::new()) };
    let grid = Grid::of(assets, fineness);
    let reference = Reference::new(&mesh_of(first)?);
    let fields: Vec<Field> = assets.iter().map(|&asset| Field::new(asset)).collect();
    let slabs = grid.counts[2];
    let done = AtomicU64::new(0);
    // In the order of the grid.
    let tallies: Vec<Vec<Tally>> = (0..slabs)
        .into_par_iter()
        .map(|z| {
            let tallies = slab(&grid, z, &reference, &fields);
            progress((done.fetch_add(1, Ordering::Relaxed) + 1) as f64 / slabs as f64);
            tallies
        })
        .collect();
    let joined = tallies
        .into_iter()
        .reduce(|a, b| a.into_iter().zip(b).map(|(a, b)| a.join(b)).collect())
        .unwrap_or_else(|| vec![Tally::default(); fields.len()]);
    Ok(joined
        .into_iter()
        .zip(&fields)
        .map(|(tally, field)| BandReport::new(tally, &grid, field.exact))
        .collect())
}

/// The mesh of an asset.
fn mesh_of(asset: &TeSdf) -> Result<TriangleMesh, MeshError> {
    let faces: Vec<[u32; 3]> = (0..asset.face_count()).map(|face| asset.face_vertices(face)).collect();
    let count = faces.as_flattened().iter().max().map_or(0, |&last| last as usize + 1);
    let mut vertices = vec![DVec3::ZERO; count];
    for (face, ids) in faces.iter().enumerate() {
        for (&id, corner) in ids.iter().zip(asset.face_corners(face)) {
            vertices[id as usize] = corner;
        }
    }
    TriangleMesh::new(vertices, faces)
}

/// An asset, and the largest error that counts as zero, in the mesh's unit.
struct Field<'a> {
    asset: &'a TeSdf,
    exact: f64,
}

impl<'a> Field<'a> {
    fn new(asset: &'a TeSdf) -> Self {
        Self { asset, exact: EXACT * asset.bounds().extent().length() }
    }
}

/// Compares all points with one z, row by row.
fn slab(grid: &Grid, z: u64, reference: &Reference, fields: &[Field]) -> Vec<Tally> {
    let mut tallies = vec![Tally::default(); fields.len()];
    for y in 0..grid.counts[1] {
        let mut walk = reference.walk();
        for x in 0..grid.counts[0] {
            let p = grid.point([x, y, z]);
            let mut exact = None;
            for (field, tally) in fields.iter().zip(&mut tallies) {
                let Some((cell, listed)) = cell_at(field.asset, p) else {
                    tally.outside();
                    continue;
                };
                let exact = *exact.get_or_insert_with(|| walk.signed_distance(p));
                let error = match (field.asset.signed_distance(p) - exact).abs() {
                    error if error.is_nan() => f64::INFINITY,
                    error => error,
                };
                tally.add(p, exact, error, !listed);
                if error > field.exact {
                    tally.add_inexact(cell, exact, error);
                }
            }
        }
    }
    tallies
}
