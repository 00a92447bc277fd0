//! What an asset says of itself, as JSON in the container's metadata.

use std::collections::BTreeMap;

use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

use super::AssetError;
use super::options::EncodeOptions;
use crate::base::{Certificate, Written};

/// The file that a mesh came from.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Source {
    /// File name without folders; empty for a mesh made in memory.
    pub name: String,
    /// BLAKE3 of the file's bytes, in hex; empty likewise.
    pub blake3: String,
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
