use serde::{Deserialize, Serialize};

use super::Chains;

/// What the encoder proved.
///
/// For every point `x` of every cell `t` that has a list `E_t`: the least distance from `x` to a face of
/// `E_t` is the distance from `x` to the mesh, up to [`delta`](Self::delta). Faces at equal distance may be left out.
///
/// Only the encoder makes one. The certificate of a file is what its writer says; `tesdf verify --prove` proves it again.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Certificate {
    encoder: String,
    domain: String,
    pub(crate) delta: Option<f64>,
    pub(crate) delta_of_diagonal: Option<f64>,
    truncated: bool,
    exactness_distance: Option<f64>,
    chains: Option<u32>,
}

/// A certificate as it is in a file.
#[derive(Deserialize)]
pub(crate) struct Written {
    encoder: String,
    domain: String,
    delta: Option<f64>,
    delta_of_diagonal: Option<f64>,
    truncated: bool,
    exactness_distance: Option<f64>,
    #[serde(default)]
    chains: Option<u32>,
}

impl From<Written> for Certificate {
    fn from(written: Written) -> Self {
        let Written { encoder, domain, delta, delta_of_diagonal, truncated, exactness_distance, chains } =
            written;
        Self { encoder, domain, delta, delta_of_diagonal, truncated, exactness_distance, chains }
    }
}

/// What the certified filter established of all lists.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Proved {
    /// Distance from the surface within which every list is exact, in the mesh's unit; infinite without truncation.
    pub within: f64,
    /// The chains of rule C that the proof rests on; `None`: there is no proof.
    pub chains: Option<Chains>,
}

impl Proved {
    /// Of the lists of both.
    pub fn and(self, other: Self) -> Self {
        Self { within: self.within.min(other.within), chains: Chains::of_both(self.chains, other.chains) }
    }
}

impl Certificate {
    /// Share of the diagonal that rounding is granted, in a domain of a local side up to 1: docs/math.md, 9.
    pub const DELTA: f64 = 1e-13;

    /// Of lists that `encoder` made in `domain`, with a cube of this side around it (local frame).
    pub(crate) fn new(encoder: String, domain: String, diagonal: f64, side: f64, proved: Proved) -> Self {
        let delta = Self::DELTA * side.max(1.0);
        let unproved = Self {
            encoder,
            domain,
            delta: Some(delta * diagonal),
            delta_of_diagonal: Some(delta),
            truncated: false,
            exactness_distance: None,
            chains: None,
        };
        unproved.with(proved)
    }

    /// The same encoding, of which this is proved.
    pub(crate) fn with(self, proved: Proved) -> Self {
        let is_proved = proved.chains.is_some();
        Self {
            delta: self.delta.filter(|_| is_proved),
            delta_of_diagonal: self.delta_of_diagonal.filter(|_| is_proved),
            truncated: proved.within.is_finite(),
            exactness_distance: proved.within.is_finite().then_some(proved.within),
            chains: proved.chains.map(Chains::used),
            ..self
        }
    }

    /// What is known of the lists, wherever vertices have moved since.
    pub(crate) fn proved(&self) -> Proved {
        let within = self.exactness_distance.unwrap_or(f64::INFINITY);
        Proved { within, chains: self.chains.map(Chains::of_weight) }
    }

    /// How the lists were made: `certified`; `sampled`, and on what, unless it was the processor in `f64`.
    pub fn encoder(&self) -> &str {
        &self.encoder
    }

    /// How the domain was made: `bisection` or `conforming`.
    pub fn domain(&self) -> &str {
        &self.domain
    }

    /// Bound on the distance that rounding in the encoder can cost, in the mesh's unit; `None`: nothing is proved.
    pub fn delta(&self) -> Option<f64> {
        self.delta
    }

    /// [`delta`](Self::delta) as a share of the mesh's diagonal.
    pub fn delta_of_diagonal(&self) -> Option<f64> {
        self.delta_of_diagonal
    }

    /// Whether lists were cut to a largest length.
    pub fn truncated(&self) -> bool {
        self.truncated
    }

    /// Distance from the surface within which every cell is exact, in the mesh's unit; `None`: everywhere.
    pub fn exactness_distance(&self) -> Option<f64> {
        self.exactness_distance
    }

    /// Weight of the heaviest chain of shared features that a list rests on, at most 400; `None`: nothing is proved, or the
    /// file is of a version that did not count them.
    pub fn chains(&self) -> Option<u32> {
        self.chains
    }
}
