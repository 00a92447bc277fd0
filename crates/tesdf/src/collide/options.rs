use serde::{Deserialize, Serialize};

use crate::base::Length;
use crate::collide::scene::error::CollideError;
use crate::query::Precision;

/// The part of body *a* that is tested against the field of body *b*.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Mode {
    /// Node-TES: the vertices.
    Node,
    /// Face-TES: the least signed distance over each face (Eq. 9). A fixed number of
    /// Frank–Wolfe [`iterations`](CollideOptions::iterations) gives an upper bound of the minimum.
    /// In the field of an open mesh, whose signed distance jumps, it searches as
    /// [`Exact`](Self::Exact).
    Face,
    /// As [`Face`](Self::Face), but with the minimum itself, within a
    /// [`tolerance`](CollideOptions::tolerance). It comes from a closed form outside, and from
    /// branch and bound inside.
    Exact,
}

/// What a contact of the modes [`Face`](Mode::Face) and [`Exact`](Mode::Exact) stands for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ContactsPer {
    /// A face of body *a* in one cell of body *b*, as in the paper: the least signed distance over
    /// the part of the face in that cell. A face has as many contacts as it meets cells. The normal
    /// is a direction that both bodies allow, where the way between the points is along one.
    Cell,
    /// A face of body *a*: its least signed distance over all cells. Where the face lies flat on
    /// body *b*, or is large, the extremes of the part that touches are contacts too, so that a box
    /// stands on its corners. The normal is as for [`Cell`](Self::Cell); where both bodies allow
    /// none, of equally near faces of *b*, the one that opposes the face gives it. Faces that have
    /// the same vertex as their contact share it.
    Face,
    /// A local minimum of the signed distance over the surface of body *a*: the contacts of
    /// [`Face`](Self::Face), without those beside which the surface is lower, where the distance
    /// falls by more than 0.1 per unit of length. As planes, these would stop bodies that have
    /// room; those that are walls all the same, as the sides of a groove, stay. Each that is left
    /// out is followed by a lower one, so the deepest contact remains. Of instances that close by
    /// more than 0.1 of the smaller diagonal within the speculative time, all contacts stay.
    ///
    /// Distances are along the normals, which are in the normal cones of both bodies; where these
    /// have no common direction, there is no contact. Of contacts at one place with one normal, in
    /// both orders of a pair, one stays. This is what a simulation needs.
    Minimum,
}

/// Number of contacts kept per pair of instances.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Reduction {
    /// All contacts.
    None,
    /// At most this many per pair of instances: the deepest, the extremes, then those that matter
    /// most for the wrench.
    PerPair(u32),
    /// At most this many contacts per pair of instances, spread over the places that touch. The
    /// surfaces are divided into as many regions, and the deepest contact that a dive into each
    /// region finds is kept. The time follows this number, not the number of faces that touch. The
    /// deepest contact of all may be missing; [`PairReduction::left_out_above`] says how deep it
    /// can be. A device finds all contacts and keeps those of [`PerPair`](Self::PerPair).
    ///
    /// [`PairReduction::left_out_above`]: crate::collide::PairReduction::left_out_above
    Spread(u32),
}

/// Whether a detection searches for [hidden overlaps](crate::collide::HiddenOverlap).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum HiddenSearch {
    /// [`Contacts::hidden`](crate::collide::Contacts::hidden) lists them.
    #[default]
    On,
    /// None are listed. This saves time in the mode [`Node`](Mode::Node), where contacts miss most,
    /// for detections whose overlaps nobody reads.
    Off,
}

/// Options of a detection. What a text leaves out has its default.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct CollideOptions {
    /// Nodes or faces, and the method.
    pub mode: Mode,
    /// One contact for each cell that a face meets, for each face, or for each local minimum. Not
    /// used for nodes.
    pub contacts_per: ContactsPer,
    /// Number of Frank–Wolfe iterations of the mode [`Face`](Mode::Face), at most
    /// [`MAX_ITERATIONS`](Self::MAX_ITERATIONS). Each evaluates the field once. The paper uses 16.
    pub iterations: u32,
    /// Bound of the error of the mode [`Exact`](Mode::Exact), and of results of the mode
    /// [`Face`](Mode::Face) that count as converged: a fraction of the diagonal of the field's
    /// body, or a length in the world's unit.
    pub tolerance: Length,
    /// Contacts are reported up to this signed distance, in the world's unit. It may be wider than
    /// the band of an asset: outside the domain, the face tree answers, also exactly.
    pub contact_distance: f64,
    /// Adds to a pair's contact distance what the velocities of the two instances, relative to each
    /// other, can close within this time; 0 adds nothing. Instances that move together add next to
    /// nothing, whatever their speed. Faces and vertices add what their own place closes, if that
    /// is less.
    pub speculative_time: f64,
    /// Eq. (10): a contact of a face is dropped when ∇φ · n > −cos θ. `None` keeps all. Not used
    /// for nodes.
    pub cos_theta: Option<f64>,
    /// Number of contacts kept per pair of instances.
    pub reduction: Reduction,
    /// Whether overlaps are searched for that no contact shows. Changes no contact.
    pub hidden: HiddenSearch,
    /// Precision of the reported distances, normals and witness points.
    #[serde(skip)]
    pub precision: Precision,
}

impl CollideOptions {
    /// Largest accepted number of [`iterations`](Self::iterations). The error only falls in
    /// proportion to the number, so more iterations are of no use.
    pub const MAX_ITERATIONS: u32 = 1 << 16;

    /// The defaults with another mode.
    pub fn with_mode(mode: Mode) -> Self {
        Self { mode, ..Self::default() }
    }

    /// Checks all values that the mode uses.
    ///
    /// # Errors
    /// [`CollideError::Option`] names the option.
    pub fn validate(&self) -> Result<(), CollideError> {
        let refuse = |option, found: String, expected| Err(CollideError::Option { option, found, expected });
        for (name, value) in
            [("contact_distance", self.contact_distance), ("speculative_time", self.speculative_time)]
        {
            if !(0.0..=1e50).contains(&value) {
                return refuse(name, format!("{value:e}"), "0 to 1e50");
            }
        }
        if let Some(cos) = self.cos_theta
            && !(-1.0..=1.0).contains(&cos)
        {
            return refuse("cos_theta", cos.to_string(), "-1 to 1");
        }
        if self.mode != Mode::Node {
            let (Length::OfDiagonal(value) | Length::Absolute(value)) = self.tolerance;
            if !(value > 0.0 && value.is_finite()) {
                return refuse("tolerance", value.to_string(), "a finite number greater than 0");
            }
        }
        if self.mode == Mode::Face && self.iterations > Self::MAX_ITERATIONS {
            return refuse(
                "iterations",
                self.iterations.to_string(),
                "at most 65536: from some hundred on nothing is gained",
            );
        }
        if matches!(self.reduction, Reduction::PerPair(0) | Reduction::Spread(0)) {
            return refuse("reduction", "0 contacts per pair".into(), "at least 1, or none");
        }
        Ok(())
    }
}

impl Default for CollideOptions {
    /// Exact mode, contacts per face, a tolerance of 1e-7 of the diagonal, contact distance 0, no
    /// filter and no reduction.
    fn default() -> Self {
        Self {
            mode: Mode::Exact,
            contacts_per: ContactsPer::Face,
            iterations: 16,
            tolerance: Length::OfDiagonal(1e-7),
            contact_distance: 0.0,
            speculative_time: 0.0,
            cos_theta: None,
            reduction: Reduction::None,
            hidden: HiddenSearch::On,
            precision: Precision::F64,
        }
    }
}
