//! The result of a proof.
use glam::DVec3;
use serde::Serialize;

use crate::TeSdf;

/// The result of a proof over all cells.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ProveReport {
    /// Whether everything was proved.
    pub proved: bool,
    /// The bound that was proved: in every cell with a list, no face is closer than the list by
    /// more than this. In the mesh's unit.
    pub delta: f64,
    /// `delta` as a fraction of the mesh's diagonal.
    pub delta_of_diagonal: f64,
    /// Whether the certificate of the file promises a bound. If not, `delta` is that of the
    /// certified encoder.
    pub certified: bool,
    /// Only points nearer to the surface than this are covered, because lists were truncated. In
    /// the mesh's unit; `None`: all points.
    pub within: Option<f64>,
    /// Claims on distances, one for each cell with a list.
    pub distances: Tally,
    /// Claims on signs, one for each cell and one for the space outside the domain. In a conforming
    /// domain, also one for each tetrahedron.
    pub signs: Tally,
    /// One claim: the face tree, which answers where there is no list, is right.
    pub face_tree: Tally,
    /// Total number of pieces into which the cells were cut.
    pub pieces: u64,
    /// Largest number of pieces of one cell.
    pub most_pieces: u64,
    /// The most by which a face that a list misses is nearer than the list, at the points where
    /// lists were shown to be wrong. In the mesh's unit; `None`: no list was.
    pub nearer_by: Option<f64>,
    /// Number of lists that are undecided because [`pieces`](super::ProveOptions::pieces) did not
    /// suffice. More pieces may decide them, and no other undecided claim.
    pub out_of_pieces: usize,
    /// Claims that are not proved: the first [`REFUTED`](Self::REFUTED) that are wrong, then the
    /// first [`UNDECIDED`](Self::UNDECIDED) of the others, each in the order of the cells.
    pub faults: Vec<Fault>,
}

impl ProveReport {
    /// Largest number of refuted claims in [`faults`](Self::faults).
    pub const REFUTED: usize = 100;
    /// Largest number of undecided claims in [`faults`](Self::faults).
    pub const UNDECIDED: usize = 16;
}

/// The first faults of each verdict.
#[derive(Debug, Default)]
pub(super) struct Faults {
    refuted: Vec<Fault>,
    undecided: Vec<Fault>,
}

impl Faults {
    /// Adds faults that come after all others.
    pub fn extend(&mut self, faults: impl IntoIterator<Item = Fault>) {
        for fault in faults {
            let (kept, most) = match fault.verdict {
                Verdict::Refuted => (&mut self.refuted, ProveReport::REFUTED),
                Verdict::Undecided => (&mut self.undecided, ProveReport::UNDECIDED),
            };
            if kept.len() < most {
                kept.push(fault);
            }
        }
    }

    /// The refuted ones, then the undecided ones.
    pub fn into_all(mut self) -> Vec<Fault> {
        self.refuted.append(&mut self.undecided);
        self.refuted
    }
}

/// Numbers of claims of one kind.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Tally {
    /// All claims.
    pub claims: usize,
    /// Proved claims.
    pub proved: usize,
    /// Claims shown to be wrong.
    pub refuted: usize,
    /// Claims neither proved nor shown to be wrong.
    pub undecided: usize,
}

impl Tally {
    /// Counts a claim. `fault` is `None` when it is proved.
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

/// The subject of a [`Fault`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Claim {
    /// The list of a cell.
    Distance,
    /// The label of a cell, or the faces over which its sign is counted.
    Sign,
    /// The face tree.
    FaceTree,
}

/// The outcome of a claim that is not proved.
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
    /// The subject.
    pub claim: Claim,
    /// The outcome.
    pub verdict: Verdict,
    /// The cell, by its [id](crate::asset::CellView::id).
    pub cell: Option<u32>,
    /// A point at the fault, in the mesh's unit.
    pub point: Option<[f64; 3]>,
    /// The face concerned, by its id in the source, 0-based.
    pub face: Option<u32>,
    /// For a wrong list, the distance of the list from the point, in the mesh's unit.
    pub list_distance: Option<f64>,
    /// For a wrong list, the distance of the face from the point, in the mesh's unit.
    pub face_distance: Option<f64>,
    /// For a wrong list, by how much the face is nearer to the point than the list, in the mesh's
    /// unit.
    pub nearer_by: Option<f64>,
    /// The reason, for people.
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
            nearer_by: None,
            reason: reason.into(),
        }
    }

    pub(super) fn refuted(claim: Claim, reason: impl Into<String>) -> Self {
        Self::new(claim, Verdict::Refuted, reason)
    }

    pub(super) fn undecided(claim: Claim, reason: impl Into<String>) -> Self {
        Self::new(claim, Verdict::Undecided, reason)
    }

    /// Sets the cell.
    pub(super) fn cell(self, cell: u32) -> Self {
        Self { cell: Some(cell), ..self }
    }

    /// Sets the point, given in the local frame.
    pub(super) fn at(self, asset: &TeSdf, point: DVec3) -> Self {
        Self { point: Some(asset.frame.to_world(point).to_array()), ..self }
    }

    /// Sets the face, given by its index in the file.
    pub(super) fn face(self, asset: &TeSdf, face: u32) -> Self {
        Self { face: Some(asset.face_ids[face as usize]), ..self }
    }

    /// Sets the distances, given in the local frame.
    pub(super) fn distances(self, asset: &TeSdf, list: f64, face: f64) -> Self {
        let [list, face] = [list, face].map(|distance| distance * asset.frame.inverse_scale());
        Self { list_distance: Some(list), face_distance: Some(face), nearer_by: Some(list - face), ..self }
    }
}
