//! Compares encoded distances with exact distances on a regular grid, as in Tables I and IV of the
//! paper.
//!
//! Input: one or more assets of the same mesh, and the fineness of the grid. Output: for each asset
//! a [`BandReport`] with the largest error and the error-free bands around the surface.
//!
//! The exact distance is computed once per point for all assets. It comes from a tree over all
//! faces of the mesh and from another triangle routine than that of queries. It uses no lists, no
//! cells and none of the assets' own trees. The grid is streamed: nothing is stored per point. The
//! reports are the same for any number of threads.
mod grid;
mod reference;
mod report;

use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

use crate::parallel::*;
use glam::DVec3;

use crate::TeSdf;
use crate::asset::about::Signs;
use crate::mesh::{MeshError, Topology};
use crate::query::{Place, Precision};
use crate::verify::mesh_of;
pub use grid::{Grid, MAX_FINENESS};
use reference::Reference;
pub use report::BandReport;
use report::Tally;

/// Fineness of the grid and tolerance of [`evaluate`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EvaluateOptions {
    /// Voxels along the diagonal of the mesh's bounds.
    pub fineness: u32,
    /// Errors up to this fraction of the diagonal count as zero.
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
    /// `assets` is empty.
    #[error("there is no asset to evaluate; give one or more of the same mesh")]
    Empty,
    /// The assets encode different meshes.
    #[error(
        "asset {asset} (0-based) has another mesh than asset 0; evaluate assets of different meshes apart"
    )]
    OtherMesh {
        /// Index of the first asset whose mesh differs, 0-based.
        asset: usize,
    },
    /// The fineness is out of range.
    #[error("a grid of {found} voxels along the diagonal; expected 1 to {MAX_FINENESS}")]
    Fineness {
        /// The fineness found.
        found: u32,
    },
    /// The mesh in an asset is not valid.
    #[error("the mesh in the asset is not valid: {0}")]
    Mesh(#[from] MeshError),
    /// The mesh in an asset is not closed, so it has no inside.
    #[error("the mesh in the asset is not closed: the directed edges do not balance, so nothing has a sign")]
    NotClosed,
    /// The inside of an asset is not that of the winding number of its faces.
    #[error("the inside of an asset is by a rule that the grid does not know; use `tesdf verify`")]
    Rule,
}

/// Compares each asset with the exact signed distance of its mesh, in `f64`, at all grid points
/// that lie in its domain.
///
/// `progress` receives the completed fraction, 0 to 1, from any thread. Runs in the current rayon
/// pool.
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
    if assets.iter().any(|asset| asset.about().signs != Signs::Cells) {
        return Err(EvaluateError::Rule);
    }
    if !Topology::new(mesh.faces()).is_closed() {
        return Err(EvaluateError::NotClosed);
    }
    let reference = Reference::new(&mesh)?;
    let fields: Vec<Field> = assets.iter().map(|&asset| Field::new(asset, options.exact)).collect();
    let slabs = grid.counts[2];
    let done = AtomicU64::new(0);
    let tallies = (0..slabs).into_par_iter().map(|z| {
        let tallies = slab(&grid, z, &reference, &fields);
        let done = done.fetch_add(1, Ordering::Relaxed) + 1;
        progress(done as f64 / slabs as f64);
        tallies
    });
    let none = || vec![Tally::default(); fields.len()];
    let tallies = reduce(tallies, none, |a, b| a.into_iter().zip(b).map(|(a, b)| a.join(b)).collect());
    let report = |(tally, field): (Tally, &Field)| {
        let wrong = field.wrong.iter().filter(|w| w.load(Ordering::Relaxed)).count();
        BandReport::new(tally, &grid, wrong, field.exact)
    };
    Ok(tallies.into_iter().zip(&fields).map(report).collect())
}

/// Faces sorted by their id in the source. Truncation and the choice of the encoder may change the
/// order of faces in the file, but not the faces.
fn sorted_faces(asset: &TeSdf) -> Vec<(u32, [u32; 3])> {
    let mut faces: Vec<_> = asset.face_ids.iter().copied().zip(asset.faces.iter().copied()).collect();
    faces.sort_unstable();
    faces
}

/// An asset and the set of its cells with an error.
struct Field<'a> {
    asset: &'a TeSdf,
    /// Largest error that counts as zero, in the mesh's unit.
    exact: f64,
    /// For each word of the forest: whether its cell has an error.
    wrong: Vec<AtomicBool>,
}

impl<'a> Field<'a> {
    fn new(asset: &'a TeSdf, exact: f64) -> Self {
        let wrong = (0..asset.nodes.len()).map(|_| AtomicBool::new(false)).collect();
        Self { asset, exact: exact * asset.bounds().extent().length(), wrong }
    }
}

impl Field<'_> {
    /// Signed distance at a point of the local frame that is located at `place`, in the mesh's
    /// unit.
    fn signed_distance(&self, local: DVec3, place: Place) -> f64 {
        let found = self.asset.found_at(local, place, Precision::F64);
        found.signed_distance * self.asset.frame.inverse_scale()
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
                let local = field.asset.frame.to_local(p);
                let (place, word) = field.asset.locate_with_word(local);
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
