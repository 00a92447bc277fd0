//! What the proof found.
use glam::DVec3;
use serde::Serialize;

use crate::TeSdf;

/// What a proof found, of every cell.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ProveReport {
    /// Whether everything was proved.
    pub proved: bool,
    /// What was proved: in every cell with a list, no face is closer than the list by more than this; mesh unit.
    pub delta: f64,
    /// `delta` as a share of the mesh's diagonal.
    pub delta_of_diagonal: f64,
    /// Whether the certificate of the file promises as much. Where it promises nothing, `delta` is that of the certified encoder.
    pub certified: bool,
    /// Only points nearer to the surface than this were looked at, as lists were cut; mesh unit. `None`: all points.
    pub within: Option<f64>,
    /// Distances: of cells with a list.
    pub distances: Tally,
    /// Signs: of all cells, and of the space that is not of the domain.
    pub signs: Tally,
    /// The face tree, which answers where there is no list; 1 when nothing is wrong with it.
    pub face_tree: Tally,
    /// Pieces that the cells were cut into.
    pub pieces: u64,
    /// The most pieces of one cell.
    pub most_pieces: u64,
    /// What is not proved; the first [`FAULTS`](Self::FAULTS), in the order of the cells.
    pub faults: Vec<Fault>,
}

impl ProveReport {
    /// Most faults that are listed.
    pub const FAULTS: usize = 16;
}

/// How many claims of one kind were proved.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Tally {
    /// All of them.
    pub claims: usize,
    /// Proved.
    pub proved: usize,
    /// Shown to be wrong.
    pub refuted: usize,
    /// Neither.
    pub undecided: usize,
}

impl Tally {
    /// Counts a claim; `fault` is what is wrong with it.
    pub(super) fn count(&mut self, fault: Option<&Fault>) {
        self.claims += 1;
        match fault.map(|f| f.verdict) {
            None => self.proved += 1,
            Some(Verdict::Refuted) => self.refuted += 1,
            Some(Verdict::Undecided) => self.undecided += 1,
        }
    }

    pub(super) fn join(self, other: Self) -> Self {
        Self {
            claims: self.claims + other.claims,
            proved: self.proved + other.proved,
            refuted: self.refuted + other.refuted,
            undecided: self.undecided + other.undecided,
        }
    }
}

/// What a [`Fault`] is about.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Claim {
    /// The list of a cell.
    Distance,
    /// The label of a cell, or the faces that its sign is counted over.
    Sign,
    /// The face tree.
    FaceTree,
}

/// What became of a claim that is not proved.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Verdict {
    /// It is wrong.
    Refuted,
    /// It was neither proved nor shown to be wrong.
    Undecided,
}

/// A claim that is not proved.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Fault {
    /// What it is about.
    pub claim: Claim,
    /// What became of it.
    pub verdict: Verdict,
    /// The cell, by its [id](crate::asset::CellView::id).
    pub cell: Option<u32>,
    /// Where, in the mesh's unit.
    pub point: Option<[f64; 3]>,
    /// The face that it is about, by its id in the source, 0-based.
    pub face: Option<u32>,
    /// Distance of the list from the point, for a wrong list; mesh unit.
    pub list_distance: Option<f64>,
    /// Distance of the face from the point, for a wrong list; mesh unit.
    pub face_distance: Option<f64>,
    /// What is wrong.
    pub reason: String,
}

impl Fault {
    pub(super) fn new(claim: Claim, verdict: Verdict, reason: impl Into<String>) -> Self {
        Self {
            claim,
            verdict,
            cell: None,
            point: None,
            face: None,
            list_distance: None,
            face_distance: None,
            reason: reason.into(),
        }
    }

    pub(super) fn refuted(claim: Claim, reason: impl Into<String>) -> Self {
        Self::new(claim, Verdict::Refuted, reason)
    }

    pub(super) fn undecided(claim: Claim, reason: impl Into<String>) -> Self {
        Self::new(claim, Verdict::Undecided, reason)
    }

    /// In a cell.
    pub(super) fn cell(self, cell: u32) -> Self {
        Self { cell: Some(cell), ..self }
    }

    /// At a point of the local frame.
    pub(super) fn at(self, asset: &TeSdf, point: DVec3) -> Self {
        Self { point: Some(asset.frame.to_world(point).to_array()), ..self }
    }

    /// About a face, by its place in the file.
    pub(super) fn face(self, asset: &TeSdf, face: u32) -> Self {
        Self { face: Some(asset.face_ids[face as usize]), ..self }
    }

    /// With distances in the local frame.
    pub(super) fn distances(self, asset: &TeSdf, list: f64, face: f64) -> Self {
        let unit = asset.frame.inverse_scale();
        Self { list_distance: Some(list * unit), face_distance: Some(face * unit), ..self }
    }
}
