//! An asset against brute force: every face for every point, and exact winding numbers.
//!
//! Comes in: an opened asset. Goes out: for each [`Precision`] the largest error, wrong signs and wrong gradients, each with
//! the point where it is. Nothing of the lists, the forest or the face tree is used for the comparison, only the mesh that
//! the asset holds.
pub(crate) mod brute_force;
mod compare;
mod prove;
mod samples;
mod self_check;

use std::ops::ControlFlow;
use std::sync::atomic::{AtomicUsize, Ordering};

use glam::DVec3;
use rayon::prelude::*;
use serde::Serialize;

use crate::TeSdf;
use crate::asset::about::Certificate;
use crate::geometry::WindingNumber;
use crate::mesh::{MeshError, Topology, TriangleMesh};
use crate::query::Precision;
use brute_force::BruteForce;
use compare::Comparison;
pub use compare::{ClassErrors, PrecisionReport, Promise, Worst};
pub use prove::{Claim, Fault, ProveError, ProveOptions, ProveReport, Tally, Verdict, prove};
pub use samples::PointClass;
use samples::Sampler;
pub(crate) use self_check::self_check;

/// How much [`verify`] does.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct VerifyOptions {
    /// Number of points; their classes take turns.
    pub samples: usize,
    /// The same seed gives the same points.
    pub seed: u64,
}

impl Default for VerifyOptions {
    fn default() -> Self {
        Self { samples: 10_000, seed: 1 }
    }
}

/// What [`verify`] found.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct VerifyReport {
    /// Whether every promise was kept.
    pub passed: bool,
    /// Points compared.
    pub samples: usize,
    /// Seed of the points.
    pub seed: u64,
    /// Faces that each point was compared with.
    pub faces: usize,
    /// Points whose winding number was also found without any tree.
    pub winding_brute_force: usize,
    /// Of those, points where both ways differ.
    pub winding_disagreements: usize,
    /// Diagonal of the mesh's bounds, in its unit.
    pub diagonal: f64,
    /// `f32` storage, then the `f64` path.
    pub precisions: [PrecisionReport; 2],
}

/// Why an asset cannot be compared with brute force.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum VerifyError {
    /// The mesh in the asset is not valid.
    #[error("the mesh in the file is not valid: {0}")]
    Mesh(#[from] MeshError),
    /// The mesh in the asset has no inside.
    #[error("the mesh in the file is not closed: the directed edges do not balance, so nothing has a sign")]
    NotClosed,
    /// The mesh in the asset is a point.
    #[error("the mesh in the file has the diagonal {0}; expected a positive length")]
    Diagonal(f64),
    /// No points were asked for.
    #[error("0 points to compare; expected at least 1")]
    NoSamples,
    /// `progress` said so.
    #[error("the comparison was cancelled")]
    Cancelled,
}

/// One point in so many has its winding number found without a tree as well.
const BRUTE_FORCE_EVERY: u64 = 8;
/// Points between two calls of `progress`.
const CHUNK: u64 = 32;

/// Compares the asset with brute force at points of every [`PointClass`], from all threads of the current rayon pool.
///
/// `progress` is told the share done, 0 to 1, from any thread, and says whether to go on. Checksums are not looked at: that is
/// [`TeSdf::verify_checksums`].
///
/// # Errors
/// [`VerifyError`]: the asset's mesh is not one that could have been encoded, or `progress` broke off.
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
    if !Topology::new(mesh.faces()).is_closed() {
        return Err(VerifyError::NotClosed);
    }
    let certificate = asset.about().certificate();
    let winding = WindingNumber::new(&mesh);
    let sampler = Sampler::new(asset, &mesh, &winding, options.seed);
    let mut place = vec![None; ids.len()];
    ids.iter().enumerate().for_each(|(at, &id)| place[id as usize] = Some(at));
    let truth = Truth { faces: BruteForce::new(&mesh, diagonal), place, winding: &winding, mesh: &mesh };
    let samples = options.samples as u64;
    let done = AtomicUsize::new(0);
    let found = (0..samples.div_ceil(CHUNK))
        .into_par_iter()
        .map(|chunk| {
            let mut found = Found::new(&mesh, certificate);
            let indices = chunk * CHUNK..((chunk + 1) * CHUNK).min(samples);
            let count = (indices.end - indices.start) as usize;
            indices.for_each(|index| found.add(asset, &truth, index, sampler.point(index)));
            let before = done.fetch_add(count, Ordering::Relaxed);
            match progress((before + count) as f64 / options.samples as f64) {
                ControlFlow::Continue(()) => Some(found),
                ControlFlow::Break(()) => None,
            }
        })
        .try_reduce(|| Found::new(&mesh, certificate), |a, b| Some(a.join(b)))
        .ok_or(VerifyError::Cancelled)?;
    let precisions = found.comparisons.map(Comparison::report);
    Ok(VerifyReport {
        passed: precisions.iter().all(|p| p.passed) && found.disagreements == 0,
        samples: options.samples,
        seed: options.seed,
        faces: mesh.faces().len(),
        winding_brute_force: found.brute_force,
        winding_disagreements: found.disagreements,
        diagonal,
        precisions,
    })
}

/// The mesh in the order of the asset's faces, and their ids in the source.
pub(crate) fn mesh_of(asset: &TeSdf) -> Result<(TriangleMesh, Vec<u32>), MeshError> {
    let vertices = asset.vertices.iter().map(|&v| DVec3::from_array(v)).collect();
    Ok((TriangleMesh::new(vertices, asset.faces.to_vec())?, asset.face_ids.to_vec()))
}

/// What the answers are compared with.
struct Truth<'a> {
    faces: BruteForce,
    /// Place in `faces` of each face of the source.
    place: Vec<Option<usize>>,
    winding: &'a WindingNumber,
    mesh: &'a TriangleMesh,
}

struct Found {
    comparisons: [Comparison; 2],
    brute_force: usize,
    disagreements: usize,
}

impl Found {
    fn new(mesh: &TriangleMesh, certificate: &Certificate) -> Self {
        let comparison = |precision| Comparison::new(precision, mesh, certificate);
        Self {
            comparisons: [Precision::F32, Precision::F64].map(comparison),
            brute_force: 0,
            disagreements: 0,
        }
    }

    fn add(&mut self, asset: &TeSdf, truth: &Truth, index: u64, p: DVec3) {
        let class = PointClass::of_index(index);
        let distance = truth.faces.distance(p);
        let winding = truth.winding.at_perturbed(p);
        // Where rounding could put the point on the surface, either answer of the other way is right.
        if index.is_multiple_of(BRUTE_FORCE_EVERY) && distance > self.comparisons[1].promise().distance(p) {
            self.brute_force += 1;
            self.disagreements += usize::from(WindingNumber::brute_force(truth.mesh, p) != winding);
        }
        let expected = if winding >= 1 { -distance } else { distance };
        for comparison in &mut self.comparisons {
            let answer = asset.query(p, comparison.precision());
            // From the closest point of the face that the answer names.
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
