//! Compares an asset with brute force (every face for every point, and exact winding numbers), or
//! proves it.
//!
//! Input: an opened asset. Output of [`verify()`]: for each [`Precision`] the largest error, wrong
//! signs and wrong gradients, each with its point. The expected values come from the mesh in the
//! asset alone, not from the lists, the forest or the face tree. Where an asset certifies nothing,
//! its answers are compared all the same.
pub(crate) mod brute_force;
mod compare;
mod prove;
mod samples;
mod self_check;
mod true_sign;

use std::ops::ControlFlow;
use std::sync::atomic::{AtomicUsize, Ordering};

use crate::parallel::*;
use glam::DVec3;
use serde::Serialize;

use crate::TeSdf;
use crate::asset::about::Signs;
use crate::base::{Certificate, InsideRule};
use crate::mesh::{MeshError, Topology, TriangleMesh};
use crate::query::Precision;
use brute_force::BruteForce;
use compare::Comparison;
pub use compare::{ClassErrors, PrecisionReport, Promise, Worst};
pub use prove::{Claim, Fault, ProveError, ProveOptions, ProveReport, Tally, Verdict, prove};
pub use samples::PointClass;
use samples::Sampler;
pub(crate) use self_check::self_check;
use true_sign::{TrueSign, signed, unshifted};

/// Number and seed of the points of [`verify`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct VerifyOptions {
    /// Number of points. The classes alternate. An asset that certifies nothing has up to four
    /// times as many more inside its cells.
    pub samples: usize,
    /// The same seed gives the same points.
    pub seed: u64,
}

impl Default for VerifyOptions {
    fn default() -> Self {
        Self { samples: 10_000, seed: 1 }
    }
}

/// The result of [`verify`].
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct VerifyReport {
    /// Whether every answer was right within the bounds of [`Promise`], where lists are not cut.
    /// The same bounds count where nothing is [certified](Self::certified), as no answer tells that
    /// it may be wrong.
    pub passed: bool,
    /// Whether the certificate promises distances. If not, `passed` tells nothing of other points.
    pub certified: bool,
    /// Points compared, without those inside cells.
    pub samples: usize,
    /// Points compared inside cells with a list; 0 for a certified asset.
    pub cell_points: usize,
    /// Number of cells with such a point.
    pub cells: usize,
    /// Number of cells with a list.
    pub listed_cells: usize,
    /// Seed of the points.
    pub seed: u64,
    /// Number of faces in the mesh. Each point is compared with all of them.
    pub faces: usize,
    /// Number of points whose winding number was also computed without a tree.
    pub winding_brute_force: usize,
    /// Number of these points where the two winding numbers differ.
    pub winding_disagreements: usize,
    /// Diagonal of the mesh's bounds, in the mesh's unit.
    pub diagonal: f64,
    /// Results for `f32` storage, then for the `f64` path.
    pub precisions: [PrecisionReport; 2],
}

/// Why an asset cannot be compared with brute force.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum VerifyError {
    /// The mesh in the asset is not valid.
    #[error("the mesh in the file is not valid: {0}")]
    Mesh(#[from] MeshError),
    /// The mesh in the asset is not closed, so it has no inside.
    #[error("the mesh in the file is not closed: the directed edges do not balance, so nothing has a sign")]
    NotClosed,
    /// The diagonal of the mesh is not a positive length.
    #[error("the mesh in the file has the diagonal {0}; expected a positive length")]
    Diagonal(f64),
    /// The number of points is 0.
    #[error("0 points to compare; expected at least 1")]
    NoSamples,
    /// `progress` cancelled the comparison.
    #[error("the comparison was cancelled")]
    Cancelled,
}

/// For one point in this many, the winding number is also computed without a tree.
const BRUTE_FORCE_EVERY: u64 = 8;
/// Points between two calls of `progress`.
const CHUNK: u64 = 32;

/// Compares the asset with brute force at points of every [`PointClass`], on all threads of the
/// current rayon pool.
///
/// An asset that certifies nothing, such as an imported one, is compared at points inside its cells
/// too: four in each cell with a list, but no more than four times `samples` in all. It does not
/// pass if an answer is wrong by more than rounding, even though no bound is promised. A cell can
/// still be wrong between the points; [`prove`] finds it.
///
/// `progress` receives the completed fraction, 0 to 1, from any thread, and decides whether to
/// continue. Checksums are not verified; [`TeSdf::verify_checksums`] does that.
///
/// # Errors
/// [`VerifyError`]: the asset's mesh could not have been encoded, `samples` is 0, or `progress`
/// cancelled.
pub fn verify(
    asset: &TeSdf,
    options: &VerifyOptions,
    progress: impl Fn(f64) -> ControlFlow<()> + Sync,
) -> Result<VerifyReport, VerifyError> {
    if options.samples == 0 {
        return Err(VerifyError::NoSamples);
    }
    let (mesh, ids) = mesh_of(asset)?;
    let diagonal = mesh.diagonal();
    if !(diagonal.is_finite() && diagonal > 0.0) {
        return Err(VerifyError::Diagonal(diagonal));
    }
    // Where cells tell the sign, they tell that of the winding number.
    let rule = match asset.about().signs {
        Signs::Cells => InsideRule::Winding,
        _ => asset.inside().rule,
    };
    let all = all_faces(asset)?;
    if rule.needs_closed() && !Topology::new(all.faces()).is_closed() {
        return Err(VerifyError::NotClosed);
    }
    let certificate = asset.about().certificate();
    let sign = TrueSign::new(all, rule);
    let sampler = Sampler::new(asset, &mesh, &sign, *options);
    let mut place = vec![None; ids.iter().max().map_or(0, |id| *id as usize + 1)];
    ids.iter().enumerate().for_each(|(at, &id)| place[id as usize] = Some(at));
    let truth = Truth { faces: BruteForce::new(&mesh, diagonal), place, sign: &sign };
    let points = options.samples as u64 + sampler.in_cells();
    let done = AtomicUsize::new(0);
    let parts = (0..points.div_ceil(CHUNK)).into_par_iter().map(|chunk| {
        let mut found = SampleResults::new(&mesh, certificate);
        let indices = chunk * CHUNK..((chunk + 1) * CHUNK).min(points);
        let count = (indices.end - indices.start) as usize;
        indices.for_each(|index| found.add(asset, &truth, index, sampler.point(index)));
        let before = done.fetch_add(count, Ordering::Relaxed);
        match progress((before + count) as f64 / points as f64) {
            ControlFlow::Continue(()) => Some(found),
            ControlFlow::Break(()) => None,
        }
    });
    let found = try_reduce(parts, || SampleResults::new(&mesh, certificate), SampleResults::join)
        .ok_or(VerifyError::Cancelled)?;
    let precisions = found.comparisons.map(Comparison::report);
    Ok(VerifyReport {
        passed: precisions.iter().all(|p| p.passed) && found.disagreements == 0,
        certified: certificate.delta().is_some(),
        samples: options.samples,
        cell_points: sampler.in_cells() as usize,
        cells: sampler.cells_with_points() as usize,
        listed_cells: asset.about().statistics.listed_cells,
        seed: options.seed,
        faces: mesh.faces().len(),
        winding_brute_force: found.brute_force,
        winding_disagreements: found.disagreements,
        diagonal,
        precisions,
    })
}

/// The mesh with its faces in the order of the asset, and their ids in the source.
pub(crate) fn mesh_of(asset: &TeSdf) -> Result<(TriangleMesh, Vec<u32>), MeshError> {
    let vertices = asset.vertices.iter().map(|&v| DVec3::from_array(v)).collect();
    Ok((TriangleMesh::new(vertices, asset.faces.to_vec())?, asset.face_ids.to_vec()))
}

/// The faces of the surface, and those that count for the sign only.
fn all_faces(asset: &TeSdf) -> Result<TriangleMesh, MeshError> {
    let vertices = asset.vertices.iter().map(|&v| DVec3::from_array(v)).collect();
    TriangleMesh::new(vertices, [&*asset.faces, asset.sign_faces.as_deref().unwrap_or(&[])].concat())
}

/// The reference for comparisons.
struct Truth<'a> {
    faces: BruteForce,
    /// For each face id of the source, its index in `faces`.
    place: Vec<Option<usize>>,
    sign: &'a TrueSign,
}

struct SampleResults {
    comparisons: [Comparison; 2],
    brute_force: usize,
    disagreements: usize,
}

impl SampleResults {
    fn new(mesh: &TriangleMesh, certificate: &Certificate) -> Self {
        let comparison = |precision| Comparison::new(precision, mesh, certificate);
        Self {
            comparisons: [Precision::F32, Precision::F64].map(comparison),
            brute_force: 0,
            disagreements: 0,
        }
    }

    fn add(&mut self, asset: &TeSdf, truth: &Truth, index: u64, (class, p): (PointClass, DVec3)) {
        let distance = truth.faces.distance(p);
        let inside = truth.sign.is_inside(p);
        // Nearer than this bound, rounding could put the point on the surface, where the other
        // method may return either number.
        let counts_all = index.is_multiple_of(BRUTE_FORCE_EVERY) && class != PointClass::InCell;
        if counts_all && distance > self.comparisons[1].promise().distance(p) {
            self.brute_force += 1;
            self.disagreements += usize::from(truth.sign.disagrees(p));
        }
        for comparison in &mut self.comparisons {
            let answer = unshifted(asset, asset.query_with(p, comparison.precision()));
            let expected = signed(distance, inside, &answer);
            // Vector from the closest point of the face that the answer names.
            let place = truth.place.get(answer.face as usize).copied().flatten();
            let offset = place.map(|at| truth.faces.offset(at, p));
            comparison.add(class, p, expected, &answer, offset);
        }
    }

    fn join(self, other: Self) -> Self {
        let [a, b] = self.comparisons;
        let [c, d] = other.comparisons;
        Self {
            comparisons: [a.join(c), b.join(d)],
            brute_force: self.brute_force + other.brute_force,
            disagreements: self.disagreements + other.disagreements,
        }
    }
}
