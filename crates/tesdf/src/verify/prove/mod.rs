//! A proof, cell by cell, that an asset answers as its certificate says.
//!
//! Comes in: an opened asset. Goes out: for every cell whether no face outside of its list can be closer than the list by more than
//! the certificate's δ, whether its sign is right, and whether the face tree can find every face.
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
//! Shared with the encoder: the layout of the file ([`layout`](crate::asset::layout)), the corners of the cells
//! ([`Cell`]), the way to the local frame, and the exact predicates of the crate `robust`. Not shared: distances, bounds, rules,
//! winding numbers, trees. `docs/math.md`, section 15, has the theorem.
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

use rayon::prelude::*;

use crate::TeSdf;
use crate::asset::about::Certificate;
use crate::domain::Cell;
pub use report::{Claim, Fault, ProveReport, Tally, Verdict};
use signs::Signs;
use surface::Surface;
use walk::{Found, Walk};
use winding::Rays;

/// How much [`prove`] does.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ProveOptions {
    /// Most pieces that one cell is cut into; a cell that would need more is undecided.
    pub pieces: u64,
}

impl Default for ProveOptions {
    fn default() -> Self {
        Self { pieces: 1 << 20 }
    }
}

/// Why nothing can be proved of an asset.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ProveError {
    /// The way to the local frame rounds.
    #[error(
        "vertex {vertex} (0-based) has no exact place within {} of the origin of the local frame; encode the mesh again",
        surface::FARTHEST
    )]
    Frame {
        /// The vertex.
        vertex: usize,
    },
    /// The mesh has no inside.
    #[error(
        "the mesh in the file is not closed: more faces run one way than the other along the edge of vertices {} and {} (0-based)",
        .edge[0], .edge[1]
    )]
    NotClosed {
        /// Vertices of an edge.
        edge: [u32; 2],
    },
    /// The domain is too large to count rounding.
    #[error(
        "the cube of the domain reaches {reach} from the origin of the local frame; expected at most {}",
        surface::FARTHEST
    )]
    Domain {
        /// How far it reaches.
        reach: f64,
    },
    /// The system gives no more threads.
    #[error("the system refused threads with a stack of {} MiB each; ask for fewer threads", STACK >> 20)]
    Threads,
    /// `progress` said so.
    #[error("the proof was cancelled")]
    Cancelled,
}

/// Room for the deepest search of a cell, some 8 KiB for each cut, in the profile of the tests too.
const STACK: usize = 64 << 20;

/// Proves that an asset answers as its certificate says, from all threads of the current rayon pool.
///
/// For every cell with a list: at each of its points the list is at most δ farther than the nearest of all faces. For every cell:
/// its label is the side of all of its points, or the faces that pass through it are in its list. For the face tree: its leaves
/// name each face once, and its boxes hold them. δ is that of the certificate; an asset that certifies nothing is held to the δ of
/// the certified encoder. Of an asset with cut lists, only points within the certificate's exactness distance are looked at.
///
/// `progress` is told the share done, 0 to 1, from any thread, and says whether to go on. The report is the same on any number of threads.
///
/// # Errors
/// [`ProveError`]: the asset is none that an encoder makes, or `progress` broke off.
pub fn prove(
    asset: &TeSdf,
    options: &ProveOptions,
    progress: impl Fn(f64) -> ControlFlow<()> + Sync,
) -> Result<ProveReport, ProveError> {
    let surface = Surface::new(&asset.vertices, &asset.faces, asset.frame)?;
    check_closed(asset, &surface)?;
    let roots: Vec<Cell> = (0..asset.root_count()).map(|root| asset.root(root)).collect();
    let reach = roots.iter().flat_map(|c| c.corners).map(|p| p.abs().max_element()).fold(0.0, f64::max);
    if reach.is_nan() || reach > surface::FARTHEST {
        return Err(ProveError::Domain { reach });
    }
    let triangles: Vec<_> = surface.triangles.iter().map(|t| t.corners).collect();
    let side = asset.cube.side().max(1.0);
    let signs = Signs { asset, surface: &surface, rays: Rays::new(&triangles), gap: MISSED * side };

    let certificate = asset.about().certificate();
    let diagonal = asset.bounds().extent().length();
    let granted = Certificate::DELTA * side * diagonal;
    // What a file says of itself is never more than what the encoder may say.
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
    // The search calls itself for each cut.
    let threads = rayon::ThreadPoolBuilder::new().num_threads(rayon::current_num_threads()).stack_size(STACK);
    let mut found = match threads.build() {
        Ok(threads) => threads.install(|| cells().reduce(Found::default, Found::join)),
        Err(_) => return Err(ProveError::Threads),
    };
    if walk.is_cancelled() {
        return Err(ProveError::Cancelled);
    }
    found.sign(match asset.conforming {
        None => signs.beyond_cube(),
        Some(_) => signs.outside_fault(&roots),
    });
    let of_tree = face_tree::faults(asset, &triangles);
    let mut face_tree = Tally::default();
    face_tree.count(of_tree.first());
    found.faults.extend(of_tree);
    found.faults.truncate(ProveReport::FAULTS);
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
        faults: found.faults,
    })
}

/// By how much a query can miss the cell that it finds, of the side of the cube: 2^-51, and more than that.
const MISSED: f64 = 1.0 / (1u64 << 40) as f64;

/// The winding number is a whole number only where as many faces run along each edge one way as the other.
fn check_closed(asset: &TeSdf, surface: &Surface) -> Result<(), ProveError> {
    let mut balance: HashMap<[u32; 2], (i64, [u32; 2])> = HashMap::new();
    for (corners, vertices) in surface.faces.iter().zip(asset.faces.iter()) {
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
