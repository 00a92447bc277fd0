use std::collections::BTreeMap;
use std::sync::Arc;

use tesdf::collide::{Placement, Pose, Shape};
use tesdf::geometry::Aabb;
use tesdf::glam::DVec3;
use tesdf_sim::{RunRecord, System};

use crate::mesh::Mesh;
use crate::{Frames, Linear, PlaybackError, linear, of_body, simple};

/// Bodies count for the bounds of a run within this many extents of the bounds at its beginning: a
/// body that falls out of the scene would make all others tiny.
const KEPT: f64 = 1.5;
/// Coordinates must stay below this value, far from the end of the range of 32-bit floats.
const MOST: f64 = 1e30;

/// A recorded run with what is drawn of it: chosen steps, and the meshes of its bodies.
#[derive(Debug)]
pub struct Playback<'a> {
    pub(crate) record: &'a RunRecord,
    /// Numbers of the played steps, ascending.
    pub steps: Vec<usize>,
    /// Time of each of these steps, s.
    pub times: Vec<f64>,
    /// The middle of the run, m, world frame. Positions are stored relative to it, so that a run
    /// far from the origin keeps its precision. Its coordinates are decimals with as few digits as
    /// a 32-bit float needs: a file has them as such, and a reader in 64 bits finds them exactly.
    pub centre: DVec3,
    /// Bounds of the bodies except planes, m, world frame, over the whole run. What moves farther
    /// than 1.5 extents beyond the bounds at the beginning is not in them.
    pub bounds: Aabb,
    /// The distinct meshes. Bodies of the same shape share one.
    pub meshes: Vec<Mesh>,
    /// The bodies, in their order in the run.
    pub bodies: Vec<DrawnBody>,
}

/// A body of a run.
#[derive(Clone, Debug, PartialEq)]
pub struct DrawnBody {
    /// Its name.
    pub name: String,
    /// What is drawn.
    pub part: Part,
    /// Metres per unit of its shape.
    pub scale: f64,
    /// Its colour.
    pub colour: Linear,
}

/// What is drawn of a body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Part {
    /// A mesh of [`Playback::meshes`].
    Mesh(usize),
    /// A floor: the plane z = 0 of the body's frame, which is drawn around this point of it, m.
    Floor(DVec3),
}

impl<'a> Playback<'a> {
    /// The run `record`, whose bodies are those of `system`.
    ///
    /// # Errors
    /// [`PlaybackError`]: the run has no states, its bodies are not those of the system, a state is
    /// not valid, or the rate of `frames` is not positive.
    pub fn new(record: &'a RunRecord, system: &System, frames: Frames) -> Result<Self, PlaybackError> {
        let steps = frames.steps(record.times())?;
        if record.bodies.len() != system.bodies().len() {
            let (found, expected) = (record.bodies.len(), system.bodies().len());
            return Err(PlaybackError::Bodies { found, expected });
        }
        let times = steps.iter().map(|&step| record.times()[step]).collect();
        let mut run = Self {
            record,
            steps,
            times,
            centre: DVec3::ZERO,
            bounds: Aabb::EMPTY,
            meshes: Vec::new(),
            bodies: Vec::new(),
        };
        let mut known: BTreeMap<(u8, [u64; 3]), usize> = BTreeMap::new();
        let mut shapes = Vec::new();
        // Planes are grey and do not use up a colour of the palette.
        let mut colours = (0..).map(of_body);
        for body in system.bodies() {
            let instance = system.scene().instance(body.instance)?;
            let shape = system.scene().shape(instance.shape)?;
            let (part, colour) = match shape {
                Shape::Plane => (Part::Floor(DVec3::ZERO), linear([225; 3])),
                _ => {
                    let mesh = *known.entry(key(shape)).or_insert_with(|| {
                        run.meshes.push(mesh_of(shape));
                        run.meshes.len() - 1
                    });
                    (Part::Mesh(mesh), colours.next().unwrap_or_default())
                }
            };
            shapes.push(shape);
            run.bodies.push(DrawnBody { name: body.name.clone(), part, scale: instance.scale, colour });
        }
        run.bounds = run.find_bounds(&shapes)?;
        run.centre = run.bounds.center().map(shortest);
        for body in 0..run.bodies.len() {
            if let Part::Floor(at) = &mut run.bodies[body].part {
                let pose = pose(record, 0, body)?;
                *at = pose.to_body(run.centre) * DVec3::new(1.0, 1.0, 0.0);
            }
        }
        Ok(run)
    }

    /// Diagonal of the [`bounds`](Self::bounds), m; 1 if there are only planes.
    pub fn diagonal(&self) -> f64 {
        match self.bounds.extent().length() {
            diagonal if diagonal > 0.0 && diagonal.is_finite() => diagonal,
            _ => 1.0,
        }
    }

    /// Poses of the origin of a body's mesh, or of the middle of its floor, in each frame.
    /// Positions are relative to the [`centre`](Self::centre). Quaternions follow each other
    /// without a jump to their opposite.
    ///
    /// # Errors
    /// [`PlaybackError::State`], with the step and the body.
    pub fn track(&self, body: usize) -> Result<Vec<Pose>, PlaybackError> {
        let mut track: Vec<Pose> = Vec::with_capacity(self.steps.len());
        let origin = self.origin(body);
        for &step in &self.steps {
            let mut pose = pose(self.record, step, body)?;
            pose.translation = pose.to_world(origin) - self.centre;
            if pose.translation.abs().max_element() > MOST {
                return Err(self.state(step, body, format!("it is {} m away", pose.translation.length())));
            }
            if track.last().is_some_and(|before| before.rotation.dot(pose.rotation) < 0.0) {
                pose.rotation = -pose.rotation;
            }
            track.push(pose);
        }
        Ok(track)
    }

    /// The origin of a body's mesh, or the middle of its floor, in the body's frame, m.
    pub(crate) fn origin(&self, body: usize) -> DVec3 {
        let drawn = &self.bodies[body];
        match drawn.part {
            Part::Mesh(mesh) => self.meshes[mesh].middle * drawn.scale,
            Part::Floor(at) => at,
        }
    }

    fn state(&self, step: usize, body: usize, reason: String) -> PlaybackError {
        PlaybackError::State { body: self.bodies[body].name.clone(), step, reason }
    }

    /// Bounds of all bodies except planes over the frames.
    fn find_bounds(&self, shapes: &[&Shape]) -> Result<Aabb, PlaybackError> {
        let mut all = Aabb::EMPTY;
        let mut kept = None;
        for &step in &self.steps {
            let mut now = Aabb::EMPTY;
            for (body, shape) in shapes.iter().enumerate() {
                let pose = pose(self.record, step, body)?;
                if !matches!(shape, Shape::Plane) {
                    let placement = Placement { pose, scale: self.bodies[body].scale };
                    let bounds = placement.bounds(shape.bounds());
                    let is_kept = kept.is_none_or(|kept: Aabb| kept.contains(bounds.center()));
                    now = if is_kept { now.union(bounds) } else { now };
                }
            }
            all = all.union(now);
            kept.get_or_insert(now.grown(KEPT * now.extent().max_element()));
        }
        if !all.min.is_finite() || !all.max.is_finite() || all.extent().abs().max_element() > MOST {
            // There are only planes, or the bounds overflow; the latter is an error of a state.
            return Ok(Aabb { min: DVec3::splat(-0.5), max: DVec3::splat(0.5) });
        }
        Ok(all)
    }
}

/// A pose of the record, checked: a run file may have been made by hand.
pub(crate) fn pose(record: &RunRecord, step: usize, body: usize) -> Result<Pose, PlaybackError> {
    let failure = |reason: String| {
        let body = record.bodies.get(body).cloned().unwrap_or_default();
        PlaybackError::State { body, step, reason }
    };
    let pose = record.pose(step, body).ok_or_else(|| failure("it is missing".into()))?;
    checked(pose).map_err(failure)
}

/// A pose that can be drawn, or why it cannot.
pub(crate) fn checked(pose: Pose) -> Result<Pose, String> {
    let pose = Pose::new(pose.translation, pose.rotation).map_err(|e| e.to_string())?;
    match pose.translation.abs().max_element() > MOST {
        true => Err(format!("it is {} m away", pose.translation.length())),
        false => Ok(pose),
    }
}

/// Equal for shapes that can share a mesh.
fn key(shape: &Shape) -> (u8, [u64; 3]) {
    match *shape {
        Shape::Mesh(ref asset) => (0, [Arc::as_ptr(asset) as usize as u64, 0, 0]),
        Shape::Plane => (1, [0; 3]),
        Shape::Box { half_extents } => (2, half_extents.to_array().map(f64::to_bits)),
        Shape::Sphere { radius } => (3, [radius.to_bits(), 0, 0]),
        Shape::Capsule { half_height, radius } => (4, [half_height.to_bits(), radius.to_bits(), 0]),
        Shape::Cylinder { half_height, radius } => (5, [half_height.to_bits(), radius.to_bits(), 0]),
    }
}

/// The shortest decimal that the nearest 32-bit float is read from.
fn shortest(x: f64) -> f64 {
    (x as f32).to_string().parse().unwrap_or(x)
}

fn mesh_of(shape: &Shape) -> Mesh {
    match shape {
        Shape::Mesh(asset) => Mesh::of_asset(asset),
        Shape::Box { half_extents } => simple::cuboid(*half_extents),
        Shape::Sphere { radius } => simple::capsule(0.0, *radius),
        Shape::Capsule { half_height, radius } => simple::capsule(*half_height, *radius),
        Shape::Cylinder { half_height, radius } => simple::cylinder(*half_height, *radius),
        Shape::Plane => Mesh::default(),
    }
}
