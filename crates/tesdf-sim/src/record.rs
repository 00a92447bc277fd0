//! Run files: a safetensors file of a complete run, and a [journal](RunJournal) of a run that still
//! grows.
//!
//! A complete run has these tensors:
//!
//! | tensor | type | content |
//! |---|---|---|
//! | `times` | `f64 [S + 1]` | s; the first value is the beginning of the run |
//! | `poses` | `f64 [S + 1, B, 7]` | pose of each body's frame: x y z in m, quaternion x y z w |
//! | `velocities` | `f64 [S + 1, B, 6]` | of the centre of mass, m/s; angular, rad/s |
//! | `contacts.steps` | `u64 [R]` | numbers of the steps with recorded contacts, from 0 |
//! | `contacts.starts` | `u64 [R + 1]` | index of the first contact of each of these steps |
//! | `contacts.points` | `f32 [C, 3]` | `point_a` of [`Contact`], m, world frame |
//! | `contacts.normals` | `f32 [C, 3]` | `normal` of [`Contact`], unit, world frame |
//! | `contacts.distances` | `f32 [C]` | signed distance, m |
//! | `contacts.ids` | `u32 [C, 4]` | body of the face, body of the field, face of a, face of b |
//! | `hidden.steps` | `u64 [H]` | steps with hidden overlaps: one row per step and pair |
//! | `hidden.ids` | `u32 [H, 2]` | the two bodies |
//! | `hidden.depths` | `f64 [H]` | lower bound of the depth, m |
//! | `forces.steps` | `u64 [Q]` | numbers of the steps with recorded forces, from 0 |
//! | `forces.ends` | `u64 [Q]` | where the contact forces of each of these steps end |
//! | `forces.ids` | `u32 [F, 2]` | bodies: the force acts on the first, its opposite on the second |
//! | `forces.points` | `f64 [F, 3]` | where it acts, m, world frame |
//! | `forces.contacts` | `f32 [F, 6]` | along the normal, and friction, N, world frame |
//! | `forces.torques` | `f32 [F]` | moment of torsional friction about the normal, N m |
//! | `forces.joints` | `f32 [Q · J, 8]` | on the child: force, N; torque, N m; what motor and couplings do |
//!
//! S is the number of steps, B of bodies, J of joints, R of steps with recorded contacts, C of
//! contacts, H of hidden overlaps, Q of steps with recorded forces, and F of contacts that push.
//! The contacts and hidden overlaps of a step are those at its beginning, that is, at
//! `poses[step]`. Its [forces](crate::Forces) are means from `poses[step]` to `poses[step + 1]`. An
//! overlap of two bodies is hidden when no contact shows it.
//!
//! A file without hidden overlaps has no `hidden.…` tensors, one without recorded forces no
//! `forces.…` tensors. A run has `forces.torques` where bodies have torsional friction: it has the
//! version 6, and others the version 5.
//!
//! The metadata has one key, `tesdf_run`. Its value is JSON with `version`, `bodies` and `joints`
//! (names), `scene` (the scene as JSON) and `folder`, the folder that the scene's paths are
//! relative to. A run that was saved before its end also has `planned`, its planned number of
//! steps. A run that did not do all that its scene asks has `warnings`: at most one [`Warning`] of
//! each kind, with the keys `kind`, `names`, `time` (of the first, s), `value` (the worst), `count`
//! and `message`. Those of the kind `hidden` are not among them: they follow from the `hidden.…`
//! tensors.
//!
//! A run grows as a journal of steps under its final name. At the end the complete file replaces
//! the journal. [`RunRecord::open`] reads both. [`InterruptedRun`] reads a journal to resume the
//! run; the resumed run ends with the same bytes as an uninterrupted run.
mod forces;
mod hidden;
mod journal;
mod origin;
mod resume;
mod told;

use std::collections::{HashMap, TryReserveError};
use std::ops::Range;
use std::path::{Path, PathBuf};

use safetensors::tensor::{Dtype, SafeTensorError, SafeTensors, TensorView, serialize};
use serde::{Deserialize, Serialize};
use tesdf::collide::{Contact, Pose};
use tesdf::glam::{DQuat, DVec3};
use tesdf::input;
use tesdf::save::{SaveError, save_atomic};

use crate::{State, System, Warning};

use forces::ForceRows;
pub use hidden::HiddenPair;
pub(crate) use hidden::HiddenPairs;
use hidden::HiddenRows;
pub use journal::{InterruptedRun, RunJournal};
pub use origin::RunOrigin;

/// The latest version of complete runs and journals that this build writes and reads: that of runs
/// with torsional friction.
pub const RUN_VERSION: u32 = 6;
/// The version of runs without torsional friction, which this build writes and reads, too.
pub const RUN_VERSION_WITHOUT_TORQUES: u32 = 5;
const KEY: &str = "tesdf_run";

/// States of all bodies over time, and the contacts and forces of some steps.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RunRecord {
    /// Names of the bodies.
    pub bodies: Vec<String>,
    /// Names of the joints.
    pub joints: Vec<String>,
    /// The scene, as JSON.
    pub scene: serde_json::Value,
    /// The folder that the scene's paths are relative to. Empty: the current folder of the reader.
    pub folder: String,
    /// Planned number of steps; `None` when the run is complete.
    planned: Option<u64>,
    times: Vec<f64>,
    poses: Vec<[f64; 7]>,
    velocities: Vec<[f64; 6]>,
    contact_steps: Vec<u64>,
    contact_starts: Vec<u64>,
    points: Vec<[f32; 3]>,
    normals: Vec<[f32; 3]>,
    distances: Vec<f32>,
    ids: Vec<[u32; 4]>,
    hidden: HiddenRows,
    forces: ForceRows,
    /// Whether contacts may have torques: the run has the version of these.
    has_torques: bool,
    /// Warnings, without those of hidden overlaps.
    told: Vec<Warning>,
}

/// A contact as a run file stores it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RecordedContact {
    /// `point_a` of the contact, m, world frame.
    pub point: [f32; 3],
    /// Unit normal from b to a, world frame.
    pub normal: [f32; 3],
    /// Signed distance, m.
    pub distance: f32,
    /// The body of the face and the body of the field.
    pub bodies: [u32; 2],
    /// The face of a and the face of b.
    pub faces: [u32; 2],
}

/// Why a run file cannot be written or read.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum RecordError {
    /// An error while the file was written.
    #[error(transparent)]
    Save(#[from] SaveError),
    /// The file cannot be read.
    #[error("cannot read {}: {source}", .path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// Error of the operating system.
        source: std::io::Error,
    },
    /// The file is not a safetensors file.
    #[error("not a run of tesdf: no safetensors file: {0}; `tesdf simulate` writes runs")]
    Container(#[from] SafeTensorError),
    /// The file is not a run.
    #[error("not a run of tesdf: {0}; `tesdf simulate` writes runs")]
    NotARun(String),
    /// The file has another format version.
    #[error(
        "the run has version {found}; this build reads {RUN_VERSION_WITHOUT_TORQUES} and {reads}: simulate the scene again"
    )]
    Version {
        /// The version in the file.
        found: u32,
        /// The latest one that this build reads.
        reads: u32,
    },
    /// The run is complete, so there is nothing to resume.
    #[error("the run is complete: it has all of its {steps} steps")]
    Complete {
        /// Number of steps of the run.
        steps: u64,
    },
    /// The scene or the environment differs from that of the run, so a resumed run would not give
    /// the bits of an uninterrupted run.
    #[error("{what} is {found}, but the run was made with {expected}")]
    Differs {
        /// A key of the scene, or `version` or `device`.
        what: String,
        /// The current value.
        found: String,
        /// The value when the run began.
        expected: String,
    },
    /// The geometry of a body has changed.
    #[error("the geometry of body {body} is not the one that the run was made with")]
    Geometry {
        /// Name of the body.
        body: String,
    },
}

#[derive(Serialize, Deserialize)]
struct About {
    version: u32,
    bodies: Vec<String>,
    joints: Vec<String>,
    scene: serde_json::Value,
    #[serde(default)]
    folder: String,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    planned: Option<u64>,
    /// Without those of hidden overlaps.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    warnings: Vec<Warning>,
}

impl RunRecord {
    /// A record that begins with the state of `system` at time 0.
    pub fn new(system: &System, scene: serde_json::Value) -> Self {
        let bodies = system.bodies().iter().map(|body| body.name.clone()).collect();
        let joints = system.joints().iter().map(|joint| joint.name.clone()).collect();
        let has_torques = system.has_friction_torsional();
        let mut record =
            Self { bodies, joints, scene, contact_starts: vec![0], has_torques, ..Self::default() };
        record.push(0.0, system);
        record
    }

    /// An empty record, without the state at the beginning.
    ///
    /// # Errors
    /// [`RecordError::Version`], or a warning that cannot be.
    fn of_about(about: About) -> Result<Self, RecordError> {
        let About { version, bodies, joints, scene, folder, planned, warnings } = about;
        let has_torques = has_torques(version)?;
        told::check(&warnings, &bodies).map_err(|e| RecordError::NotARun(format!("{KEY}: {e}")))?;
        let contact_starts = vec![0];
        let told = warnings;
        Ok(Self {
            bodies,
            joints,
            scene,
            folder,
            planned,
            contact_starts,
            has_torques,
            told,
            ..Self::default()
        })
    }

    fn version(&self) -> u32 {
        if self.has_torques { RUN_VERSION } else { RUN_VERSION_WITHOUT_TORQUES }
    }

    fn about(&self) -> About {
        About {
            version: self.version(),
            bodies: self.bodies.clone(),
            joints: self.joints.clone(),
            scene: self.scene.clone(),
            folder: self.folder.clone(),
            planned: self.planned,
            warnings: self.told.clone(),
        }
    }

    /// Number of steps in the record.
    pub fn steps(&self) -> u64 {
        self.times.len().saturating_sub(1) as u64
    }

    /// Planned number of steps of a run that was interrupted or still grows; `None` for a complete
    /// run.
    pub fn planned_steps(&self) -> Option<u64> {
        self.planned
    }

    /// Reserves memory for the states of a run of `steps` steps.
    pub(crate) fn reserve(&mut self, steps: u64) -> Result<(), TryReserveError> {
        let more = usize::try_from(steps.saturating_sub(self.steps())).unwrap_or(usize::MAX);
        let states = more.saturating_mul(self.bodies.len());
        self.times.try_reserve_exact(more)?;
        self.poses.try_reserve_exact(states)?;
        self.velocities.try_reserve_exact(states)
    }

    /// Sets the planned number of steps; `None` marks the run as complete.
    pub(crate) fn plan(&mut self, steps: Option<u64>) {
        self.planned = steps;
    }

    /// The states of all bodies after `step` steps, bit for bit. `None` when the record ends
    /// earlier.
    pub fn states(&self, step: usize) -> Option<Vec<State>> {
        let state = |body| {
            let [linear, angular] = self.velocity(step, body)?;
            Some(State { pose: self.pose(step, body)?, linear, angular })
        };
        (0..self.bodies.len()).map(state).collect()
    }

    /// Appends the state of `system` at `time` seconds.
    pub fn push(&mut self, time: f64, system: &System) {
        self.times.push(time);
        for State { pose, linear, angular } in system.states() {
            let [x, y, z] = pose.translation.to_array();
            let [i, j, k, w] = pose.rotation.to_array();
            self.poses.push([x, y, z, i, j, k, w]);
            let ([x, y, z], [i, j, k]) = (linear.to_array(), angular.to_array());
            self.velocities.push([x, y, z, i, j, k]);
        }
    }

    /// Appends the contacts at the beginning of `step`. The steps of successive calls must ascend.
    pub fn push_contacts(&mut self, step: u64, contacts: &[Contact], system: &System) {
        let body = |instance| system.body_of(instance).map_or(u32::MAX, |body| body as u32);
        self.contact_steps.push(step);
        for contact in contacts {
            self.points.push(contact.point_a.as_vec3().to_array());
            self.normals.push(contact.normal.as_vec3().to_array());
            self.distances.push(contact.distance as f32);
            let bodies = [body(contact.instance_a), body(contact.instance_b)];
            self.ids.push([bodies[0], bodies[1], contact.face_a, contact.face_b]);
        }
        self.contact_starts.push(self.distances.len() as u64);
    }

    /// Time of each state, s.
    pub fn times(&self) -> &[f64] {
        &self.times
    }

    /// Number of the step whose time is nearest to `time`; the earlier step of a tie.
    pub fn nearest_step(&self, time: f64) -> Option<usize> {
        nearest(0..self.times.len(), |step| self.times[step], time)
    }

    /// As [`nearest_step`](Self::nearest_step), but only among steps with recorded contacts.
    pub fn nearest_contacts(&self, time: f64) -> Option<usize> {
        let kept =
            self.contact_steps.iter().map(|&step| step as usize).filter(|&step| step < self.times.len());
        nearest(kept, |step| self.times[step], time)
    }

    /// Pose of a body after `step` steps, in the world frame.
    pub fn pose(&self, step: usize, body: usize) -> Option<Pose> {
        let at = (body < self.bodies.len()).then(|| step * self.bodies.len() + body)?;
        let [x, y, z, i, j, k, w] = *self.poses.get(at)?;
        Some(Pose { translation: DVec3::new(x, y, z), rotation: DQuat::from_xyzw(i, j, k, w) })
    }

    /// Velocity of a body's centre of mass, m/s, and its angular velocity, rad/s, after `step`
    /// steps.
    pub fn velocity(&self, step: usize, body: usize) -> Option<[DVec3; 2]> {
        let at = (body < self.bodies.len()).then(|| step * self.bodies.len() + body)?;
        let [x, y, z, i, j, k] = *self.velocities.get(at)?;
        Some([DVec3::new(x, y, z), DVec3::new(i, j, k)])
    }

    /// The steps with recorded contacts, in order.
    pub fn contact_steps(&self) -> &[u64] {
        &self.contact_steps
    }

    /// The steps with recorded contacts, each with its contacts.
    pub fn contacts(&self) -> impl Iterator<Item = (u64, Vec<RecordedContact>)> {
        let contact = |k: usize| RecordedContact {
            point: self.points[k],
            normal: self.normals[k],
            distance: self.distances[k],
            bodies: [self.ids[k][0], self.ids[k][1]],
            faces: [self.ids[k][2], self.ids[k][3]],
        };
        self.contact_steps
            .iter()
            .zip(self.contact_starts.windows(2))
            .map(move |(&step, range)| (step, (range[0] as usize..range[1] as usize).map(contact).collect()))
    }

    /// Indices of the contacts of `step`, if they are recorded.
    fn contact_range(&self, step: u64) -> Option<Range<usize>> {
        let at = self.contact_steps.binary_search(&step).ok()?;
        Some(self.contact_starts[at] as usize..self.contact_starts[at + 1] as usize)
    }

    /// The bytes of the run file. Equal records give equal bytes.
    ///
    /// # Errors
    /// The metadata is larger than safetensors allows.
    pub fn to_bytes(&self) -> Result<Vec<u8>, RecordError> {
        let about = serde_json::to_string(&self.about()).map_err(|e| RecordError::NotARun(e.to_string()))?;
        // There is only one key: safetensors keeps metadata in a hash map, so the order of several
        // keys would vary.
        let metadata = HashMap::from([(KEY.to_string(), about)]);
        let (states, bodies) = (self.times.len(), self.bodies.len());
        let contacts = self.distances.len();
        let mut tensors = vec![
            tensor("times", Dtype::F64, vec![states], &self.times)?,
            tensor("poses", Dtype::F64, vec![states, bodies, 7], self.poses.as_flattened())?,
            tensor("velocities", Dtype::F64, vec![states, bodies, 6], self.velocities.as_flattened())?,
            tensor("contacts.steps", Dtype::U64, vec![self.contact_steps.len()], &self.contact_steps)?,
            tensor("contacts.starts", Dtype::U64, vec![self.contact_starts.len()], &self.contact_starts)?,
            tensor("contacts.points", Dtype::F32, vec![contacts, 3], self.points.as_flattened())?,
            tensor("contacts.normals", Dtype::F32, vec![contacts, 3], self.normals.as_flattened())?,
            tensor("contacts.distances", Dtype::F32, vec![contacts], &self.distances)?,
            tensor("contacts.ids", Dtype::U32, vec![contacts, 4], self.ids.as_flattened())?,
        ];
        let HiddenRows { steps, ids, depths } = &self.hidden;
        if !steps.is_empty() {
            tensors.push(tensor("hidden.steps", Dtype::U64, vec![steps.len()], steps)?);
            tensors.push(tensor("hidden.ids", Dtype::U32, vec![ids.len(), 2], ids.as_flattened())?);
            tensors.push(tensor("hidden.depths", Dtype::F64, vec![depths.len()], depths)?);
        }
        let ForceRows { steps, ends, ids, points, contacts, torques, joints } = &self.forces;
        if !steps.is_empty() {
            tensors.push(tensor("forces.steps", Dtype::U64, vec![steps.len()], steps)?);
            tensors.push(tensor("forces.ends", Dtype::U64, vec![ends.len()], ends)?);
            tensors.push(tensor("forces.ids", Dtype::U32, vec![ids.len(), 2], ids.as_flattened())?);
            tensors.push(tensor("forces.points", Dtype::F64, vec![ids.len(), 3], points.as_flattened())?);
            tensors.push(tensor("forces.contacts", Dtype::F32, vec![ids.len(), 6], contacts.as_flattened())?);
            if self.has_torques {
                tensors.push(tensor("forces.torques", Dtype::F32, vec![torques.len()], torques)?);
            }
            tensors.push(tensor("forces.joints", Dtype::F32, vec![joints.len(), 8], joints.as_flattened())?);
        }
        Ok(serialize(tensors, Some(metadata))?)
    }

    /// Writes the file completely or not at all.
    ///
    /// # Errors
    /// [`RecordError::Save`], and the errors of [`to_bytes`](Self::to_bytes).
    pub fn save(&self, path: impl AsRef<Path>) -> Result<(), RecordError> {
        Ok(save_atomic(path, &self.to_bytes()?)?)
    }

    /// Reads a run file or a journal.
    ///
    /// # Errors
    /// [`RecordError::Read`], and the errors of [`from_bytes`](Self::from_bytes).
    pub fn open(path: impl AsRef<Path>) -> Result<Self, RecordError> {
        Self::from_bytes(&read(path.as_ref())?)
    }

    /// The record that the bytes of a run file hold. A journal is read up to its last complete
    /// step.
    ///
    /// # Errors
    /// The bytes are not a run, have another version, or have tensors whose shapes do not match.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, RecordError> {
        if journal::is_journal(bytes) {
            return Ok(InterruptedRun::from_bytes(bytes.to_vec())?.run.record);
        }
        let (_, header) = SafeTensors::read_metadata(bytes)?;
        let about = header.metadata().as_ref().and_then(|m| m.get(KEY));
        let about = about.ok_or_else(|| RecordError::NotARun(format!("the metadata has no {KEY}")))?;
        let about: About =
            serde_json::from_str(about).map_err(|e| RecordError::NotARun(format!("{KEY}: {e}")))?;
        let empty = Self::of_about(about)?;
        let file = SafeTensors::deserialize(bytes)?;
        let count = empty.bodies.len();
        let times: Vec<f64> = values(&file, "times", Dtype::F64, &[])?;
        let hidden = match file.tensor("hidden.steps") {
            Ok(_) => HiddenRows {
                steps: values(&file, "hidden.steps", Dtype::U64, &[])?,
                ids: values(&file, "hidden.ids", Dtype::U32, &[2])?,
                depths: values(&file, "hidden.depths", Dtype::F64, &[])?,
            },
            Err(_) => HiddenRows::default(),
        };
        let forces = match file.tensor("forces.steps") {
            Ok(_) => ForceRows {
                steps: values(&file, "forces.steps", Dtype::U64, &[])?,
                ends: values(&file, "forces.ends", Dtype::U64, &[])?,
                ids: values(&file, "forces.ids", Dtype::U32, &[2])?,
                points: values(&file, "forces.points", Dtype::F64, &[3])?,
                contacts: values(&file, "forces.contacts", Dtype::F32, &[6])?,
                torques: match empty.has_torques {
                    true => values(&file, "forces.torques", Dtype::F32, &[])?,
                    false => vec![0.0; file.tensor("forces.ids")?.shape().first().copied().unwrap_or(0)],
                },
                joints: values(&file, "forces.joints", Dtype::F32, &[8])?,
            },
            Err(_) => ForceRows::default(),
        };
        let record = Self {
            poses: values(&file, "poses", Dtype::F64, &[count, 7])?,
            velocities: values(&file, "velocities", Dtype::F64, &[count, 6])?,
            contact_steps: values(&file, "contacts.steps", Dtype::U64, &[])?,
            contact_starts: values(&file, "contacts.starts", Dtype::U64, &[])?,
            points: values(&file, "contacts.points", Dtype::F32, &[3])?,
            normals: values(&file, "contacts.normals", Dtype::F32, &[3])?,
            distances: values(&file, "contacts.distances", Dtype::F32, &[])?,
            ids: values(&file, "contacts.ids", Dtype::U32, &[4])?,
            hidden,
            forces,
            times,
            ..empty
        };
        record.check()?;
        Ok(record)
    }

    fn check(&self) -> Result<(), RecordError> {
        let states = self.times.len() * self.bodies.len();
        let contacts = self.distances.len();
        let starts = &self.contact_starts;
        let fits = self.poses.len() == states
            && self.velocities.len() == states
            && [self.points.len(), self.normals.len(), self.ids.len()] == [contacts; 3]
            && starts.len() == self.contact_steps.len() + 1
            && starts.first() == Some(&0)
            && starts.last() == Some(&(contacts as u64))
            && starts.is_sorted()
            && self.contact_steps.is_sorted_by(|a, b| a < b)
            && self.hidden.fit(self.times.len() as u64, self.bodies.len())
            && self.forces.fit(self.times.len() as u64, self.bodies.len(), self.joints.len());
        if fits {
            return Ok(());
        }
        Err(RecordError::NotARun(
            "the shapes of its tensors do not match: it was damaged or made by hand".into(),
        ))
    }
}

/// Whether runs of this version have torques.
fn has_torques(version: u32) -> Result<bool, RecordError> {
    match version {
        RUN_VERSION => Ok(true),
        RUN_VERSION_WITHOUT_TORQUES => Ok(false),
        found => Err(RecordError::Version { found, reads: RUN_VERSION }),
    }
}

fn read(path: &Path) -> Result<Vec<u8>, RecordError> {
    input::read(path).map_err(|source| RecordError::Read { path: path.to_path_buf(), source })
}

fn nearest(steps: impl Iterator<Item = usize>, at: impl Fn(usize) -> f64, time: f64) -> Option<usize> {
    let distance = |&step: &usize| (at(step) - time).abs();
    steps.min_by(|a, b| distance(a).total_cmp(&distance(b)))
}

fn tensor<'a, T: bytemuck::Pod>(
    name: &'static str,
    dtype: Dtype,
    shape: Vec<usize>,
    values: &'a [T],
) -> Result<(&'static str, TensorView<'a>), RecordError> {
    Ok((name, TensorView::new(dtype, shape, bytemuck::cast_slice(values))?))
}

/// The rows of a tensor of shape `[n, row…]`. They are copied because the tensors of a file may be
/// unaligned.
fn values<T: bytemuck::AnyBitPattern>(
    file: &SafeTensors<'_>,
    name: &str,
    dtype: Dtype,
    row: &[usize],
) -> Result<Vec<T>, RecordError> {
    let tensor = file.tensor(name)?;
    match tensor.shape().split_first() {
        Some((_, found)) if found == row && tensor.dtype() == dtype => {
            Ok(tensor.data().chunks_exact(size_of::<T>()).map(bytemuck::pod_read_unaligned).collect())
        }
        _ => Err(RecordError::NotARun(format!(
            "{name} is {:?} {:?}; expected {dtype:?} [n, {row:?}]",
            tensor.dtype(),
            tensor.shape()
        ))),
    }
}
