//! Encoded distances against exact ones on a regular grid, as in Tables I and IV of the paper.
//!
//! Comes in: one or several assets of the same mesh, and how fine the grid is. Goes out: for each asset a [`BandReport`], with
//! the largest error and the bands around the surface in which there is none.
//!
//! The exact distance is found once per point for all assets, from a tree over all faces of the mesh and with another routine
//! for triangles than queries use; nothing of lists, cells or the assets' own trees is part of it. The grid is streamed:
//! nothing is stored per point. The same reports on any number of threads.
mod grid;
mod reference;
mod report;

use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

use glam::DVec3;
use rayon::prelude::*;

use crate::TeSdf;
use crate::mesh::{MeshError, Topology};
use crate::query::{Place, Precision};
use crate::verify::mesh_of;
pub use grid::{Grid, MAX_FINENESS};
use reference::Reference;
pub use report::BandReport;
use report::Tally;

/// How fine [`evaluate`] looks.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EvaluateOptions {
    /// Voxels along the diagonal of the mesh's bounds.
    pub fineness: u32,
    /// Errors up to this share of the diagonal count as none.
    pub exact: f64,
}

impl Default for EvaluateOptions {
    /// The grid of the paper.
    fn default() -> Self {
        Self { fineness: 1 << 10, exact: 1e-6 }
    }
}

/// Why assets cannot be evaluated.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum EvaluateError {
    /// There is none.
    #[error("there is no asset to evaluate; give one or more of the same mesh")]
    Empty,
    /// The assets are not of one mesh.
    #[error(
        "asset {asset} (0-based) has another mesh than asset 0; evaluate assets of different meshes apart"
    )]
    OtherMesh {
        /// The first asset that differs, 0-based.
        asset: usize,
    },
    /// The grid has no meaning.
    #[error("a grid of {found} voxels along the diagonal; expected 1 to {MAX_FINENESS}")]
    Fineness {
        /// The number found.
        found: u32,
    },
    /// The mesh in an asset is not valid.
    #[error("the mesh in the asset is not valid: {0}")]
    Mesh(#[from] MeshError),
    /// The mesh in an asset has no inside.
    #[error("the mesh in the asset is not closed: the directed edges do not balance, so nothing has a sign")]
    NotClosed,
}

/// Compares each asset with the exact signed distance of its mesh at all points of a grid that lie in its domain, in `f64`.
///
/// `progress` is told the share done, 0 to 1, from any thread. Runs in the current rayon pool.
///
/// # Errors
/// [`EvaluateError`].
pub fn evaluate(
    assets: &[&TeSdf],
    options: &EvaluateOptions,
    progress: impl Fn(f64) + Sync,
) -> Result<Vec<BandReport>, EvaluateError> {
    let Some(first) = assets.first() else { return Err(EvaluateError::Empty) };
    let same = |a: &TeSdf| a.vertices[..] == first.vertices[..] && sorted_faces(a) == sorted_faces(first);
    if let Some(asset) = assets.iter().position(|a| !same(a)) {
        return Err(EvaluateError::OtherMesh { asset });
    }
    let grid = Grid::of(assets, options.fineness)?;
    let (mesh, _) = mesh_of(first)?;
    if !Topology::new(mesh.faces()).is_closed() {
        return Err(EvaluateError::NotClosed);
    }
    let reference = Reference::new(&mesh)?;
    let fields: Vec<Field> = assets.iter().map(|&asset| Field::new(asset, options.exact)).collect();
    let slabs = grid.counts[2];
    let done = AtomicU64::new(0);
    let tallies = (0..slabs)
        .into_par_iter()
        .map(|z| {
            let tallies = slab(&grid, z, &reference, &fields);
            let done = done.fetch_add(1, Ordering::Relaxed) + 1;
            progress(done as f64 / slabs as f64);
            tallies
        })
        .reduce(
            || vec![Tally::default(); fields.len()],
            |a, b| a.into_iter().zip(b).map(|(a, b)| a.join(b)).collect(),
        );
    let report = |(tally, field): (Tally, &Field)| {
        let wrong = field.wrong.iter().filter(|w| w.load(Ordering::Relaxed)).count();
        BandReport::new(tally, &grid, wrong, field.exact)
    };
    Ok(tallies.into_iter().zip(&fields).map(report).collect())
}

/// Faces by id in the source: truncation and encoders do not change them, their order in the file may.
fn sorted_faces(asset: &TeSdf) -> Vec<(u32, [u32; 3])> {
    let mut faces: Vec<_> = asset.face_ids.iter().copied().zip(asset.faces.iter().copied()).collect();
    faces.sort_unstable();
    faces
}

/// An asset, and its cells in which there was an error.
struct Field<'a> {
    asset: &'a TeSdf,
    /// Largest error that counts as none, mesh unit.
    exact: f64,
    /// By word of the forest.
    wrong: Vec<AtomicBool>,
}

impl<'a> Field<'a> {
    fn new(asset: &'a TeSdf, exact: f64) -> Self {
        let wrong = (0..asset.nodes.len()).map(|_| AtomicBool::new(false)).collect();
        Self { asset, exact: exact * asset.bounds().extent().length(), wrong }
    }
}

impl Field<'_> {
    /// At a point of the local frame, as its place in the domain answers it, in the mesh's unit.
    fn signed_distance(&self, local: DVec3, place: Place) -> f64 {
        let found = self.asset.found_at(local, place, Precision::F64);
        found.signed_distance * self.asset.frame.inverse_scale()
    }
}

/// All points with one z, row by row.
fn slab(grid: &Grid, z: u64, reference: &Reference, fields: &[Field]) -> Vec<Tally> {
    let mut tallies = vec![Tally::default(); fields.len()];
    for y in 0..grid.counts[1] {
        let mut walk = reference.walk();
        for x in 0..grid.counts[0] {
            let p = grid.point([x, y, z]);
            let mut exact = None;
            for (field, tally) in fields.iter().zip(&mut tallies) {
                let local = field.asset.frame.to_local(p);
                let (place, word) = field.asset.place_and_word(local);
                if let Place::NotOfDomain = place {
                    tally.outside();
                    continue;
                }
                let exact = *exact.get_or_insert_with(|| walk.signed_distance(p));
                let error = match (field.signed_distance(local, place) - exact).abs() {
                    error if error.is_nan() => f64::INFINITY,
                    error => error,
                };
                let by_tree = matches!(place, Place::Far(_));
                tally.add(p, exact, error, by_tree);
                if error > field.exact {
                    tally.add_inexact(exact, error);
                    field.wrong[word].store(true, Ordering::Relaxed);
                }
            }
        }
    }
    tallies
}
