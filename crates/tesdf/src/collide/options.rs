use serde::{Deserialize, Serialize};

use crate::base::Length;
use crate::collide::mode::{FaceOptions, Mode, ModeChoices};
use crate::collide::scene::error::CollideError;
use crate::query::Precision;

/// Number of contacts kept per pair of instances.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Reduction {
    /// All contacts.
    #[default]
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

/// Options of a detection. In texts, the options of the mode stand beside its name; what a text
/// leaves out has its default.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "Text", into = "Text")]
pub struct CollideOptions {
    /// Nodes or faces, and the method.
    pub mode: Mode,
    /// Contacts are reported up to this signed distance, in the world's unit. It may be wider than
    /// the band of an asset: outside the domain, the face tree answers, also exactly.
    pub contact_distance: f64,
    /// Adds to a pair's contact distance what the velocities of the two instances, relative to each
    /// other, can close within this time; 0 adds nothing. Instances that move together add next to
    /// nothing, whatever their speed. Faces and vertices add what their own place closes, if that
    /// is less.
    pub speculative_time: f64,
    /// Number of contacts kept per pair of instances.
    pub reduction: Reduction,
    /// Whether overlaps are searched for that no contact shows. Changes no contact.
    pub hidden: HiddenSearch,
    /// Precision of the reported distances, normals and witness points. It is no part of a text.
    pub precision: Precision,
}

impl CollideOptions {
    /// Largest accepted number of iterations of the mode [`Face`](Mode::Face). The error only falls
    /// in proportion to the number, so more iterations are of no use.
    pub const MAX_ITERATIONS: u32 = 1 << 16;

    /// The defaults with another mode.
    pub fn with_mode(mode: Mode) -> Self {
        Self { mode, ..Self::default() }
    }

    /// The defaults of a simulation: [`FaceOptions::OF_SIMULATION`] in the exact mode.
    pub fn for_simulation() -> Self {
        Self::with_mode(Mode::Exact(FaceOptions::OF_SIMULATION))
    }

    /// Checks all values.
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
        if let Some(FaceOptions { tolerance, cos_theta, .. }) = self.mode.faces() {
            if let Some(cos) = cos_theta
                && !(-1.0..=1.0).contains(cos)
            {
                return refuse("cos_theta", cos.to_string(), "-1 to 1");
            }
            let (Length::OfDiagonal(value) | Length::Absolute(value)) = *tolerance;
            if !(value > 0.0 && value.is_finite()) {
                return refuse("tolerance", value.to_string(), "a finite number greater than 0");
            }
        }
        if let Mode::Face { iterations, .. } = self.mode
            && iterations > Self::MAX_ITERATIONS
        {
            return refuse(
                "iterations",
                iterations.to_string(),
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
    /// Exact mode with contacts per face ([`Mode::exact`]), contact distance 0 and no reduction.
    fn default() -> Self {
        Self {
            mode: Mode::exact(),
            contact_distance: 0.0,
            speculative_time: 0.0,
            reduction: Reduction::None,
            hidden: HiddenSearch::On,
            precision: Precision::F64,
        }
    }
}

/// The keys of the options in a text.
#[derive(Serialize, Deserialize)]
struct Text {
    #[serde(flatten)]
    mode: ModeChoices,
    #[serde(default)]
    contact_distance: f64,
    #[serde(default)]
    speculative_time: f64,
    #[serde(default)]
    reduction: Reduction,
    #[serde(default)]
    hidden: HiddenSearch,
}

impl TryFrom<Text> for CollideOptions {
    type Error = CollideError;

    fn try_from(text: Text) -> Result<Self, CollideError> {
        let Text { mode, contact_distance, speculative_time, reduction, hidden } = text;
        let mode = mode.mode(FaceOptions::default())?;
        Ok(Self { contact_distance, speculative_time, reduction, hidden, ..Self::with_mode(mode) })
    }
}

impl From<CollideOptions> for Text {
    fn from(options: CollideOptions) -> Self {
        let CollideOptions { mode, contact_distance, speculative_time, reduction, hidden, .. } = options;
        Self { mode: mode.into(), contact_distance, speculative_time, reduction, hidden }
    }
}
