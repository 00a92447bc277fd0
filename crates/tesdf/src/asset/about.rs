//! What an asset says about itself, stored as JSON in the metadata of the container.

use std::collections::BTreeMap;
use std::fmt;
use std::path::Path;

use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

use super::AssetError;
use super::options::EncodeOptions;
use crate::base::{Certificate, Inside, InsideRule, SurfaceFaces, Written};
#[cfg(feature = "encode")]
use crate::mesh::{AutoRepaired, LoadedSolid};

/// The file that a mesh came from.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Source {
    /// File name without folders. Empty for a mesh made in memory.
    pub name: String,
    /// BLAKE3 of the bytes of the file, in hex. Empty for a mesh made in memory.
    pub blake3: String,
    /// What a repair changed between the file and the mesh. `None` for a mesh as it is in the file.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub repair: Option<Repair>,
}

/// A repair of a mesh before it was encoded. The lengths and areas are in the unit of the mesh.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Repair {
    /// The flags of `tesdf repair` that make the same changes; empty without flags.
    pub flags: String,
    /// Number of merged vertices.
    pub welded_vertices: usize,
    /// Number of faces that were dropped: collapsed, duplicate and vanished ones.
    pub dropped_faces: usize,
    /// Number of edges that were split at T-junctions.
    pub split_edges: usize,
    /// Number of faces that were reversed.
    pub reversed_faces: usize,
    /// Number of holes that were filled.
    pub filled_holes: usize,
    /// Area of the fillings.
    pub filled_area: f64,
}

impl fmt::Display for Repair {
    /// One line: the command, and what it changed.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.flags.as_str() {
            "" => f.write_str("as by `tesdf repair`")?,
            flags => write!(f, "as by `tesdf repair {flags}`")?,
        }
        let counts = [
            (self.welded_vertices, ["vertex merged", "vertices merged"]),
            (self.dropped_faces, ["face dropped", "faces dropped"]),
            (self.split_edges, ["edge split", "edges split"]),
            (self.reversed_faces, ["face reversed", "faces reversed"]),
            (self.filled_holes, ["hole filled", "holes filled"]),
        ];
        for (number, [one, many]) in counts.into_iter().filter(|(number, _)| *number > 0) {
            write!(f, "; {number} {}", if number == 1 { one } else { many })?;
        }
        match self.filled_holes {
            0 => Ok(()),
            _ => write!(f, ", area {:.3e}", self.filled_area),
        }
    }
}

#[cfg(feature = "encode")]
impl From<&AutoRepaired> for Repair {
    fn from(found: &AutoRepaired) -> Self {
        let report = &found.repaired.report;
        let dropped =
            [report.collapsed_faces.len(), report.duplicate_faces.len(), report.vanished_faces.len()];
        Self {
            flags: found.options.map_or(String::new(), |options| options.to_string().trim_start().into()),
            welded_vertices: report.welded_vertices.len(),
            dropped_faces: dropped.iter().sum(),
            split_edges: report.split_edges.len(),
            reversed_faces: report.reversed_faces.len(),
            filled_holes: report.filled_holes.len(),
            filled_area: report.filled_holes.iter().map(|hole| hole.area).sum(),
        }
    }
}

#[cfg(feature = "encode")]
impl LoadedSolid {
    /// The file of the solid, and what a repair changed.
    pub fn source(&self) -> Source {
        Source::of_file(&self.path, self.report.source_blake3.clone()).repaired(self.repaired.as_ref())
    }
}

impl Source {
    /// The file at `path`. `blake3` is the hash of its bytes, in hex, as
    /// [`LoadReport::source_blake3`](crate::mesh::LoadReport::source_blake3) has it.
    pub fn of_file(path: impl AsRef<Path>, blake3: String) -> Self {
        let name = path.as_ref().file_name().unwrap_or_default().to_string_lossy().into_owned();
        Self { name, blake3, repair: None }
    }

    /// The same file, and what a repair changed of its mesh.
    #[cfg(feature = "encode")]
    pub fn repaired(self, found: Option<&AutoRepaired>) -> Self {
        Self { repair: found.map(Into::into), ..self }
    }

    /// Whether both are the same file. The repairs may differ.
    pub fn is_same_file(&self, other: &Self) -> bool {
        (&self.name, &self.blake3) == (&other.name, &other.blake3)
    }
}

/// Counts of an encoding. Volumes are in the unit of the mesh, cubed.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Statistics {
    /// Faces of the mesh.
    pub faces: usize,
    /// Vertices of the mesh.
    pub vertices: usize,
    /// Diagonal of the bounds of the mesh, in its unit.
    pub diagonal: f64,
    /// Cells with a list.
    pub listed_cells: usize,
    /// Cells with a list that the surface passes through.
    pub crossing_cells: usize,
    /// Cells of the domain that the face tree answers.
    pub far_cells: usize,
    /// Cells farther out than the band.
    pub outside_cells: usize,
    /// Sum of the lengths of all lists. A list that several cells share counts for each cell.
    pub entries: usize,
    /// Longest list.
    pub longest_list: usize,
    /// Volume of the domain.
    pub domain_volume: f64,
    /// Volume of the far cells.
    pub far_volume: f64,
    /// Mean length of the lists, weighted by volume. Far cells are left out.
    pub volume_weighted_list: f64,
}

/// How an asset tells the sign.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum Signs {
    /// By the labels of its cells, and by the winding number of its faces in crossing cells: inside
    /// is where it is 1 or more.
    #[default]
    Cells,
    /// By the labels of its cells, and by the rule of its certificate in crossing cells, over its
    /// faces and its sign faces.
    Rule,
    /// The same, and some faces have the inside in front of them in places, or may have it.
    RuleUnoriented,
    /// The distance to the faces has no sign. Half of the thickness is subtracted.
    Sheet,
}

impl Signs {
    /// Whether a rule is evaluated at points.
    pub fn are_by_rule(self) -> bool {
        matches!(self, Self::Rule | Self::RuleUnoriented)
    }

    /// The metadata key of an asset that tells the sign in another way than [`Cells`](Self::Cells).
    const KEY: &str = super::header::RULE;

    /// The value of the key. Where faces are left out, ids of faces have gaps, which a reader of
    /// version 1 refuses.
    fn text(self, inside: &Inside) -> Option<&'static str> {
        match self {
            Self::Cells if inside.surface == SurfaceFaces::All => None,
            Self::Cells => Some("cells"),
            Self::Rule => Some("rule"),
            Self::RuleUnoriented => Some("rule-unoriented"),
            Self::Sheet => Some("sheet"),
        }
    }

    fn read(metadata: &BTreeMap<String, String>, certificate: &Certificate) -> Result<Self, AssetError> {
        let inside = certificate.inside();
        let is_sheet = matches!(inside.rule, InsideRule::Sheet { .. });
        let signs = match metadata.get(Self::KEY).map(String::as_str) {
            None | Some("cells") => Self::Cells,
            Some("rule") => Self::Rule,
            Some("rule-unoriented") => Self::RuleUnoriented,
            Some("sheet") => Self::Sheet,
            Some(other) => {
                let reason = format!(
                    "{} is {}; expected cells, rule, rule-unoriented or sheet",
                    Self::KEY,
                    super::error::shown(other)
                );
                return Err(AssetError::header(reason));
            }
        };
        let half = inside.rule.half_thickness();
        if is_sheet != (signs == Self::Sheet) || is_sheet && !(half.is_finite() && half > 0.0) {
            let reason =
                format!("the certificate's rule {} does not fit the key {}", inside.rule.name(), Self::KEY);
            return Err(AssetError::header(reason));
        }
        Ok(signs)
    }
}

/// Everything that an asset says about itself.
#[derive(Clone, Debug, PartialEq)]
pub struct About {
    /// Where the mesh came from.
    pub source: Source,
    /// The options that the asset was encoded with.
    pub options: EncodeOptions,
    pub(crate) certificate: Certificate,
    /// The counts of the encoding.
    pub statistics: Statistics,
    pub(crate) signs: Signs,
}

impl About {
    /// What the encoder proved of the lists.
    pub fn certificate(&self) -> &Certificate {
        &self.certificate
    }

    /// The metadata of a container, with one JSON text for each key.
    pub fn to_metadata(&self) -> BTreeMap<String, String> {
        let json = |v: serde_json::Result<String>| v.unwrap_or_default();
        let mut metadata = BTreeMap::from([
            ("source".into(), json(serde_json::to_string(&self.source))),
            ("options".into(), json(serde_json::to_string(&self.options))),
            ("certificate".into(), json(serde_json::to_string(&self.certificate))),
            ("statistics".into(), json(serde_json::to_string(&self.statistics))),
        ]);
        metadata
            .extend(self.signs.text(self.certificate.inside()).map(|text| (Signs::KEY.into(), text.into())));
        metadata
    }

    /// Reads the metadata of a container.
    ///
    /// # Errors
    /// Names the key that is missing, or whose text does not parse.
    pub fn from_metadata(metadata: &BTreeMap<String, String>) -> Result<Self, AssetError> {
        let certificate = read::<Written>(metadata, "certificate")?.into();
        Ok(Self {
            signs: Signs::read(metadata, &certificate)?,
            source: read(metadata, "source")?,
            options: read(metadata, "options")?,
            certificate,
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
