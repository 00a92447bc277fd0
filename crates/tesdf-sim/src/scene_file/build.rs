use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use tesdf::base::Inside;
use tesdf::collide::{
    CoarseContact, CollideError, CollideOptions, Contacts, Groups, Instance, Mode, Pose, Scene, Shape,
    ShapeId, Velocity, coarse_contacts, detect,
};
use tesdf::encode::{EncodeChoices, EncodeError, EncodeFileError, Encoder, Preset};
use tesdf::glam::{DQuat, DVec3};
use tesdf::input;
use tesdf::mesh::{RepairMode, SolidMesh, UnknownRepair};
use tesdf::{Length, Progress, TeSdf};

use super::parts::joined;
use super::read::LoadedScene;
use super::units::Measure;
use super::{BodySection, DetectorSection, SceneError, ShapeSection};
use crate::newton::{Detect, Newton};
use crate::{DynamicsError, Mass, MassProperties, System, inertia_matrix};

/// Default contact distance, as a fraction of the smallest free body's diagonal.
const CONTACT_DISTANCE: f64 = 5e-3;

impl LoadedScene {
    /// Opens or encodes the geometries of the bodies, and builds the system.
    ///
    /// # Errors
    /// The first body or value at fault, with its line.
    pub fn system(&self) -> Result<System, SceneError> {
        self.system_watched(&Progress::default())
    }

    /// As [`system`](Self::system). Another thread can watch every encoding through `progress` and
    /// cancel it.
    ///
    /// # Errors
    /// The same errors as [`system`](Self::system), and [`SceneError::Cancelled`].
    pub fn system_watched(&self, progress: &Progress) -> Result<System, SceneError> {
        let scene = &self.scene;
        scene.steps().map_err(|e| self.value(e.key, e.reason))?;
        let gravity = DVec3::from_array(scene.gravity);
        if !gravity.is_finite() {
            return Err(self.value("gravity", format!("{gravity}; expected finite numbers, in m/s²")));
        }
        let mut system = System::new(gravity);
        let (mut shapes, mut names, mut first) = (Shapes::default(), BTreeSet::new(), None);
        for (k, body) in scene.bodies.iter().enumerate() {
            let at = |reason: String| self.body_error(k, reason);
            let section = body.get_ref();
            if !names.insert(&section.name) {
                return Err(at("the name is used twice; give each body its own".into()));
            }
            let shape = shapes.get(self, section, &mut system, progress).map_err(|e| match e {
                ShapeFailure::Cancelled => SceneError::Cancelled,
                ShapeFailure::Reason(reason) => at(reason),
            })?;
            if let Some(measure) = Measure::of(&system, section, shape) {
                measure.check(first.get_or_insert(measure)).map_err(at)?;
            }
            let mass = mass(&system, section, shape).map_err(at)?;
            let instance = instance(section, shape).map_err(at)?;
            let body = system
                .add(&section.name, instance, mass)
                .map_err(|e| self.body_error(k, instance_reason(e)))?;
            system
                .set_friction(body, section.friction)
                .and_then(|()| system.set_friction_torsional(body, section.friction_torsional))
                .and_then(|()| system.set_restitution(body, section.restitution))
                .and_then(|()| system.set_linear_damping(body, section.linear_damping))
                .and_then(|()| system.set_angular_damping(body, section.angular_damping))
                .map_err(|e| self.body_error(k, e.to_string()))?;
        }
        self.connect(&mut system)?;
        self.check_criteria(&system)?;
        Ok(system)
    }

    /// The built-in engine for the scene's system.
    ///
    /// # Errors
    /// [`SceneError::Value`] for a value of the sections `detector` or `solver` that is out of
    /// range.
    pub fn newton(&self, system: System) -> Result<Newton, SceneError> {
        self.newton_with(system, detect)
    }

    /// As [`newton`](Self::newton), with `detector` in place of [`tesdf::collide::detect`]. The
    /// mode `off` still turns detection off.
    ///
    /// # Errors
    /// The same errors as [`newton`](Self::newton).
    pub fn newton_with(&self, system: System, detector: impl Detect + 'static) -> Result<Newton, SceneError> {
        let collide = collide_options(&self.scene.detector, &system);
        collide.validate().map_err(|e| match e {
            CollideError::Option { option, found, expected } => {
                self.value(&format!("detector.{option}"), format!("{found}; expected {expected}"))
            }
            e => self.value("detector", e),
        })?;
        if let Some(Length::Absolute(length)) = collide.mode.faces().map(|faces| faces.tolerance) {
            let reason = format!("a length of {length} m; expected a fraction of the diagonal");
            return Err(self.value("detector.tolerance", reason));
        }
        let solver = self.scene.solver;
        match self.scene.detector.mode {
            None => Newton::new(system, Nothing, collide, solver),
            Some(_) => Newton::new(system, detector, collide, solver),
        }
        .map_err(|e| match e {
            DynamicsError::Option { option, found, expected } => {
                self.value(&format!("solver.{option}"), format!("{found}; expected {expected}"))
            }
            e => self.value("solver", e),
        })
    }

    /// How the scene detects contacts, as [`newton`](Self::newton) does but for the motion within a
    /// step; `None` in the mode `off`.
    pub fn detection(&self, system: &System) -> Option<CollideOptions> {
        let section = &self.scene.detector;
        section.mode.map(|_| collide_options(section, system))
    }

    /// Faces that touch in the states of `system`, and that the scene's mode, where it is `node`,
    /// can miss.
    ///
    /// # Errors
    /// The scene's options are not valid.
    pub fn coarse_contacts(&self, system: &System) -> Result<Vec<CoarseContact>, CollideError> {
        match self.scene.detector.mode {
            Some(Mode::Node) => {
                let options = collide_options(&self.scene.detector, system);
                let mut found = coarse_contacts(system.scene(), &options)?;
                // Bodies that are both fixed need no contacts.
                let is_free = |id| {
                    let body = system.body_of(id).map(|body| &system.bodies()[body]);
                    body.is_some_and(|body| matches!(body.mass, Mass::Free(_)))
                };
                found.retain(|c| is_free(c.instance_a) || is_free(c.instance_b));
                Ok(found)
            }
            _ => Ok(Vec::new()),
        }
    }

    fn body_error(&self, body: usize, reason: String) -> SceneError {
        self.error_at(&self.scene.bodies[body], reason)
    }
}

/// The detector of the mode `off`.
struct Nothing;

impl Detect for Nothing {
    fn detect(&self, _: &Scene, _: &CollideOptions) -> Result<Contacts, CollideError> {
        Ok(Contacts::default())
    }

    fn holds_all(&self, _: &CollideOptions) -> bool {
        false
    }
}

/// The detection options of a scene. In the mode `off`, they are those of the mode `node`.
fn collide_options(section: &DetectorSection, system: &System) -> CollideOptions {
    let contact_distance =
        section.contact_distance.unwrap_or_else(|| CONTACT_DISTANCE * smallest_free_body(system));
    CollideOptions {
        mode: section.mode.unwrap_or(Mode::Node),
        contact_distance,
        ..CollideOptions::for_simulation()
    }
}

/// Diagonal of the smallest free body that can meet others, m; 0 when there is none.
fn smallest_free_body(system: &System) -> f64 {
    let meets = |id| system.scene().instance(id).is_ok_and(|instance| instance.groups.filter != 0);
    let free = system.bodies().iter().filter(|body| body.mass != Mass::Fixed && meets(body.instance));
    free.filter_map(|body| system.diagonal(body).ok()).reduce(f64::min).unwrap_or(0.0)
}

/// What is wrong with a body of several geometries.
const SEVERAL: &str = "more than one of asset, mesh, shape and parts is given; keep one";

enum ShapeFailure {
    Cancelled,
    Reason(String),
}

/// The shapes of files, by path, what is inside and how the mesh is repaired: bodies share them.
#[derive(Default)]
struct Shapes(BTreeMap<(PathBuf, String), ShapeId>);

impl Shapes {
    fn get(
        &mut self,
        scene: &LoadedScene,
        body: &BodySection,
        system: &mut System,
        progress: &Progress,
    ) -> Result<ShapeId, ShapeFailure> {
        let inside = inside(body).map_err(ShapeFailure::Reason)?;
        let repair = repair(body).map_err(ShapeFailure::Reason)?;
        if !body.parts.is_empty() {
            if body.asset.is_some() || body.mesh.is_some() || body.shape.is_some() {
                return Err(ShapeFailure::Reason(SEVERAL.into()));
            }
            // The parts of two bodies are the same where their text is.
            let key = (PathBuf::new(), format!("{:?}, {repair:?}", body.parts));
            if let Some(&shape) = self.0.get(&key) {
                return Ok(shape);
            }
            let encoded = encode_parts(scene, body, repair, progress)?;
            let shape = add_shape(system, Shape::Mesh(Arc::new(encoded)))?;
            self.0.insert(key, shape);
            return Ok(shape);
        }
        let shape = match (&body.asset, &body.mesh, &body.shape) {
            (Some(file), None, None) | (None, Some(file), None) => {
                let in_memory = body.asset.as_ref().and_then(|path| scene.memory.get(path));
                let file = scene.resolve(file);
                // A file that is reached by several paths is opened only once.
                let path = file.canonicalize().unwrap_or_else(|_| file.clone());
                let key = (path, format!("{inside}, {repair:?}"));
                if let Some(&shape) = self.0.get(&key) {
                    return Ok(shape);
                }
                if in_memory.is_none() {
                    let refused = |e| ShapeFailure::Reason(format!("{}: {e}", file.display()));
                    input::check_regular(&file).map_err(refused)?;
                }
                let opened = match (in_memory, &body.asset) {
                    (Some(asset), _) => Arc::clone(asset),
                    (None, Some(_)) => TeSdf::open(&file)
                        .map(Arc::new)
                        .map_err(|e| ShapeFailure::Reason(format!("{}: {e}", file.display())))?,
                    (None, None) => {
                        let encode = || encode_mesh(&file, inside, repair, progress);
                        Arc::new(match &scene.assets {
                            Some(assets) => assets.get(&file, inside, repair, encode)?,
                            None => encode()?,
                        })
                    }
                };
                let shape = add_shape(system, Shape::Mesh(opened))?;
                self.0.insert(key, shape);
                return Ok(shape);
            }
            (None, None, Some(shape)) => shape.to_shape(),
            (None, None, None) => {
                return Err(ShapeFailure::Reason(
                    "it has no geometry; give asset = \"FILE.tesdf\", mesh = \"FILE\", a shape or parts"
                        .into(),
                ));
            }
            _ => return Err(ShapeFailure::Reason(SEVERAL.into())),
        };
        add_shape(system, shape)
    }
}

fn add_shape(system: &mut System, shape: Shape) -> Result<ShapeId, ShapeFailure> {
    system.add_shape(shape).map_err(|e| ShapeFailure::Reason(e.to_string()))
}

/// Whether the mesh of a body is repaired.
fn repair(body: &BodySection) -> Result<RepairMode, String> {
    let mode = body.repair.as_deref().map_or(Ok(RepairMode::Never), str::parse);
    let mode = mode.map_err(|e: UnknownRepair| e.to_string())?;
    let without_mesh = match body {
        _ if mode == RepairMode::Never || body.mesh.is_some() => return Ok(mode),
        BodySection { parts, .. } if parts.iter().any(|part| part.mesh.is_some()) => return Ok(mode),
        BodySection { asset: Some(_), .. } => {
            "the asset is encoded already; give mesh = \"FILE\" in place of asset"
        }
        BodySection { shape: Some(_), .. } => "a simple shape has no mesh to repair; remove repair",
        _ => return Ok(mode),
    };
    Err(format!("repair = \"auto\": {without_mesh}"))
}

/// What is inside of the mesh of a body.
fn inside(body: &BodySection) -> Result<Inside, String> {
    let BodySection { inside, thickness, surface, .. } = body;
    if body.mesh.is_none() && (inside.is_some() || thickness.is_some() || surface.is_some()) {
        return Err(
            "inside, thickness and surface are of a mesh that the scene encodes; an asset has its own".into(),
        );
    }
    let rule = inside.as_deref().map(str::parse).transpose();
    let choices = EncodeChoices {
        inside: rule
            .map_err(|e| format!("inside is {}; {e}", inside.as_deref().unwrap_or_default()))?
            .unwrap_or_default(),
        thickness: *thickness,
        surface: surface.unwrap_or_default(),
        ..EncodeChoices::default()
    };
    choices.inside().map_err(|e| e.to_string())
}

fn encode_mesh(
    file: &Path,
    inside: Inside,
    repair: RepairMode,
    progress: &Progress,
) -> Result<TeSdf, ShapeFailure> {
    let encoder = Encoder::new().preset(Preset::Fast).inside(inside).repair(repair).progress(progress);
    encoder.encode_file(file).map_err(|e| match e {
        EncodeFileError::Encode { source: EncodeError::Cancelled, .. } => ShapeFailure::Cancelled,
        e => ShapeFailure::Reason(e.to_string()),
    })
}

/// Encodes the parts of a body as one mesh.
fn encode_parts(
    scene: &LoadedScene,
    body: &BodySection,
    repair: RepairMode,
    progress: &Progress,
) -> Result<TeSdf, ShapeFailure> {
    let (mesh, inside) =
        joined(&|file| scene.resolve(file), &body.parts, repair).map_err(ShapeFailure::Reason)?;
    let encode = || {
        let solid = SolidMesh::with_repair(mesh.clone(), inside, RepairMode::Never);
        let solid = solid.map_err(|e| ShapeFailure::Reason(format!("the parts together: {e}")))?.0;
        let encoder = Encoder::new().preset(Preset::Fast).inside(inside).progress(progress);
        encoder.encode(&solid).map_err(|e| match e {
            EncodeError::Cancelled => ShapeFailure::Cancelled,
            e => ShapeFailure::Reason(e.to_string()),
        })
    };
    match &scene.assets {
        Some(assets) => assets.of_mesh(&body.name, &mesh, inside, encode),
        None => encode(),
    }
}

impl ShapeSection {
    fn to_shape(self) -> Shape {
        match self {
            Self::Plane => Shape::Plane,
            Self::Box { half_extents } => Shape::Box { half_extents: DVec3::from_array(half_extents) },
            Self::Sphere { radius } => Shape::Sphere { radius },
            Self::Capsule { half_height, radius } => Shape::Capsule { half_height, radius },
            Self::Cylinder { half_height, radius } => Shape::Cylinder { half_height, radius },
        }
    }
}

fn mass(system: &System, body: &BodySection, shape: ShapeId) -> Result<Mass, String> {
    let of_density = |density| {
        let shape = system.scene().shape(shape).map_err(|e| e.to_string())?;
        MassProperties::of_shape(shape, body.scale, density).map_err(|e| e.to_string())
    };
    let given = match (body.fixed, body.kinematic) {
        (true, true) => return Err("it is fixed and kinematic; keep one".into()),
        (true, false) => Some((Mass::Fixed, "fixed")),
        (false, true) => Some((Mass::Kinematic, "kinematic")),
        (false, false) => None,
    };
    let by_hand = body.center_of_mass.is_some() || body.inertia.is_some();
    if by_hand && (body.mass.is_none() || given.is_some()) {
        return Err("center_of_mass and inertia are of a free body with a mass".into());
    }
    Ok(match (given, body.density, body.mass) {
        (Some((mass, _)), _, None) => mass,
        (Some((_, word)), _, Some(_)) => {
            return Err(format!("it is {word}, so it needs no mass; take one of the two out"));
        }
        (None, Some(density), None) => Mass::Free(of_density(density)?),
        (None, None, Some(mass)) => Mass::Free(of_mass(body, mass, || of_density(1.0))?),
        (None, Some(_), Some(_)) => return Err("it has a density and a mass; keep one".into()),
        (None, None, None) => {
            return Err("it has neither density nor mass; give one, or fixed = true".into());
        }
    })
}

/// Mass properties of a body of this mass: what the scene does not give follows from the geometry.
fn of_mass(
    body: &BodySection,
    mass: f64,
    of_geometry: impl Fn() -> Result<MassProperties, String>,
) -> Result<MassProperties, String> {
    let of_geometry = || of_geometry()?.with_mass(mass).map_err(|e| e.to_string());
    let given = body.inertia.map(inertia_matrix);
    let (center, inertia) = match (body.center_of_mass, given) {
        (None, None) => return of_geometry(),
        (Some(center), Some(inertia)) => (DVec3::from_array(center), inertia),
        (Some(center), None) => (DVec3::from_array(center), of_geometry()?.inertia),
        (None, Some(inertia)) => (of_geometry()?.center, inertia),
    };
    MassProperties::new(mass, center, inertia).map_err(|e| e.to_string())
}

fn instance(body: &BodySection, shape: ShapeId) -> Result<Instance, String> {
    let rotation = DQuat::from_array(body.rotation);
    let pose = Pose::new(DVec3::from_array(body.translation), rotation).map_err(|e| e.to_string())?;
    let velocity = Velocity {
        linear: DVec3::from_array(body.velocity),
        angular: DVec3::from_array(body.angular_velocity),
    };
    let groups = Groups { memberships: body.memberships, filter: body.filter };
    Ok(Instance { velocity, scale: body.scale, groups, ..Instance::new(shape, pose) })
}

/// The reason alone: the caller's message already names the body.
fn instance_reason(error: CollideError) -> String {
    match error {
        CollideError::Instance { reason, .. } => reason,
        e => e.to_string(),
    }
}
