//! Runs as files: safetensors when the run is complete, a [journal](RunJournal) as long as it grows.
//!
//! A complete run:
//!
//! | tensor | type | content |
//! |---|---|---|
//! | `times` | `f64 [S + 1]` | s; the first is the beginning |
//! | `poses` | `f64 [S + 1, B, 7]` | of each body's frame: translation, quaternion x y z w |
//! | `velocities` | `f64 [S + 1, B, 6]` | of the centre of mass, then angular |
//! | `contacts.steps` | `u64 [R]` | the steps whose contacts are kept, from 0; the contacts are those at its beginning, `poses[step]` |
//! | `contacts.starts` | `u64 [R + 1]` | where the contacts of each of them begin |
//! | `contacts.points`, `contacts.normals` | `f32 [C, 3]` | `point_a` and `normal` of [`Contact`], world |
//! | `contacts.distances` | `f32 [C]` | signed distance |
//! | `contacts.ids` | `u32 [C, 4]` | body of the face, body of the field, face of a, face of b |
//! | `hidden.steps` | `u64 [H]` | a row for each step and pair of bodies that overlapped at its beginning although no contact showed it |
//! | `hidden.ids` | `u32 [H, 2]` | the bodies |
//! | `hidden.depths` | `f64 [H]` | how deep, at least, m |
//!
//! The tensors `hidden.…` are left out when they have no rows.
//!
//! The metadata has one key, `tesdf_run`: JSON with `version`, `bodies` (names), `scene` (the scene as JSON), and `folder`, which the
//! scene's paths are relative to.
//!
//! A run grows as a journal of steps under its final name, and the complete file replaces the journal at the end. [`RunRecord::open`] reads both;
//! [`CutRun`] reads a journal so that the run goes on to the same bytes.
mod hidden;
mod journal;
mod origin;

use std::collections::{HashMap, TryReserveError};
use std::ops::Range;
use std::path::{Path, PathBuf};

use safetensors::tensor::{Dtype, SafeTensorError, SafeTensors, TensorView, serialize};
use serde::{Deserialize, Serialize};
use tesdf::collide::{Contact, Pose};
use tesdf::glam::{DQuat, DVec3};
use tesdf::input;
use tesdf::save::{SaveError, save_atomic};

use crate::{State, System};

pub use hidden::HiddenPair;
use hidden::HiddenRows;
pub use journal::{CutRun, RunJournal};
pub use origin::RunOrigin;

/// The version that is written and read.
pub const RUN_VERSION: u32 = 1;
const KEY: &str = "tesdf_run";

/// States of all bodies over time, and contacts of some steps.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RunRecord {
    /// Names of the bodies.
    pub bodies: Vec<String>,
    /// The scene as JSON.
    pub scene: serde_json::Value,
    /// What the scene's paths are relative to; empty: the folder of whoever reads.
    pub folder: String,
    /// Steps that the run was to have; `None`: it has them.
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
}

/// A contact as it is kept.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RecordedContact {
    /// World.
    pub point: [f32; 3],
    /// World, from b to a.
    pub normal: [f32; 3],
    /// Signed.
    pub distance: f32,
    /// The body whose face it is, and the body whose field it is.
    pub bodies: [u32; 2],
    /// Face of a, face of b.
    pub faces: [u32; 2],
}

/// Why a run file cannot be written or read.
#[derive(Debug, thiserror::Error)]
pub enum RecordError {
    /// The file cannot be written.
    #[error(transparent)]
    Save(#[from] SaveError),
    /// The operating system.
    #[error("cannot read {}: {source}", .path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// What it said.
        source: std::io::Error,
    },
    /// No safetensors file.
    #[error("not a run of tesdf: no safetensors file: {0}; `tesdf simulate` writes runs")]
    Container(#[from] SafeTensorError),
    /// No run.
    #[error("not a run of tesdf: {0}; `tesdf simulate` writes runs")]
    NotARun(String),
    /// Another version.
    #[error("the run has version {found}; this build reads {RUN_VERSION}: simulate the scene again")]
    Version {
        /// The version in the file.
        found: u32,
    },
    /// Nothing is left to do.
    #[error("the run is complete: it has all of its {steps} steps")]
    Complete {
        /// Its steps.
        steps: u64,
    },
    /// Going on would not give the bits of a run that was never cut.
    #[error("{what} is {found}, but the run was made with {expected}")]
    Differs {
        /// A key of the scene, `version` or `device`.
        what: String,
        /// Its value now.
        found: String,
        /// Its value when the run began.
        expected: String,
    },
    /// A body is another one.
    #[error("the geometry of body {body} is not the one that the run was made with")]
    Geometry {
        /// Its name.
        body: String,
    },
}

#[derive(Serialize, Deserialize)]
struct About {
    version: u32,
    bodies: Vec<String>,
    scene: serde_json::Value,
    #[serde(default)]
    folder: String,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    planned: Option<u64>,
}

impl RunRecord {
    /// A record that begins with the state of `system` at time 0.
    pub fn new(system: &System, scene: serde_json::Value) -> Self {
        let bodies = system.bodies().iter().map(|body| body.name.clone()).collect();
        let mut record = Self { bodies, scene, contact_starts: vec![0], ..Self::default() };
        record.push(0.0, system);
        record
    }

    /// A record without a state.
    fn of_about(about: About) -> Self {
        let About { bodies, scene, folder, planned, .. } = about;
        Self { bodies, scene, folder, planned, contact_starts: vec![0], ..Self::default() }
    }

    fn about(&self) -> About {
        About {
            version: RUN_VERSION,
            bodies: self.bodies.clone(),
            scene: self.scene.clone(),
            folder: self.folder.clone(),
            planned: self.planned,
        }
    }

    /// Steps made.
    pub fn steps(&self) -> u64 {
        self.times.len().saturating_sub(1) as u64
    }

    /// The steps that the run was to have, when it was cut before or still grows; `None` of a complete run.
    pub fn planned_steps(&self) -> Option<u64> {
        self.planned
    }

    /// Makes room for the states of a run of `steps` steps.
    pub(crate) fn reserve(&mut self, steps: u64) -> Result<(), TryReserveError> {
        let more = usize::try_from(steps.saturating_sub(self.steps())).unwrap_or(usize::MAX);
        let states = more.saturating_mul(self.bodies.len());
        self.times.try_reserve_exact(more)?;
        self.poses.try_reserve_exact(states)?;
        self.velocities.try_reserve_exact(states)
    }

    /// Says how many steps the run is to have, or that it has them.
    pub(crate) fn plan(&mut self, steps: Option<u64>) {
        self.planned = steps;
    }

    /// The states of all bodies after `step` steps, bit for bit; `None` when the run does not have them.
    pub(crate) fn states(&self, step: usize) -> Option<Vec<State>> {
        let state = |body| {
            let [linear, angular] = self.velocity(step, body)?;
            Some(State { pose: self.pose(step, body)?, linear, angular })
        };
        (0..self.bodies.len()).map(state).collect()
    }

    /// Adds the state of `system` at a time.
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

    /// Adds the contacts at the beginning of a step; steps ascend.
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

    /// Times, s; as many as there are states.
    pub fn times(&self) -> &[f64] {
        &self.times
    }

    /// The number of steps after which the time is nearest to `time`; the earlier one of two.
    pub fn nearest_step(&self, time: f64) -> Option<usize> {
        nearest(0..self.times.len(), |step| self.times[step], time)
    }

    /// As [`nearest_step`](Self::nearest_step), among the steps whose contacts are kept.
    pub fn nearest_contacts(&self, time: f64) -> Option<usize> {
        let kept =
            self.contact_steps.iter().map(|&step| step as usize).filter(|&step| step < self.times.len());
        nearest(kept, |step| self.times[step], time)
    }

    /// Pose of a body after `step` steps.
    pub fn pose(&self, step: usize, body: usize) -> Option<Pose> {
        let at = (body < self.bodies.len()).then(|| step * self.bodies.len() + body)?;
        let [x, y, z, i, j, k, w] = *self.poses.get(at)?;
        Some(Pose { translation: DVec3::new(x, y, z), rotation: DQuat::from_xyzw(i, j, k, w) })
    }

    /// Velocity of a body's centre of mass, and its angular velocity, after `step` steps.
    pub fn velocity(&self, step: usize, body: usize) -> Option<[DVec3; 2]> {
        let at = (body < self.bodies.len()).then(|| step * self.bodies.len() + body)?;
        let [x, y, z, i, j, k] = *self.velocities.get(at)?;
        Some([DVec3::new(x, y, z), DVec3::new(i, j, k)])
    }

    /// The steps whose contacts are kept, with the contacts.
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

    /// Where the contacts of a step are, if they are kept.
    fn contact_range(&self, step: u64) -> Option<Range<usize>> {
        let at = self.contact_steps.binary_search(&step).ok()?;
        Some(self.contact_starts[at] as usize..self.contact_starts[at + 1] as usize)
    }

    /// The file's bytes; the same record gives the same bytes.
    ///
    /// # Errors
    /// Metadata larger than safetensors allows.
    pub fn to_bytes(&self) -> Result<Vec<u8>, RecordError> {
        let about = serde_json::to_string(&self.about()).map_err(|e| RecordError::NotARun(e.to_string()))?;
        // One key: the crate keeps metadata in a hash map, and the order of several would vary from run to run.
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
        Ok(serialize(tensors, Some(metadata))?)
    }

    /// Writes the file whole or not at all.
    ///
    /// # Errors
    /// What the operating system refused.
    pub fn save(&self, path: impl AsRef<Path>) -> Result<(), RecordError> {
        Ok(save_atomic(path, &self.to_bytes()?)?)
    }

    /// Reads a run file.
    ///
    /// # Errors
    /// As [`from_bytes`](Self::from_bytes), and what the operating system refused.
    pub fn open(path: impl AsRef<Path>) -> Result<Self, RecordError> {
        Self::from_bytes(&read(path.as_ref())?)
    }

    /// A record from a file's bytes; of a journal, up to its last whole step.
    ///
    /// # Errors
    /// No run, another version, or tensors that do not fit each other.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, RecordError> {
        if journal::is_journal(bytes) {
            return Ok(CutRun::from_bytes(bytes.to_vec())?.run.record);
        }
        let (_, header) = SafeTensors::read_metadata(bytes)?;
        let about = header.metadata().as_ref().and_then(|m| m.get(KEY));
        let about = about.ok_or_else(|| RecordError::NotARun(format!("the metadata has no {KEY}")))?;
        let About { version, bodies, scene, folder, planned } =
            serde_json::from_str(about).map_err(|e| RecordError::NotARun(format!("{KEY}: {e}")))?;
        if version != RUN_VERSION {
            return Err(RecordError::Version { found: version });
        }
        let file = SafeTensors::deserialize(bytes)?;
        let count = bodies.len();
        let times: Vec<f64> = values(&file, "times", Dtype::F64, &[])?;
        let hidden = match file.tensor("hidden.steps") {
            Ok(_) => HiddenRows {
                steps: values(&file, "hidden.steps", Dtype::U64, &[])?,
                ids: values(&file, "hidden.ids", Dtype::U32, &[2])?,
                depths: values(&file, "hidden.depths", Dtype::F64, &[])?,
            },
            Err(_) => HiddenRows::default(),
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
            times,
            bodies,
            scene,
            folder,
            planned,
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
            && self.hidden.fit(self.times.len() as u64, self.bodies.len());
        if fits {
            return Ok(());
        }
        Err(RecordError::NotARun(
            "its tensors do not fit each other, as it was damaged or made by hand".into(),
        ))
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

/// The rows of a tensor of shape `[n, row…]`; copied, as a file's tensors need not be aligned.
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
