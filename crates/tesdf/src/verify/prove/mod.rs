//! Proves, cell by cell, that an asset answers as its certificate says.
//!
//! Input: an opened asset. Output: for every cell, whether no face outside its list can be closer
//! than the list by more than the certificate's δ, and whether its sign is right; for the face
//! tree, whether it can find every face.
//!
//! ```text
//!              forest, lists, faces
//!                       │ walk            the faces that can matter in a cell
//!           ┌───────────┴──────────┐
//!        problem                 signs, roots, winding, apart
//!           │ distance                    the label of the cell
//!           │   piece ──dominance, claims──▶ settled, or cut in two
//!           ▼
//!        report ◀── face_tree
//! ```
//!
//! Shared with the encoder: the layout of the file ([`layout`](crate::asset::layout)), the corners
//! of the cells ([`Cell`]), the mapping to the local frame, and the exact predicates of the crate
//! `robust`. Not shared: distances, bounds, rules, winding numbers, trees. `docs/math.md`, section
//! 15, has the theorem.
mod apart;
mod claims;
mod distance;
mod dominance;
mod exact;
mod face_tree;
mod parts;
mod piece;
mod problem;
mod report;
mod roots;
mod signs;
mod surface;
mod walk;
mod winding;

use std::collections::HashMap;
use std::ops::ControlFlow;
use std::sync::atomic::{AtomicBool, AtomicUsize};

use crate::parallel::*;

use crate::TeSdf;
use crate::asset::about;
use crate::base::Certificate;
use crate::domain::Cell;
pub use report::{Claim, Fault, ProveReport, Tally, Verdict};
use signs::Signs;
use surface::Surface;
use walk::{CellResults, Walk};
use winding::Rays;

/// Limits of [`prove`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ProveOptions {
    /// Largest number of pieces for one cell. A cell that would need more is undecided.
    pub pieces: u64,
}

impl Default for ProveOptions {
    fn default() -> Self {
        Self { pieces: 1 << 20 }
    }
}

/// Why a proof cannot begin or was cancelled.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ProveError {
    /// Mapping a vertex to the local frame rounds it, or the vertex lies too far out.
    #[error(
        "vertex {vertex} (0-based) has no exact place within {} of the origin of the local frame; encode the mesh again",
        surface::FARTHEST
    )]
    Frame {
        /// The vertex, 0-based.
        vertex: usize,
    },
    /// The mesh is not closed, so it has no inside.
    #[error(
        "the mesh in the file is not closed: more faces run one way than the other along the edge of vertices {} and {} (0-based)",
        .edge[0], .edge[1]
    )]
    NotClosed {
        /// Vertices of an unbalanced edge, 0-based.
        edge: [u32; 2],
    },
    /// The domain is too large for the rounding bounds.
    #[error(
        "the cube of the domain reaches {reach} from the origin of the local frame; expected at most {}",
        surface::FARTHEST
    )]
    Domain {
        /// The largest absolute coordinate, in the local frame.
        reach: f64,
    },
    /// The system refuses to start more threads.
    #[error("the system refused threads with a stack of {} MiB each; ask for fewer threads", STACK >> 20)]
    Threads,
    /// `progress` cancelled the proof.
    #[error("the proof was cancelled")]
    Cancelled,
}

/// Stack size in bytes. The deepest search of a cell needs some 8 KiB for each cut, in the test
/// profile too.
const STACK: usize = 64 << 20;

/// Proves that an asset answers as its certificate says, on all threads of the current rayon pool.
///
/// - For every cell with a list: at each of its points, the list is at most δ farther than the
///   nearest of all faces.
/// - For every cell: its label is the side of all its points, or the faces that pass through it are
///   in its list. Where a rule is evaluated at points, cells whose label says so need no proof. For
///   the generalised winding number of an open mesh, the bound of the label is that of the encoder;
///   the rest of the proof is independent.
/// - For the face tree: its leaves name each face once, and its boxes contain the faces.
///
/// δ is that of the certificate. When the certificate promises nothing, δ is that of the certified
/// encoder. For an asset with truncated lists, only points within the certificate's exactness
/// distance are covered.
///
/// The proof does not cover the `f32` path, gradients, rays or sign hints;
/// [`verify`](super::verify) compares answers with brute force.
///
/// `progress` receives the completed fraction, 0 to 1, from any thread, and decides whether to
/// continue. The report is the same for any number of threads.
///
/// # Errors
/// [`ProveError`]: no encoder makes such an asset, the system refuses threads, or `progress`
/// cancelled.
pub fn prove(
    asset: &TeSdf,
    options: &ProveOptions,
    progress: impl Fn(f64) -> ControlFlow<()> + Sync,
) -> Result<ProveReport, ProveError> {
    let sign_faces = asset.sign_faces.as_deref().unwrap_or(&[]);
    let surface = Surface::new(&asset.vertices, [&asset.faces, sign_faces], asset.frame)?;
    let sign_faces = surface.sign_triangles(sign_faces);
    let signs_of = asset.about().signs;
    if !asset.about().certificate().jumps() && signs_of != about::Signs::Sheet {
        check_closed(asset, &surface)?;
    }
    let roots: Vec<Cell> = (0..asset.root_count()).map(|root| asset.root(root)).collect();
    let reach = roots.iter().flat_map(|c| c.corners).map(|p| p.abs().max_element()).fold(0.0, f64::max);
    if reach.is_nan() || reach > surface::FARTHEST {
        return Err(ProveError::Domain { reach });
    }
    let triangles: Vec<_> = surface.triangles.iter().map(|t| t.corners).collect();
    let counted = [triangles.as_slice(), &sign_faces].concat();
    let side = asset.cube.side().max(1.0);
    let signs = Signs {
        asset,
        surface: &surface,
        rays: Rays::new(&counted),
        sign_faces: &sign_faces,
        gap: MISSED * side,
    };

    let certificate = asset.about().certificate();
    let diagonal = asset.bounds().extent().length();
    let granted = Certificate::DELTA * side * diagonal;
    // A file cannot claim a larger δ than the encoder grants.
    let delta = certificate.delta().map_or(granted, |delta| delta.min(granted));
    let within = certificate.exactness_distance();
    let walk = Walk {
        asset,
        signs: &signs,
        options,
        delta: delta * asset.frame.scale,
        within: within.map_or(f64::INFINITY, |within| within * asset.frame.scale),
        progress,
        done: AtomicUsize::new(0),
        cancelled: AtomicBool::new(false),
    };
    let all: Vec<u32> = (0..surface.faces.len() as u32).collect();
    let cells = || (0..roots.len()).into_par_iter().map(|root| walk.root(root, &all));
    // The search recurses for each cut, so it needs large stacks.
    let mut found = with_stack(STACK, || reduce(cells(), CellResults::default, CellResults::join))
        .ok_or(ProveError::Threads)?;
    if walk.is_cancelled() {
        return Err(ProveError::Cancelled);
    }
    found.sign(match asset.conforming {
        None if signs_of == about::Signs::Cells => signs.beyond_cube(),
        None => None,
        Some(_) => signs.outside_fault(&roots),
    });
    let of_tree = face_tree::faults(asset, &triangles);
    let mut face_tree = Tally::default();
    face_tree.count(of_tree.first());
    found.faults.extend(of_tree);
    let is_proved = |t: &Tally| t.proved == t.claims;
    Ok(ProveReport {
        proved: [found.distances, found.signs, face_tree].iter().all(is_proved),
        delta,
        delta_of_diagonal: delta / diagonal,
        certified: certificate.delta().is_some(),
        within,
        distances: found.distances,
        signs: found.signs,
        face_tree,
        pieces: found.pieces,
        most_pieces: found.most_pieces,
        nearer_by: (found.nearer_by > 0.0).then_some(found.nearer_by),
        out_of_pieces: found.out_of_pieces,
        faults: found.faults.into_all(),
    })
}

/// Bound of how far a query point can lie outside the cell that is found for it, relative to the
/// side of the cube. The actual bound is 2^-51.
const MISSED: f64 = 1.0 / (1u64 << 40) as f64;

/// Checks that as many faces run along each edge in one direction as in the other. Only then is the
/// winding number an integer.
fn check_closed(asset: &TeSdf, surface: &Surface) -> Result<(), ProveError> {
    let mut balance: HashMap<[u32; 2], (i64, [u32; 2])> = HashMap::new();
    let sign_faces = asset.sign_faces.as_deref().unwrap_or(&[]);
    let places = surface.faces.iter().copied().chain(sign_faces.iter().map(|f| surface.places(*f)));
    for (corners, vertices) in places.zip(asset.faces.iter().chain(sign_faces)) {
        for k in 0..3 {
            let next = (k + 1) % 3;
            let (a, b) = (corners[k], corners[next]);
            let edge = balance.entry([a.min(b), a.max(b)]).or_insert((0, [vertices[k], vertices[next]]));
            edge.0 += i64::from(a < b) - i64::from(a > b);
        }
    }
    match balance.into_values().filter(|(sum, _)| *sum != 0).map(|(_, edge)| edge).min() {
        Some(edge) => Err(ProveError::NotClosed { edge }),
        None => Ok(()),
    }
}
