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
//! shape = "plane"              # or { box = { half_extents = [x, y, z] } }, sphere, capsule, cylinder
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
//! [[robots]]
//! file = "arm.urdf"            # its links become bodies, its joints joints
//! fixed = true
//! coordinates = { elbow = 0.5 }
//!
//! [[joints]]
//! name = "spindle"
//! kind = "hinge"               # or weld, ball, slider
//! child = "nut"                # parent = "…": a body; without it, the world
//! anchor = [0, 0, 0.05]
//! axis = [0, 0, 1]
//! motor = { drive = { velocity = 1.5 }, limit = 0.2 }    # rad/s, N m
//!
//! [[couplings]]                # joint "wheel" turns twice as far, the other way
//! joint = "wheel"
//! of = "spindle"
//! ratio = -2
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

mod asset_cache;
mod build;
mod connect;
mod copies;
mod error;
mod limits;
mod parts;
mod place;
mod read;
mod robots;
mod units;

use std::path::PathBuf;

use serde::{Deserialize, Serialize};
use tesdf::Length;
use tesdf::base::{Named as _, SurfaceFaces};
use tesdf::collide::{CollideError, CollideOptions, ContactsPer, FaceOptions, Mode, ModeChoices, ModeName};
use toml::Spanned;

pub use asset_cache::AssetCache;
pub use copies::CopiesSection;
pub use error::SceneError;
pub use limits::{LimitError, MAX_BODIES, MAX_STATE_BYTES, MAX_STEPS};
pub(crate) use parts::joined;
pub use parts::{PartSection, PartShape};
pub use place::PoseSection;
pub use read::LoadedScene;
pub use robots::{RobotMotor, RobotSection};

use crate::criterion::CriterionSection;
use crate::newton::NewtonOptions;
use crate::script::Script;
use crate::{JointKind, JointResistance, Motor};

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
    /// Robot descriptions. A loaded scene has their links as bodies, after the others.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub robots: Vec<RobotSection>,
    /// Coefficients of friction of pairs of bodies, in place of those that follow from the bodies.
    #[serde(default)]
    pub friction: Vec<FrictionSection>,
    /// Pairs of bodies that have no contacts with each other.
    #[serde(default)]
    pub exclude: Vec<ExcludeSection>,
    /// Joints between bodies, or a body and the world.
    #[serde(default)]
    pub joints: Vec<JointSection>,
    /// Couplings of joints: gears, mimic joints.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub couplings: Vec<CouplingSection>,
    /// What drives kinematic bodies, motors and wrenches in time.
    #[serde(default)]
    pub scripts: Vec<Script>,
}

/// Friction between two bodies.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FrictionSection {
    /// The names of the two bodies.
    pub bodies: [String; 2],
    /// Coefficient of friction.
    pub coefficient: f64,
    /// Coefficient of torsional friction, m [default: that which follows from the bodies].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub torsional: Option<f64>,
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
    /// The angle of a hinge, rad within ±π, or the travel of a slider, m, where the bodies start.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub coordinate: f64,
    /// Bounds of a hinge's angle, rad, or of a slider's travel, m. Of a ball: 0 and the greatest
    /// angle of its axis, rad.
    #[serde(default)]
    pub limits: Option<[f64; 2]>,
    /// Drives a hinge or a slider.
    #[serde(default)]
    pub motor: Option<Motor>,
    /// Resists the motion of a hinge or a slider.
    #[serde(default)]
    pub resistance: JointResistance,
}

impl JointSection {
    /// A joint with the world and the defaults of a scene file.
    fn new(name: String, kind: JointKind, child: String) -> Self {
        Self {
            name,
            kind,
            parent: None,
            child,
            anchor: None,
            axis: up(),
            coordinate: 0.0,
            limits: None,
            motor: None,
            resistance: JointResistance::default(),
        }
    }
}

/// Keeps the coordinate of a joint at `ratio` times that of another one, plus `offset`. Both are
/// hinges or sliders, and whole turns of hinges count.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CouplingSection {
    /// Name of the joint that follows.
    pub joint: String,
    /// Name of the joint that it follows.
    pub of: String,
    /// Change of its coordinate by that of the other one, in their units; not 0.
    #[serde(default = "one")]
    pub ratio: f64,
    /// Its coordinate where that of the other one is 0, rad or m.
    #[serde(default)]
    pub offset: f64,
}

#[allow(clippy::trivially_copy_pass_by_ref, reason = "serde calls it with a reference")]
fn is_zero(number: &f64) -> bool {
    *number == 0.0
}

fn up() -> [f64; 3] {
    [0.0, 0.0, 1.0]
}

fn earth() -> [f64; 3] {
    [0.0, 0.0, -9.81]
}

/// A body. Exactly one of `asset`, `mesh`, `shape` and `parts` gives its geometry.
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
    /// Meshes and simple shapes that are one body together. It is encoded as a mesh.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub parts: Vec<PartSection>,
    /// Metres per unit of the mesh or shape.
    #[serde(default = "one")]
    pub scale: f64,
    /// Position of the body's origin, m, world frame.
    #[serde(default)]
    pub translation: [f64; 3],
    /// Orientation: a unit quaternion x y z w.
    #[serde(default = "identity")]
    pub rotation: [f64; 4],
    /// Both together: x y z qx qy qz qw, or the rows of a matrix of 4 × 4. A loaded scene has them
    /// apart.
    #[serde(default, skip_serializing)]
    pub pose: Option<PoseSection>,
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
    /// Centre of mass in the body's frame, m, of a body with `mass` [default: that of the geometry].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub center_of_mass: Option<[f64; 3]>,
    /// Inertia about the centre of mass along the axes of the body's frame, kg m², of a body with
    /// `mass`: xx, yy, zz, xy, xz, yz [default: that of the geometry].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub inertia: Option<[f64; 6]>,
    /// Whether the body never moves.
    #[serde(default)]
    pub fixed: bool,
    /// Whether the body moves with its velocities, or as a script says, whatever it meets.
    #[serde(default)]
    pub kinematic: bool,
    /// Coefficient of friction. Between two bodies the geometric mean of theirs acts.
    #[serde(default)]
    pub friction: f64,
    /// Coefficient of torsional friction, m: a contact resists spin about its normal by a moment of at
    /// most this length times the force along the normal. Between two bodies the geometric mean of
    /// theirs acts.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub friction_torsional: f64,
    /// Coefficient of restitution. Between two bodies the geometric mean of theirs acts.
    #[serde(default)]
    pub restitution: f64,
    /// Rate at which the velocity of a free body decays, 1/s.
    #[serde(default)]
    pub linear_damping: f64,
    /// Rate at which the angular velocity of a free body decays, 1/s.
    #[serde(default)]
    pub angular_damping: f64,
    /// The groups that the body is in, as 32 bits. Two bodies meet where the memberships of each have
    /// a bit in common with the filter of the other.
    #[serde(default = "every")]
    pub memberships: u32,
    /// The groups that it meets, as 32 bits.
    #[serde(default = "every")]
    pub filter: u32,
}

impl BodySection {
    /// A body without geometry, with the defaults of a scene file.
    fn new(name: String) -> Self {
        Self {
            name,
            copies: None,
            asset: None,
            mesh: None,
            inside: None,
            thickness: None,
            surface: None,
            repair: None,
            shape: None,
            parts: Vec::new(),
            scale: one(),
            translation: [0.0; 3],
            rotation: identity(),
            pose: None,
            velocity: [0.0; 3],
            angular_velocity: [0.0; 3],
            density: None,
            mass: None,
            center_of_mass: None,
            inertia: None,
            fixed: false,
            kinematic: false,
            friction: 0.0,
            friction_torsional: 0.0,
            restitution: 0.0,
            linear_damping: 0.0,
            angular_damping: 0.0,
            memberships: every(),
            filter: every(),
        }
    }
}

fn every() -> u32 {
    u32::MAX
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
    /// A cylinder about the z axis, centred on the origin.
    Cylinder {
        /// Half of its length, m.
        half_height: f64,
        /// Radius, m.
        radius: f64,
    },
}

/// The modes of a scene file: those of a detection, and `off`.
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

tesdf::named!(DetectorMode {
    Node: "node", "The vertices";
    Face: "face", "The faces, by Frank-Wolfe iterations";
    Exact: "exact", "The faces, with the exact minimum";
    Off: "off", "Nothing: bodies pass through each other, and a criterion should fail";
});

impl DetectorMode {
    /// The mode of a detection; `None` for `off`.
    fn of_detection(self) -> Option<ModeName> {
        match self {
            Self::Node => Some(ModeName::Node),
            Self::Face => Some(ModeName::Face),
            Self::Exact => Some(ModeName::Exact),
            Self::Off => None,
        }
    }
}

/// How contacts are detected.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "DetectorText", into = "DetectorText")]
pub struct DetectorSection {
    /// The mode with its options; the tolerance is a fraction of the diagonal. `None`: nothing is
    /// detected, as the mode `off` says.
    pub mode: Option<Mode>,
    /// Contacts are recorded up to this distance, m, in addition to the distance that motion can
    /// close in a step [default: 0.5 % of the diagonal of the smallest body that is not fixed].
    pub contact_distance: Option<f64>,
}

impl DetectorSection {
    /// The name of the mode.
    pub fn name(&self) -> DetectorMode {
        match self.mode.map(|mode| mode.kind()) {
            Some(ModeName::Node) => DetectorMode::Node,
            Some(ModeName::Face) => DetectorMode::Face,
            Some(ModeName::Exact) => DetectorMode::Exact,
            None => DetectorMode::Off,
        }
    }

    /// Chooses another mode. It has the options of faces that the section has, where both modes use
    /// them, and otherwise [`FaceOptions::OF_SIMULATION`].
    pub fn choose(&mut self, name: DetectorMode) {
        if self.name() != name {
            let faces = self.mode.as_ref().and_then(Mode::faces).copied();
            let faces = faces.unwrap_or(FaceOptions::OF_SIMULATION);
            self.mode = name.of_detection().map(|name| name.with(faces));
        }
    }
}

impl Default for DetectorSection {
    fn default() -> Self {
        Self { mode: Some(CollideOptions::for_simulation().mode), contact_distance: None }
    }
}

/// The keys of `[detector]`. A run has all of them, so one that its mode does not use may have its
/// default.
#[derive(Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
struct DetectorText {
    mode: DetectorMode,
    contacts_per: ContactsPer,
    iterations: u32,
    /// Fraction of the diagonal.
    tolerance: f64,
    cos_theta: Option<f64>,
    contact_distance: Option<f64>,
}

impl Default for DetectorText {
    fn default() -> Self {
        DetectorSection::default().into()
    }
}

impl TryFrom<DetectorText> for DetectorSection {
    type Error = CollideError;

    fn try_from(text: DetectorText) -> Result<Self, CollideError> {
        let usual = DetectorText::default();
        let name = text.mode.of_detection();
        let choices = ModeChoices {
            // The mode `off` uses no option either.
            mode: name.or(Some(ModeName::Node)),
            contacts_per: (text.contacts_per != usual.contacts_per).then_some(text.contacts_per),
            iterations: (text.iterations != usual.iterations).then_some(text.iterations),
            tolerance: (text.tolerance != usual.tolerance).then_some(Length::OfDiagonal(text.tolerance)),
            cos_theta: text.cos_theta,
        };
        let mode = choices.mode(FaceOptions::OF_SIMULATION).map_err(|e| match e {
            CollideError::NotOfMode { option, modes, .. } => {
                CollideError::NotOfMode { option, mode: text.mode.name(), modes }
            }
            e => e,
        })?;
        Ok(Self { mode: name.map(|_| mode), contact_distance: text.contact_distance })
    }
}

impl From<DetectorSection> for DetectorText {
    fn from(section: DetectorSection) -> Self {
        let faces =
            section.mode.as_ref().and_then(Mode::faces).copied().unwrap_or(FaceOptions::OF_SIMULATION);
        // A length is refused before a scene is written.
        let (Length::OfDiagonal(tolerance) | Length::Absolute(tolerance)) = faces.tolerance;
        Self {
            mode: section.name(),
            contacts_per: faces.contacts_per,
            iterations: match section.mode {
                Some(Mode::Face { iterations, .. }) => iterations,
                _ => Mode::ITERATIONS,
            },
            tolerance,
            cos_theta: faces.cos_theta,
            contact_distance: section.contact_distance,
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
    /// The forces of contacts and joints are recorded at every step whose number, from 0, is a
    /// multiple of this value; 0 records none. A contact that pushes takes 56 bytes, a joint 32.
    pub forces_every: u32,
}
