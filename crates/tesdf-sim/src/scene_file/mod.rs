//! Scenes as TOML: bodies, detection, solver, what is recorded, and what counts as success.
//!
//! ```toml
//! time_step = 1e-3                      # s
//! duration = 0.3                        # s
//! gravity = [0, 0, -9.81]               # m/s²
//!
//! [[bodies]]
//! name = "floor"
//! shape = "plane"                       # or { box = { half_extents = [x, y, z] } }, sphere, capsule
//! fixed = true
//!
//! [[bodies]]
//! name = "nut"
//! mesh = "nut.obj"                      # encoded when the scene is loaded; or asset = "nut.tesdf"; metres
//! density = 7850                        # kg/m³; or mass = 0.1
//! translation = [0, 0, 0.05]            # of the mesh's origin; rotation = [x, y, z, w]
//!
//! [detector]
//! mode = "exact"                        # node, face, exact, or off
//! ```
//!
//! Paths are relative to the scene's folder. Lengths are metres: a body's `scale` says how many metres a unit of its mesh has. When assets record
//! different units, scales that do not make one unit of them are an error.

mod build;
mod error;
mod limits;
mod read;
mod units;

use std::path::PathBuf;

use serde::{Deserialize, Serialize};
use toml::Spanned;

pub use error::SceneError;
pub use limits::{LimitError, MAX_BODIES, MAX_STATE_BYTES, MAX_STEPS};
pub use read::LoadedScene;

use crate::criterion::ScrewCriterion;
use crate::newton::NewtonOptions;

/// A scene as its file says it. SI units.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SceneFile {
    /// s.
    pub time_step: f64,
    /// s; rounded to whole steps, at most [`MAX_STEPS`].
    pub duration: f64,
    /// m/s².
    #[serde(default = "earth")]
    pub gravity: [f64; 3],
    /// How contacts are found.
    #[serde(default)]
    pub detector: DetectorSection,
    /// How the embedded engine solves.
    #[serde(default)]
    pub solver: NewtonOptions,
    /// What is written to the run file.
    #[serde(default)]
    pub record: RecordSection,
    /// What makes the run a success.
    #[serde(default)]
    pub criterion: CriterionSection,
    /// The bodies, at most [`MAX_BODIES`].
    pub bodies: Vec<Spanned<BodySection>>,
}

fn earth() -> [f64; 3] {
    [0.0, 0.0, -9.81]
}

/// A body. One of `asset`, `mesh` and `shape` says what it is.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BodySection {
    /// Named once.
    pub name: String,
    /// A `.tesdf` file.
    #[serde(default)]
    pub asset: Option<PathBuf>,
    /// A mesh file, encoded with the preset `fast` when the scene is loaded.
    #[serde(default)]
    pub mesh: Option<PathBuf>,
    /// A simple shape.
    #[serde(default)]
    pub shape: Option<ShapeSection>,
    /// Metres per unit of the mesh or shape.
    #[serde(default = "one")]
    pub scale: f64,
    /// Of the body's origin, m.
    #[serde(default)]
    pub translation: [f64; 3],
    /// Unit quaternion x y z w.
    #[serde(default = "identity")]
    pub rotation: [f64; 4],
    /// Of the body's origin, m/s.
    #[serde(default)]
    pub velocity: [f64; 3],
    /// rad/s.
    #[serde(default)]
    pub angular_velocity: [f64; 3],
    /// kg/m³; this or `mass` for a free body.
    #[serde(default)]
    pub density: Option<f64>,
    /// kg.
    #[serde(default)]
    pub mass: Option<f64>,
    /// Whether nothing moves it.
    #[serde(default)]
    pub fixed: bool,
}

fn one() -> f64 {
    1.0
}

fn identity() -> [f64; 4] {
    [0.0, 0.0, 0.0, 1.0]
}

/// A simple shape; as [`tesdf::collide::Shape`].
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum ShapeSection {
    /// The half space z ≤ 0.
    Plane,
    /// Centred on the origin.
    Box {
        /// m.
        half_extents: [f64; 3],
    },
    /// Around the origin.
    Sphere {
        /// m.
        radius: f64,
    },
    /// Around a segment of the z axis.
    Capsule {
        /// Half of the segment's length, m.
        half_height: f64,
        /// m.
        radius: f64,
    },
}

/// What is tested against the other body's field.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum DetectorMode {
    /// The vertices.
    Node,
    /// The faces, by Frank–Wolfe iterations.
    Face,
    /// The faces, the exact minimum.
    Exact,
    /// Nothing: bodies pass through each other. A criterion that still holds tests nothing.
    Off,
}

/// How contacts are found.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct DetectorSection {
    /// Nodes, faces, or none.
    pub mode: DetectorMode,
    /// Of the mode `face`.
    pub iterations: u32,
    /// Of the mode `exact`: share of the diagonal of the field's body.
    pub tolerance: f64,
    /// Cosine filter of the modes `face` and `exact`.
    pub cos_theta: Option<f64>,
    /// Contacts are taken up to this distance, m, besides what motion can close in a step [default: 0.5 % of the diagonal of the
    /// smallest free body].
    pub contact_distance: Option<f64>,
}

impl Default for DetectorSection {
    fn default() -> Self {
        Self {
            mode: DetectorMode::Exact,
            iterations: 16,
            tolerance: 1e-7,
            cos_theta: None,
            contact_distance: None,
        }
    }
}

/// What is written besides poses and velocities.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct RecordSection {
    /// Contacts of every so many steps, beginning with the first; 0: none. A contact takes 44 bytes.
    pub contacts_every: u32,
}

/// What makes a run a success; every part that is given must hold.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct CriterionSection {
    /// A body turns along a thread.
    pub screw: Option<ScrewCriterion>,
}
