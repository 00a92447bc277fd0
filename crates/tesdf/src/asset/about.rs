//! What an asset says of itself, as JSON in the container's metadata.

use std::collections::BTreeMap;

use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

use super::AssetError;
use super::layout::Label;
use crate::domain::{Cell, DomainCube};
use crate::encode::refine::{Leaf, Tree};
use crate::encode::{Domain, EncodeOptions, Encoder, Sampler, Sampling, Threshold};
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
/// `E_t` is the distance from `x` to the mesh, up to `delta`. Faces at equal distance may be left out.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Certificate {
    /// How the lists were made: `certified`; `sampled`, and on what, unless it was the processor in `f64`.
    pub encoder: String,
    /// How the domain was made.
    pub domain: String,
    /// Bound on the distance that rounding in the encoder can cost, in the mesh's unit; `None`: nothing is proved.
    pub delta: Option<f64>,
    /// `delta` as a share of the mesh's diagonal.
    pub delta_of_diagonal: Option<f64>,
    /// Whether lists were cut to a largest length.
    pub truncated: bool,
    /// Distance from the surface within which every cell is exact, in the mesh's unit; `None`: everywhere.
    pub exactness_distance: Option<f64>,
}

impl Certificate {
    /// Share of the diagonal that rounding is granted, in a domain of a local side up to 1: 100 dominations of 1e-15 each, where a
    /// face is dropped only for one that is closer by more than the rounding of both.
    pub const DELTA: f64 = 1e-13;

    /// What an encoding with `options` proves. `cube` is the one around the domain, local frame; lists are exact `within` that
    /// distance from the surface, in the mesh's unit.
    pub(crate) fn of(
        options: &EncodeOptions,
        domain: &Domain,
        sampler: &dyn Sampler,
        diagonal: f64,
        cube: &DomainCube,
        within: f64,
    ) -> Self {
        let delta = Self::DELTA * cube.side().max(1.0);
        let (encoder, proved) = match options.encoder {
            Encoder::Certified => ("certified".into(), true),
            Encoder::Sampled(Sampling { threshold: Threshold::CoveringRadius, .. }) => (sampler.name(), true),
            Encoder::Sampled(_) => (sampler.name(), false),
        };
        let domain = match domain {
            Domain::Bisection => "bisection",
            Domain::Conforming(_) => "conforming",
        };
        Self {
            encoder,
            domain: domain.into(),
            delta: proved.then_some(delta * diagonal),
            delta_of_diagonal: proved.then_some(delta),
            truncated: within.is_finite(),
            exactness_distance: within.is_finite().then_some(within),
        }
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
    /// What was proved.
    pub certificate: Certificate,
    /// What was counted.
    pub statistics: Statistics,
}

impl About {
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
            certificate: read(metadata, "certificate")?,
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
