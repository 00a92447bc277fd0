use std::str::FromStr;

use serde::{Deserialize, Serialize};

use crate::base::{Inside, InsideRule, Length};
use crate::geometry::Aabb;
use crate::named;

/// A set of options by name: a balance of memory and speed, or the options of the paper.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum Preset {
    /// Few faces for each query.
    #[default]
    Default,
    /// Quick to encode. Lists are not shortened much.
    Fast,
    /// Small files, with more faces for each query.
    Compact,
    /// For detection on a GPU: [`Groups::OF_A_GPU`], so cells are few and lists fill the threads
    /// that read them.
    Gpu,
    /// [`EncodeOptions::PAPER`]: the only preset that is not exact.
    Paper,
    /// [`EncodeOptions::SAMPLED_SAFE`].
    SampledSafe,
}

named!(Preset {
    Default: "default", "Fast queries";
    Fast: "fast", "Fast encoding";
    Compact: "compact", "Small files";
    Gpu: "gpu", "Few cells, whose lists fill the 32 threads of a GPU that read them; for detection on a GPU";
    Paper: "paper", "The paper's encoder: sampled, 129 samples along an edge, tetrahedra not bisected";
    SampledSafe: "sampled-safe", "Sampled with a threshold that is large enough that no needed face is missing";
});

/// How the faces of a list are found.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Method {
    /// By bounds: a list has all faces that the bounds cannot rule out, so no face is missing.
    #[default]
    Certified,
    /// By samples, with Algorithm 1 of the paper: a list has the faces that are closest at samples.
    Sampled(Sampling),
}

/// How [`Method::Sampled`] samples.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Sampling {
    /// Q: samples have barycentric coordinates that are multiples of 1 / Q.
    pub resolution: u32,
    /// α: before, the cell is shrunk towards its centroid by this factor.
    pub shrink: f64,
    /// ε: how much farther than the closest face a listed face may be at a sample.
    pub threshold: Threshold,
}

impl Sampling {
    /// The sampling of the paper, Sec. VII-A.
    pub const PAPER: Self = Self { resolution: 128, shrink: 0.999, threshold: Threshold::Absolute(0.0) };
    /// A threshold so wide that no face is missing: a face that is closest at any point is within
    /// the threshold at the nearest sample.
    pub const SAFE: Self = Self { resolution: 16, shrink: 1.0, threshold: Threshold::CoveringRadius };
}

/// How much farther than the closest face a listed face may be at a sample.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Threshold {
    /// A length in the unit of the mesh.
    Absolute(f64),
    /// An area in the squared unit of the mesh, by which squared distances may differ, as in the
    /// paper's authors' program TES-Encoder. Near the surface it allows more than far from it: 1e-6
    /// allows 1e-3 on the surface, and 5e-6 at a distance of 0.1.
    Squared(f64),
    /// Twice the covering radius, the distance within which every point of the cell has a sample.
    CoveringRadius,
}

/// A text that is no [`Threshold`].
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("'{0}' is no threshold; expected a length of 0 or more, 'safe', or 'squared:' and an area")]
pub struct UnknownThreshold(String);

impl FromStr for Threshold {
    type Err = UnknownThreshold;

    /// A length, `safe`, or an area such as `squared:1e-6`.
    fn from_str(text: &str) -> Result<Self, UnknownThreshold> {
        let number = |text: &str| text.trim().parse().ok().filter(|x: &f64| *x >= 0.0 && x.is_finite());
        let found = match text.split_once(':') {
            Some(("squared", area)) => number(area).map(Self::Squared),
            _ if text == "safe" => Some(Self::CoveringRadius),
            _ => number(text).map(Self::Absolute),
        };
        found.ok_or_else(|| UnknownThreshold(text.into()))
    }
}

/// How the tetrahedra of a conforming domain are refined.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Refinement {
    /// They are bisected where shorter lists are worth the bytes.
    #[default]
    ByCost,
    /// They are left whole, as in the plain form of the paper.
    None,
}

/// Whether the vertices will move.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Deformation {
    /// The vertices will not move.
    #[default]
    None,
    /// The vertices will move. So the lists of tetrahedra at the surface have all faces around
    /// their surface vertices (Sec. V-D).
    Expected,
}

/// How lists are read where many threads read one list together, as on a GPU.
///
/// A group of 32 threads takes as long for a list of 13 faces as for a list of 32. So cells are
/// merged as long as their list fits a group.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Groups {
    /// How many faces are read at once. A list costs a query as much as its number of groups.
    pub size: u32,
    /// Cells nearer to the surface than this are bisected until their list fits one group. Lists
    /// stay longer where small cells need them too, such as over a vertex of more faces, or where
    /// more faces are equally near.
    ///
    /// [`max_entries`](EncodeOptions::max_entries) drops no face that is needed nearer to the
    /// surface than this, so distances are exact that far.
    pub fit_within: Length,
}

impl Groups {
    /// Groups of 32 threads, and the distance within which the paper's assets are exact with lists
    /// of 32 faces (Table I), as a share of the diagonal.
    pub const OF_A_GPU: Self = Self { size: 32, fit_within: Length::OfDiagonal(0.03) };
}

/// The options of an encoding.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct EncodeOptions {
    /// Width of the layer outside of the surface that belongs to the bisection domain. A conforming
    /// domain consists of its tetrahedra and has no band.
    pub band: Length,
    /// Further boxes that belong to the bisection domain, in the unit of the mesh: `[min x y z, max
    /// x y z]`.
    pub regions: Vec<[f64; 6]>,
    /// The worth of a byte: one more byte for each face of the mesh is worth this many fewer faces
    /// in a query near the surface. A smaller number makes more cells with shorter lists.
    pub byte_worth: f64,
    /// How many bisections below each cell may tell apart the faces that the cell needs. With 0,
    /// lists are not shortened.
    pub tighten_levels: u32,
    /// Name of the unit of the mesh. Nothing is scaled.
    pub unit: Option<String>,
    /// How the faces of a list are found.
    #[serde(default, rename = "encoder")]
    pub method: Method,
    /// E_max: a longer list is cut to the faces that are needed nearest to the surface (Sec. V-C).
    /// Faces that the sign in a crossing cell needs stay, and so do those of
    /// [`Groups::fit_within`].
    #[serde(default)]
    pub max_entries: Option<u32>,
    /// How the tetrahedra of a conforming domain are refined.
    #[serde(default)]
    pub refinement: Refinement,
    /// Whether the vertices will move. Only in a conforming domain.
    #[serde(default)]
    pub deformation: Deformation,
    /// Groups in which lists are read. `None`: a query pays for each face of a list.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub groups: Option<Groups>,
    /// What is inside, and which faces are the surface. [`Encoder::encode_file`] makes the
    /// [`SolidMesh`] with it; a solid that is passed to [`Encoder::encode`] brings its own.
    ///
    /// [`Encoder::encode`]: crate::encode::Encoder::encode
    /// [`Encoder::encode_file`]: crate::encode::Encoder::encode_file
    /// [`SolidMesh`]: crate::mesh::SolidMesh
    #[serde(default, skip_serializing_if = "Inside::is_default")]
    pub inside: Inside,
}

impl EncodeOptions {
    /// The encoder of the paper, in a conforming domain that is left as it is.
    pub const PAPER: Self = Self::sampled(Sampling::PAPER);
    /// The same, with a threshold so wide that no face is missing.
    pub const SAMPLED_SAFE: Self = Self::sampled(Sampling::SAFE);

    /// These options, with the unit of the file of the mesh unless they have a unit.
    pub fn or_unit(self, of_file: Option<&str>) -> Self {
        Self { unit: self.unit.or_else(|| of_file.map(str::to_owned)), ..self }
    }

    const fn sampled(sampling: Sampling) -> Self {
        Self {
            band: Length::OfDiagonal(0.05),
            regions: Vec::new(),
            byte_worth: 0.067,
            tighten_levels: 0,
            unit: None,
            method: Method::Sampled(sampling),
            max_entries: None,
            refinement: Refinement::None,
            deformation: Deformation::None,
            groups: None,
            inside: Inside::new(InsideRule::Winding),
        }
    }

    /// The options of a preset.
    pub fn preset(preset: Preset) -> Self {
        let (byte_worth, tighten_levels, groups) = match preset {
            Preset::Default => (0.067, 12, None),
            Preset::Fast => (0.12, 2, None),
            Preset::Compact => (0.24, 11, None),
            Preset::Gpu => (0.24, 11, Some(Groups::OF_A_GPU)),
            Preset::Paper => return Self::PAPER,
            Preset::SampledSafe => return Self::SAMPLED_SAFE,
        };
        Self {
            byte_worth,
            tighten_levels,
            groups,
            method: Method::Certified,
            refinement: Refinement::ByCost,
            ..Self::PAPER
        }
    }

    /// [`Groups::fit_within`] for a mesh of this diagonal, in its unit; 0 without groups.
    pub(crate) fn fit_within(&self, diagonal: f64) -> f64 {
        self.groups.map_or(0.0, |groups| groups.fit_within.resolve(diagonal))
    }

    /// The regions as boxes.
    pub fn region_boxes(&self) -> impl Iterator<Item = Aabb> {
        self.regions.iter().map(|&[a, b, c, d, e, f]| Aabb {
            min: glam::DVec3::new(a, b, c),
            max: glam::DVec3::new(d, e, f),
        })
    }
}

impl Default for EncodeOptions {
    fn default() -> Self {
        Self::preset(Preset::Default)
    }
}
