//! What an asset says of itself, as JSON in the container's metadata.

use std::collections::BTreeMap;

use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

use super::AssetError;
use super::layout::Label;
use crate::domain::{Cell, DomainCube};
use crate::encode::chains::Chains;
use crate::encode::refine::{Leaf, Tree};
use crate::encode::{Domain, EncodeOptions};
use crate::geometry::LocalFrame;
use crate::mesh::TriangleMesh;

/// The file that a mesh came from.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Source {
    /// File name without folders; empty for a mesh made in memory.
    pub name: String,
    /// BLAKE3 of the file's bytes, in hex; empty likewise.
    pub blake3: String,
}

/// What the encoder proved.
///
/// For every point `x` of every cell `t` that has a list `E_t`: the least distance from `x` to a face of
/// `E_t` is the distance from `x` to the mesh, up to [`delta`](Self::delta). Faces at equal distance may be left out.
///
/// Only the encoder makes one. The certificate of a file is what its writer says; `tesdf verify --prove` proves it again.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Certificate {
    pub(super) encoder: String,
    pub(super) domain: String,
    pub(crate) delta: Option<f64>,
    pub(crate) delta_of_diagonal: Option<f64>,
    pub(super) truncated: bool,
    pub(super) exactness_distance: Option<f64>,
    pub(super) chains: Option<u32>,
}

/// A certificate as it is in a file.
#[derive(Deserialize)]
struct Written {
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

    /// Of lists that `encoder` made in `domain`. `cube` is the one around the domain, local frame.
    pub(crate) fn new(
        encoder: String,
        domain: &Domain,
        diagonal: f64,
        cube: &DomainCube,
        proved: Proved,
    ) -> Self {
        let delta = Self::DELTA * cube.side().max(1.0);
        let domain = match domain {
            Domain::Bisection => "bisection",
            Domain::Conforming(_) => "conforming",
        };
        let unproved = Self {
            encoder,
            domain: domain.into(),
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

    /// Weight of the heaviest chain of shared features that a list rests on, at most [`Chains::BUDGET`]; `None`: nothing is proved, or the
    /// file is of a version that did not count them.
    pub fn chains(&self) -> Option<u32> {
        self.chains
    }
}

/// Counts taken while encoding. Volumes are in the mesh's unit, cubed.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Statistics {
    /// Faces of the mesh.
    pub faces: usize,
    /// Vertices of the mesh.
    pub vertices: usize,
    /// Diagonal of the mesh's bounds, in its unit.
    pub diagonal: f64,
    /// Cells with a list.
    pub listed_cells: usize,
    /// Those of them that the surface passes through.
    pub crossing_cells: usize,
    /// Cells of the domain that the face tree answers.
    pub far_cells: usize,
    /// Cells farther out than the band.
    pub outside_cells: usize,
    /// Sum of the lengths of all lists, equal lists counted for each cell.
    pub entries: usize,
    /// Longest list.
    pub longest_list: usize,
    /// Volume of the domain.
    pub domain_volume: f64,
    /// Volume of the far cells.
    pub far_volume: f64,
    /// Mean list length weighted by volume, far cells left out.
    pub volume_weighted_list: f64,
}

impl Statistics {
    /// Counts the leaves of the trees that grow from `cells`, with their labels.
    pub fn of(
        roots: &[Tree],
        labels: &[Label],
        cells: &[Cell],
        mesh: &TriangleMesh,
        frame: LocalFrame,
    ) -> Self {
        let mut s = Self {
            faces: mesh.faces().len(),
            vertices: mesh.vertices().len(),
            diagonal: mesh.diagonal(),
            crossing_cells: labels.iter().filter(|l| matches!(l, Label::Crossing(_))).count(),
            ..Self::default()
        };
        roots.iter().zip(cells).for_each(|(tree, &cell)| s.add(tree, cell));
        let listed = s.domain_volume - s.far_volume;
        s.volume_weighted_list /= if listed > 0.0 { listed } else { 1.0 };
        let unit = frame.scale.powi(-3);
        s.domain_volume *= unit;
        s.far_volume *= unit;
        s
    }

    fn add(&mut self, tree: &Tree, cell: Cell) {
        match tree {
            Tree::Split(children) => {
                children.iter().enumerate().for_each(|(side, child)| self.add(child, cell.child(side)));
            }
            Tree::Leaf(Leaf::Outside) => self.outside_cells += 1,
            Tree::Leaf(Leaf::Far) => {
                self.far_cells += 1;
                self.far_volume += cell.volume();
                self.domain_volume += cell.volume();
            }
            Tree::Leaf(Leaf::Listed { faces, .. }) => {
                self.listed_cells += 1;
                self.entries += faces.len();
                self.longest_list = self.longest_list.max(faces.len());
                self.domain_volume += cell.volume();
                self.volume_weighted_list += cell.volume() * faces.len() as f64;
            }
        }
    }
}

/// Everything that an asset says of itself.
#[derive(Clone, Debug, PartialEq)]
pub struct About {
    /// Where the mesh came from.
    pub source: Source,
    /// What was asked for.
    pub options: EncodeOptions,
    pub(crate) certificate: Certificate,
    /// What was counted.
    pub statistics: Statistics,
}

impl About {
    /// What was proved.
    pub fn certificate(&self) -> &Certificate {
        &self.certificate
    }

    /// As metadata, one JSON text per key.
    pub fn to_metadata(&self) -> BTreeMap<String, String> {
        let json = |v: serde_json::Result<String>| v.unwrap_or_default();
        BTreeMap::from([
            ("source".into(), json(serde_json::to_string(&self.source))),
            ("options".into(), json(serde_json::to_string(&self.options))),
            ("certificate".into(), json(serde_json::to_string(&self.certificate))),
            ("statistics".into(), json(serde_json::to_string(&self.statistics))),
        ])
    }

    /// Reads the metadata of a container.
    ///
    /// # Errors
    /// Names the key that is missing or does not parse.
    pub fn from_metadata(metadata: &BTreeMap<String, String>) -> Result<Self, AssetError> {
        Ok(Self {
            source: read(metadata, "source")?,
            options: read(metadata, "options")?,
            certificate: read::<Written>(metadata, "certificate")?.into(),
            statistics: read(metadata, "statistics")?,
        })
    }
}

fn read<T: DeserializeOwned>(metadata: &BTreeMap<String, String>, key: &str) -> Result<T, AssetError> {
    let text = metadata
        .get(key)
        .ok_or_else(|| AssetError::header(format!("the metadata has no {key}; encode the mesh again")))?;
    serde_json::from_str(text)
        .map_err(|e| AssetError::header(format!("the metadata's {key} is not what was expected: {e}")))
}
