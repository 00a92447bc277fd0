use serde::{Deserialize, Serialize};

use super::CollideError;
use crate::base::Length;
use crate::query::Precision;

/// What is tested of body *a* against the field of body *b*.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Mode {
    /// Node-TES: the vertices.
    Node,
    /// Face-TES: the least signed distance over each face, cell by cell (Eq. 9), by a fixed number of Frank–Wolfe
    /// [`iterations`](CollideOptions::iterations): an upper bound of the minimum.
    Face,
    /// As [`Face`](Self::Face), but the minimum itself, within a [`tolerance`](CollideOptions::tolerance): by a closed form outside, by branch
    /// and bound inside.
    Exact,
}

/// How many contacts of a pair are kept.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Reduction {
    /// All.
    None,
    /// At most so many per pair of instances: the deepest, the extremes, then those that matter most to the wrench.
    PerPair(u32),
}

/// What to detect. Every field is used.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct CollideOptions {
    /// Nodes, or faces and how.
    pub mode: Mode,
    /// Frank–Wolfe iterations of the mode [`Face`](Mode::Face), each one evaluation of the field; at most
    /// [`MAX_ITERATIONS`](Self::MAX_ITERATIONS). The paper has 16.
    pub iterations: u32,
    /// Bound on the error of the mode [`Exact`](Mode::Exact): a share of the diagonal of the field's body, or in the world's unit.
    pub tolerance: Length,
    /// Contacts are reported up to this signed distance, in the world's unit. Wider than the band of an asset is no
    /// error: what lies outside of its domain is answered from its face tree, exactly.
    pub contact_distance: f64,
    /// Adds to the contact distance of a pair what its velocities can close in this time; 0 adds nothing.
    pub speculative_time: f64,
    /// Eq. (10): a contact of a face is dropped when ∇φ · n > −cos θ; `None` keeps all. Not for nodes.
    pub cos_theta: Option<f64>,
    /// How many contacts of a pair are kept.
    pub reduction: Reduction,
    /// What the reported distances, normals and witness points are computed with.
    #[serde(skip, default = "exact")]
    pub precision: Precision,
}

fn exact() -> Precision {
    Precision::F64
}

impl CollideOptions {
    /// Most [`iterations`](Self::iterations); the error falls with their number only, so more are of no use.
    pub const MAX_ITERATIONS: u32 = 1 << 16;

    /// The defaults with another mode.
    pub fn with_mode(mode: Mode) -> Self {
        Self { mode, ..Self::default() }
    }

    /// Checks that every value that the mode uses makes sense.
    ///
    /// # Errors
    /// Names the option.
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
        if self.mode == Mode::Exact {
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
        if self.reduction == Reduction::PerPair(0) {
            return refuse("reduction", "0 contacts per pair".into(), "at least 1, or none");
        }
        Ok(())
    }
}

impl Default for CollideOptions {
    /// Exact to 1e-7 of the diagonal, everything that touches, nothing filtered or reduced.
    fn default() -> Self {
        Self {
            mode: Mode::Exact,
            iterations: 16,
            tolerance: Length::OfDiagonal(1e-7),
            contact_distance: 0.0,
            speculative_time: 0.0,
            cos_theta: None,
            reduction: Reduction::None,
            precision: Precision::F64,
        }
    }
}
