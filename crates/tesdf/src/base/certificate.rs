use serde::{Deserialize, Serialize};

use super::{Chains, Inside};

/// The certificate of an asset: what the encoder proved of its lists.
///
/// For every point `x` of every cell `t` with a list `E_t`, the least distance from `x` to a face
/// of `E_t` is the distance from `x` to the mesh, up to [`delta`](Self::delta). A face may be left
/// out when another face is as near.
///
/// Only the encoder makes a certificate. The certificate of a file is the claim of its writer.
/// `tesdf verify --prove` proves it again.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Certificate {
    encoder: String,
    domain: String,
    pub(crate) delta: Option<f64>,
    pub(crate) delta_of_diagonal: Option<f64>,
    truncated: bool,
    exactness_distance: Option<f64>,
    chains: Option<u32>,
    #[serde(skip_serializing_if = "Inside::is_default")]
    pub(crate) inside: Inside,
    #[serde(skip_serializing_if = "is_false")]
    pub(crate) jumps: bool,
}

fn is_false(flag: &bool) -> bool {
    !flag
}

/// A certificate as a file stores it.
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
    #[serde(default)]
    inside: Inside,
    #[serde(default)]
    jumps: bool,
}

impl From<Written> for Certificate {
    fn from(written: Written) -> Self {
        let Written {
            encoder,
            domain,
            delta,
            delta_of_diagonal,
            truncated,
            exactness_distance,
            chains,
            inside,
            jumps,
        } = written;
        Self {
            encoder,
            domain,
            delta,
            delta_of_diagonal,
            truncated,
            exactness_distance,
            chains,
            inside,
            jumps,
        }
    }
}

/// What the certified filter proved of all lists.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Proved {
    /// Distance from the surface within which every list is exact, in the unit of the mesh. It is
    /// infinite without truncation.
    pub within: f64,
    /// The chains of rule C that the proof rests on. `None`: there is no proof.
    pub chains: Option<Chains>,
}

impl Proved {
    /// What is proved of the lists of both.
    pub fn and(self, other: Self) -> Self {
        Self { within: self.within.min(other.within), chains: Chains::of_both(self.chains, other.chains) }
    }
}

impl Certificate {
    /// Share of the diagonal by which rounding may change distances, in a domain with a local side
    /// of at most 1: docs/math.md, 9.
    pub const DELTA: f64 = 1e-13;

    /// The certificate of lists that `encoder` made in `domain`. `side` is that of the cube around
    /// the domain, in the local frame.
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
            inside: Inside::default(),
            jumps: false,
        };
        unproved.with(proved)
    }

    /// The certificate of the same encoding with this proof.
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

    /// The proof of the lists, whether or not vertices have moved since.
    pub(crate) fn proved(&self) -> Proved {
        let within = self.exactness_distance.unwrap_or(f64::INFINITY);
        Proved { within, chains: self.chains.map(Chains::of_weight) }
    }

    /// How the lists were made: `certified`, or `sampled` with the device that looked at the
    /// samples, unless it was the processor in `f64`.
    pub fn encoder(&self) -> &str {
        &self.encoder
    }

    /// How the domain was made: `bisection` or `conforming`.
    pub fn domain(&self) -> &str {
        &self.domain
    }

    /// Bound on the error of distances by rounding in the encoder, in the unit of the mesh. `None`:
    /// nothing is proved.
    pub fn delta(&self) -> Option<f64> {
        self.delta
    }

    /// [`delta`](Self::delta) as a share of the diagonal of the mesh.
    pub fn delta_of_diagonal(&self) -> Option<f64> {
        self.delta_of_diagonal
    }

    /// Whether lists were cut to a largest length.
    pub fn truncated(&self) -> bool {
        self.truncated
    }

    /// Distance from the surface within which every cell is exact, in the unit of the mesh. `None`:
    /// every cell is exact everywhere.
    pub fn exactness_distance(&self) -> Option<f64> {
        self.exactness_distance
    }

    /// Weight of the heaviest chain of shared features that a list rests on, at most 400. `None`:
    /// nothing is proved, or the version that wrote the file did not count chains.
    pub fn chains(&self) -> Option<u32> {
        self.chains
    }

    /// What is inside, and which faces are the surface.
    pub fn inside(&self) -> &Inside {
        &self.inside
    }

    /// Whether the signed distance jumps between its positive and its negative value somewhere: in
    /// the holes of an open mesh whose inside is by the generalised winding number. Distances are
    /// exact there, too.
    pub fn jumps(&self) -> bool {
        self.jumps
    }
}
