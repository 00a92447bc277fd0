//! Traverses the forest of an asset with the faces that can matter, and checks every cell.
use std::ops::ControlFlow;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

use super::ProveOptions;
use super::distance::{Open, Reason, Search};
use super::problem::Problem;
use super::report::{Claim, Fault, Faults, Tally};
use super::signs::Signs;
use crate::TeSdf;
use crate::asset::layout::Node;
use crate::domain::Cell;

/// Results for some cells, in their order.
#[derive(Default)]
pub struct CellResults {
    pub distances: Tally,
    pub signs: Tally,
    pub pieces: u64,
    pub most_pieces: u64,
    /// The most by which a face was found nearer than a list, in the unit of the mesh; 0 for none.
    pub nearer_by: f64,
    /// Lists that are undecided for want of pieces.
    pub out_of_pieces: usize,
    pub faults: Faults,
}

impl CellResults {
    pub fn join(mut self, other: Self) -> Self {
        self.faults.extend(other.faults.into_all());
        Self {
            distances: self.distances.join(other.distances),
            signs: self.signs.join(other.signs),
            pieces: self.pieces + other.pieces,
            most_pieces: self.most_pieces.max(other.most_pieces),
            nearer_by: self.nearer_by.max(other.nearer_by),
            out_of_pieces: self.out_of_pieces + other.out_of_pieces,
            faults: self.faults,
        }
    }

    /// Counts a claim on distances.
    fn distance(&mut self, fault: Option<Fault>) {
        self.distances.count(fault.as_ref());
        self.nearer_by = fault.as_ref().and_then(|f| f.nearer_by).unwrap_or(0.0).max(self.nearer_by);
        self.faults.extend(fault);
    }

    /// Counts a claim on signs.
    pub fn sign(&mut self, fault: Option<Fault>) {
        self.signs.count(fault.as_ref());
        self.faults.extend(fault);
    }
}

/// The traversal. Lengths are in the local frame.
pub struct Walk<'a, P> {
    pub asset: &'a TeSdf,
    pub signs: &'a Signs<'a>,
    pub options: &'a ProveOptions,
    pub delta: f64,
    pub within: f64,
    pub progress: P,
    /// Number of finished words of the forest.
    pub done: AtomicUsize,
    pub cancelled: AtomicBool,
}

impl<P: Fn(f64) -> ControlFlow<()> + Sync> Walk<'_, P> {
    /// Checks a root and all cells below it. `faces` must contain all faces that can matter in it.
    pub fn root(&self, root: usize, faces: &[u32]) -> CellResults {
        let cell = self.asset.root(root);
        let near = self.near(&cell, faces);
        let found = self.below(root as u32, cell, &near);
        if self.asset.conforming.is_none() {
            return found;
        }
        let mut of_root = CellResults::default();
        of_root.sign(self.signs.root_fault(root, &cell, &near));
        of_root.join(found)
    }

    fn near(&self, cell: &Cell, faces: &[u32]) -> Vec<u32> {
        let centroid = cell.centroid();
        let radius = cell.corners.iter().map(|c| c.distance(centroid)).fold(0.0, f64::max);
        self.signs.surface.retain_near(centroid, radius, faces)
    }

    /// Checks the cells below a word. `near` are the faces near the cell.
    fn below(&self, word: u32, cell: Cell, near: &[u32]) -> CellResults {
        if self.is_cancelled() {
            return CellResults::default();
        }
        let node = Node::decode(self.asset.nodes[word as usize], &self.asset.lists);
        let found = match node {
            Node::Split(children) => {
                let child = |side: usize| {
                    let child = cell.child(side);
                    self.below(children + side as u32, child, &self.near(&child, near))
                };
                let (left, right) = crate::parallel::join(|| child(0), || child(1));
                left.join(right)
            }
            _ => self.leaf(word, &cell, node, near),
        };
        let done = self.done.fetch_add(1, Ordering::Relaxed) + 1;
        if (self.progress)(done as f64 / self.asset.nodes.len() as f64).is_break() {
            self.cancelled.store(true, Ordering::Relaxed);
        }
        found
    }

    pub fn is_cancelled(&self) -> bool {
        self.cancelled.load(Ordering::Relaxed)
    }

    fn leaf(&self, word: u32, cell: &Cell, node: Node, near: &[u32]) -> CellResults {
        let mut found = CellResults::default();
        let list = match node {
            Node::Listed(_, offset) => self.asset.with_list(offset, |faces| faces.ids().to_vec()),
            _ => Vec::new(),
        };
        if let Node::Listed(..) = node {
            self.distances(&mut found, word, cell, &list, near);
        }
        found.sign(match self.asset.conforming {
            None => self.signs.fault(word, cell, node, &list, near),
            Some(_) => self.signs.located(word, cell).map(|f| f.cell(word)),
        });
        found
    }

    /// Checks the list of a cell.
    fn distances(&self, found: &mut CellResults, word: u32, cell: &Cell, list: &[u32], near: &[u32]) {
        let middle = cell.centroid();
        let corners = cell.corners.map(|c| c - middle);
        let surface = self.signs.surface;
        let problem = Problem::new(surface, middle, &corners, list, near, self.delta, self.within);
        // Long searches also ask for cancellation.
        let is_cancelled = || {
            if (self.progress)(self.done.load(Ordering::Relaxed) as f64 / self.asset.nodes.len() as f64)
                .is_break()
            {
                self.cancelled.store(true, Ordering::Relaxed);
            }
            self.is_cancelled()
        };
        let mut search = Search::new(&problem, self.options.pieces, &is_cancelled);
        let outcome = search.run(corners);
        let is_short = matches!(outcome, Err(Open::Undecided { reason: Reason::Pieces, .. }));
        found.out_of_pieces = usize::from(is_short);
        (found.pieces, found.most_pieces) = (search.pieces, search.pieces);
        let fault = outcome.err().map(|open| match open {
            Open::Refuted { at, face, list, distance } => {
                let reason = "a face that is not in the list of the cell is closer than the list";
                let fault = Fault::refuted(Claim::Distance, reason).at(self.asset, at + middle);
                fault.face(self.asset, face).distances(self.asset, list, distance)
            }
            Open::Undecided { reason, at, face } => {
                let reason = match reason {
                    Reason::Pieces => {
                        format!("{} pieces did not tell whether the list needs the face", search.pieces)
                    }
                    Reason::Rounding => "rounding is not small against what the certificate grants".into(),
                };
                Fault::undecided(Claim::Distance, reason).at(self.asset, at + middle).face(self.asset, face)
            }
            Open::Cancelled => Fault::undecided(Claim::Distance, "cancelled"),
        });
        found.distance(fault.map(|f| f.cell(word)));
    }
}
