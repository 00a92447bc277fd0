//! Scene files in TOML: bodies, joints, scripts, detection, solver, recording and success criteria.
//! `docs/scene-file.md` lists all keys.
//!
//! ```toml
//! time_step = 1e-3             # s
//! duration = 0.3               # s
//! gravity = [0, 0, -9.81]      # m/s²
//!
//! [[bodies]]
//! name = "floor"
//! shape = "plane"              # or { box = { half_extents = [x, y, z] } }, sphere, capsule
//! fixed = true
//!
//! [[bodies]]
//! name = "nut"
//! mesh = "nut.obj"             # metres; encoded when the scene is loaded; or asset = "nut.tesdf"
//! # inside = "sheet"           # of the mesh: what is inside; with thickness = 0.001; or surface
//! repair = "auto"              # repairs the mesh first, if it needs it; the default is "never"
//! density = 7850               # kg/m³; or mass = 0.1
//! translation = [0, 0, 0.05]   # of the mesh's origin; rotation = [x, y, z, w]
//!
//! [[bodies]]
//! name = "link"                # link0 to link9
//! mesh = "link.obj"
//! density = 7850
//! # The next one in the frame of the one before: turned by 90° about x.
//! copies = { count = 10, translation = [0.029, 0, 0], rotation = [0.707106781186548, 0, 0, 0.707106781186548] }
//! friction = 0.2               # with another body: the geometric mean of both
//!
//! [[joints]]
//! name = "spindle"
//! kind = "hinge"               # or weld, ball, slider
//! child = "nut"                # parent = "…": a body; without it, the world
//! anchor = [0, 0, 0.05]
//! axis = [0, 0, 1]
//! motor = { drive = { velocity = 1.5 }, limit = 0.2 }    # rad/s, N m
//!
//! [[scripts]]                  # the motor stops after a second
//! joint = "spindle"
//! interpolation = "step"
//! keyframes = [{ time = 0, target = 1.5 }, { time = 1, target = 0 }]
//!
//! [[exclude]]                  # no contacts between these two
//! bodies = ["link0", "floor"]
//!
//! [detector]
//! mode = "exact"               # node, face, exact, or off
//! ```
//!
//! Paths are relative to the scene's folder. Lengths are metres: a body's `scale` is the length of
//! one unit of its mesh, m. If the assets record different units, their scales must agree with
//! these units, or loading fails.

mod build;
mod connect;
mod copies;
mod error;
mod limits;
mod read;
mod units;

use std::path::PathBuf;

use serde::{Deserialize, Serialize};
use tesdf::base::SurfaceFaces;
use tesdf::collide::ContactsPer;
use toml::Spanned;

pub use copies::CopiesSection;
pub use error::SceneError;
pub use limits::{LimitError, MAX_BODIES, MAX_STATE_BYTES, MAX_STEPS};
pub use read::LoadedScene;

use crate::criterion::CriterionSection;
use crate::newton::NewtonOptions;
use crate::plan::PlanSection;
use crate::script::Script;
use crate::{JointKind, Motor};

/// The content of a scene file, in SI units.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SceneFile {
    /// Time step, s.
    pub time_step: f64,
    /// Duration, s; rounded to whole steps, at most [`MAX_STEPS`].
    pub duration: f64,
    /// Gravitational acceleration, m/s².
    #[serde(default = "earth")]
    pub gravity: [f64; 3],
    /// How contacts are detected.
    #[serde(default)]
    pub detector: DetectorSection,
    /// Parameters of the built-in engine.
    #[serde(default)]
    pub solver: NewtonOptions,
    /// What the run file records besides the states.
    #[serde(default)]
    pub record: RecordSection,
    /// What makes the run a success.
    #[serde(default)]
    pub criterion: CriterionSection,
    /// The bodies, at most [`MAX_BODIES`].
    pub bodies: Vec<Spanned<BodySection>>,
    /// Coefficients of friction of pairs of bodies, in place of those that follow from the bodies.
    #[serde(default)]
    pub friction: Vec<FrictionSection>,
    /// Pairs of bodies that have no contacts with each other.
    #[serde(default)]
    pub exclude: Vec<ExcludeSection>,
    /// Joints between bodies, or a body and the world.
    #[serde(default)]
    pub joints: Vec<JointSection>,
    /// What drives kinematic bodies, motors and wrenches in time.
    #[serde(default)]
    pub scripts: Vec<Script>,
    /// Tasks of grippers. A loaded scene has scripts in their place.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub plan: Option<PlanSection>,
}

/// Friction between two bodies.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FrictionSection {
    /// The names of the two bodies.
    pub bodies: [String; 2],
    /// Coefficient of friction.
    pub coefficient: f64,
}

/// Two bodies that have no contacts with each other, such as a shaft and a gear whose bearing is a
/// joint with the world.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ExcludeSection {
    /// The names of the two bodies.
    pub bodies: [String; 2],
}

/// A joint. Its two bodies have no contacts with each other.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct JointSection {
    /// Name, unique among the joints.
    pub name: String,
    /// `weld`, `ball`, `hinge` or `slider`.
    pub kind: JointKind,
    /// Name of the parent body [default: the world].
    #[serde(default)]
    pub parent: Option<String>,
    /// Name of the child body.
    pub child: String,
    /// A point of the joint, m, world frame, with the bodies where they start [default: the origin
    /// of the child].
    #[serde(default)]
    pub anchor: Option<[f64; 3]>,
    /// Axis of a hinge or a slider, or of the cone that limits a ball: any length except 0, world
    /// frame, with the bodies where they start.
    #[serde(default = "up")]
    pub axis: [f64; 3],
    /// Bounds of a hinge's angle, rad, or of a slider's travel, m, which are 0 at the start. Of a
    /// ball: 0 and the greatest angle of its axis, rad.
    #[serde(default)]
    pub limits: Option<[f64; 2]>,
    /// Drives a hinge or a slider.
    #[serde(default)]
    pub motor: Option<Motor>,
}

fn up() -> [f64; 3] {
    [0.0, 0.0, 1.0]
}

fn earth() -> [f64; 3] {
    [0.0, 0.0, -9.81]
}

/// A body. Exactly one of `asset`, `mesh` and `shape` gives its geometry.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BodySection {
    /// Name, unique in the scene.
    pub name: String,
    /// Places the body many times. A loaded scene has each copy as a body of its own.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub copies: Option<CopiesSection>,
    /// Path of a `.tesdf` file.
    #[serde(default)]
    pub asset: Option<PathBuf>,
    /// Path of a mesh file, which is encoded with the preset `fast` when the scene is loaded.
    #[serde(default)]
    pub mesh: Option<PathBuf>,
    /// What is inside of the mesh of `mesh`: `winding`, `nonzero`, `odd`, `generalized` or `sheet`.
    /// The default is `winding`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub inside: Option<String>,
    /// Thickness of the mesh as a sheet, in the unit of the mesh.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub thickness: Option<f64>,
    /// The surface of the mesh: `all` faces, or the `boundary` between inside and outside.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub surface: Option<SurfaceFaces>,
    /// `auto`: a mesh without a well-defined inside is repaired before it is encoded, if a repair
    /// works; `never`, the default: it is an error. Only a body with `mesh` may have `auto`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub repair: Option<String>,
    /// A simple shape.
    #[serde(default)]
    pub shape: Option<ShapeSection>,
    /// Metres per unit of the mesh or shape.
    #[serde(default = "one")]
    pub scale: f64,
    /// Position of the body's origin, m, world frame.
    #[serde(default)]
    pub translation: [f64; 3],
    /// Orientation: a unit quaternion x y z w.
    #[serde(default = "identity")]
    pub rotation: [f64; 4],
    /// Velocity of the body's origin, m/s.
    #[serde(default)]
    pub velocity: [f64; 3],
    /// Angular velocity, rad/s.
    #[serde(default)]
    pub angular_velocity: [f64; 3],
    /// Density, kg/m³. A free body has either `density` or `mass`.
    #[serde(default)]
    pub density: Option<f64>,
    /// Mass, kg.
    #[serde(default)]
    pub mass: Option<f64>,
    /// Whether the body never moves.
    #[serde(default)]
    pub fixed: bool,
    /// Whether the body moves with its velocities, or as a script says, whatever it meets.
    #[serde(default)]
    pub kinematic: bool,
    /// Coefficient of friction. Between two bodies the geometric mean of theirs acts.
    #[serde(default)]
    pub friction: f64,
    /// Rate at which the angular velocity of a free body decays, 1/s.
    #[serde(default)]
    pub angular_damping: f64,
}

fn one() -> f64 {
    1.0
}

fn identity() -> [f64; 4] {
    [0.0, 0.0, 0.0, 1.0]
}

/// A simple shape, as [`tesdf::collide::Shape`].
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum ShapeSection {
    /// The half space z ≤ 0.
    Plane,
    /// A box, centred on the origin.
    Box {
        /// Half of the edge lengths along x, y and z, m.
        half_extents: [f64; 3],
    },
    /// A ball, centred on the origin.
    Sphere {
        /// Radius, m.
        radius: f64,
    },
    /// A capsule: the points within `radius` of a segment of the z axis, centred on the origin.
    Capsule {
        /// Half of the segment's length, m.
        half_height: f64,
        /// Radius, m.
        radius: f64,
    },
}

/// The features of one body that are tested against the distance field of the other.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum DetectorMode {
    /// The vertices.
    Node,
    /// The faces, by a fixed number of Frank–Wolfe iterations.
    Face,
    /// The faces, with the exact minimum. `edge`, the edges of faces, means the same.
    #[serde(alias = "edge")]
    Exact,
    /// Nothing: bodies pass through each other. A criterion that holds even then tests nothing.
    Off,
}

/// How contacts are detected.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct DetectorSection {
    /// Which features are tested.
    pub mode: DetectorMode,
    /// What a contact of the modes `face` and `exact` stands for: a face in one cell of the other
    /// body, a face, or a local minimum of the distance over the surface. As planes, other contacts
    /// of faces stop bodies that have room.
    pub contacts_per: ContactsPer,
    /// Number of Frank–Wolfe iterations in the mode `face`.
    pub iterations: u32,
    /// Tolerance in the mode `exact`, as a fraction of the diagonal of the body with the field.
    pub tolerance: f64,
    /// Cosine filter of the modes `face` and `exact`.
    pub cos_theta: Option<f64>,
    /// Contacts are recorded up to this distance, m, in addition to the distance that motion can
    /// close in a step [default: 0.5 % of the diagonal of the smallest body that is not fixed].
    pub contact_distance: Option<f64>,
}

impl Default for DetectorSection {
    fn default() -> Self {
        Self {
            mode: DetectorMode::Exact,
            contacts_per: ContactsPer::Minimum,
            iterations: 16,
            tolerance: 1e-7,
            cos_theta: None,
            contact_distance: None,
        }
    }
}

/// What the run file records besides poses and velocities.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct RecordSection {
    /// Contacts are recorded at every step whose number, from 0, is a multiple of this value; 0
    /// records none. A contact takes 44 bytes.
    pub contacts_every: u32,
}
