//! The journal of a run: a file that gains one frame per step and is readable up to its last
//! complete frame.
//!
//! ```text
//! byte 0   "tesdfrun", then the version of the journal, u32
//!     12   frames: length n of the payload, u64; checksum, 16 bytes; payload, n bytes
//! ```
//!
//! All numbers are little-endian. The checksum is the first 16 bytes of the BLAKE3 hash of the
//! frame's number (u64, from 0) and the payload.
//!
//! Frame 0 is JSON: the metadata of a complete run, `planned` (the planned number of steps) and
//! `origin` ([`RunOrigin`]).
//!
//! Frame k + 1 is the state after k steps: a [`StateHead`], then poses and velocities. The contacts
//! at the beginning of the last step follow if they are recorded: points, normals, distances and
//! ids, in the types of the complete file. The ids and depths of the hidden overlaps at that time
//! follow, then the forces of the last step if they are recorded: ids, points and contacts, with
//! torques in the version that has them, and those of all joints. Where the `warnings` of the metadata are others than those of the frame
//! before, they come last, as JSON; each replaces all before.
//!
//! Each frame is written by one call, which does not wait for the disk. A process that is killed
//! therefore loses at most its current step. A power failure also loses the data that the operating
//! system had not yet written. Reading stops at the first incomplete frame.
use std::io::Write;
use std::path::{Path, PathBuf};

use bytemuck::{Pod, Zeroable};
use serde::{Deserialize, Serialize};
use tesdf::save::{Destination, GrowingFile, SaveError};

use super::{About, RecordError, RunRecord, has_torques, told};
use crate::simulate::PartialRun;
use crate::totals::Totals;
use crate::{Residual, RunOrigin, StepReport, Warning};

const MAGIC: &[u8; 8] = b"tesdfrun";
const HEAD: usize = MAGIC.len() + size_of::<u32>();
const CHECKSUM: usize = 16;
/// In place of a number of contacts or forces: they are not recorded.
const NOT_KEPT: u64 = u64::MAX;

/// An interrupted run, with everything that is needed to resume it.
#[derive(Clone, Debug)]
pub struct InterruptedRun {
    /// The steps so far.
    pub run: PartialRun,
    /// The software and geometry that the run was made with.
    pub origin: RunOrigin,
    /// The bytes of the file up to its last complete frame.
    bytes: Vec<u8>,
}

/// The open journal of a run. The file remains when this value is dropped.
#[derive(Debug)]
pub struct RunJournal {
    file: GrowingFile,
    path: PathBuf,
    frames: u64,
    bytes: u64,
    /// The warnings of the last frame.
    told: Vec<Warning>,
    /// Whether frames have torques.
    has_torques: bool,
}

#[derive(Serialize, Deserialize)]
struct First {
    #[serde(flatten)]
    about: About,
    origin: RunOrigin,
}

/// The fixed-size numbers of a state and of the step that led to it. The values of the step are 0
/// in the first state.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct StateHead {
    /// Time, s.
    time: f64,
    /// The smallest signed distance, m; NaN without contacts.
    deepest: f64,
    contacts: u64,
    /// Wall time of the detection, ns.
    detection: u64,
    /// Wall time of the rest of the step, ns.
    solution: u64,
    /// Number of contacts in this frame, or [`NOT_KEPT`].
    kept: u64,
    /// Number of hidden overlaps in this frame.
    hidden: u64,
    /// Number of contact forces in this frame, or [`NOT_KEPT`].
    forces: u64,
    /// Bytes of the warnings in this frame; 0 where they are those of the frame before.
    warnings: u64,
    iterations: u32,
    converged: u32,
    /// [`Residual`]: m, N.
    residual: [f64; 2],
}

const _: () = assert!(size_of::<StateHead>() == 96);

/// Whether `bytes` begin like a journal.
pub(super) fn is_journal(bytes: &[u8]) -> bool {
    bytes.starts_with(MAGIC)
}

impl RunJournal {
    /// Replaces the destination by a journal with the first state of `record`. Returns `None` when
    /// the destination is not a regular file.
    ///
    /// # Errors
    /// [`RecordError::Save`]; the destination is then unchanged.
    pub fn begin(
        destination: &Destination,
        record: &RunRecord,
        origin: &RunOrigin,
    ) -> Result<Option<Self>, RecordError> {
        // There is no warning before the first step.
        let about = About { warnings: Vec::new(), ..record.about() };
        let first = First { about, origin: origin.clone() };
        let first = serde_json::to_vec(&first).map_err(|e| RecordError::NotARun(e.to_string()))?;
        let mut bytes = [&MAGIC[..], &record.version().to_le_bytes()].concat();
        bytes.extend(frame(0, &first));
        bytes.extend(frame(1, &state(record, 0, &StepReport::default(), &[], record.has_torques)));
        Self::write(destination, &bytes, 2, &[], record.has_torques)
    }

    /// Replaces the destination by the complete frames of an interrupted run; [`push`](Self::push)
    /// appends to them. Returns `None` when the destination is not a regular file.
    ///
    /// # Errors
    /// The same errors as [`begin`](Self::begin).
    pub fn resume(destination: &Destination, earlier: &InterruptedRun) -> Result<Option<Self>, RecordError> {
        let RunRecord { told, has_torques, .. } = &earlier.run.record;
        Self::write(destination, &earlier.bytes, 2 + earlier.run.record.steps(), told, *has_torques)
    }

    fn write(
        destination: &Destination,
        bytes: &[u8],
        frames: u64,
        told: &[Warning],
        has_torques: bool,
    ) -> Result<Option<Self>, RecordError> {
        let Some(mut part) = destination.part()? else { return Ok(None) };
        let path = destination.path().to_path_buf();
        part.write_all(bytes).map_err(|source| failed(&path, source))?;
        let (file, bytes, told) = (part.finish()?, bytes.len() as u64, told.to_vec());
        Ok(Some(Self { file, path, frames, bytes, told, has_torques }))
    }

    /// Appends the last state of `record` and the report of the step that led to it.
    ///
    /// # Errors
    /// [`RecordError::Save`]; the file then ends with the step before.
    pub fn push(&mut self, record: &RunRecord, report: &StepReport) -> Result<(), RecordError> {
        let told = match record.told == self.told {
            true => Vec::new(),
            false => serde_json::to_vec(&record.told).map_err(|e| RecordError::NotARun(e.to_string()))?,
        };
        let state = state(record, record.steps() as usize, report, &told, self.has_torques);
        let frame = frame(self.frames, &state);
        self.file.write_all(&frame).map_err(|source| {
            // Readers skip an incomplete frame, but a full disk may need its space.
            let _ = self.file.cut(self.bytes);
            failed(&self.path, source)
        })?;
        self.frames += 1;
        self.bytes += frame.len() as u64;
        self.told.clone_from(&record.told);
        Ok(())
    }
}

fn failed(path: &Path, source: std::io::Error) -> RecordError {
    RecordError::Save(SaveError::Io { action: "write", path: path.to_path_buf(), source })
}

impl InterruptedRun {
    /// Reads the journal of an interrupted run.
    ///
    /// # Errors
    /// The errors of [`RunRecord::open`], and [`RecordError::Complete`] when the run is complete.
    pub fn open(path: impl AsRef<Path>) -> Result<Self, RecordError> {
        let bytes = super::read(path.as_ref())?;
        if !is_journal(&bytes) {
            let record = RunRecord::from_bytes(&bytes)?;
            return Err(match record.planned_steps() {
                None => RecordError::Complete { steps: record.steps() },
                Some(_) => RecordError::NotARun("it was interrupted, but saved without its journal".into()),
            });
        }
        Self::from_bytes(bytes)
    }

    /// As [`open`](Self::open), but from the bytes of a journal. Bytes after the last complete
    /// frame are dropped.
    pub(super) fn from_bytes(mut bytes: Vec<u8>) -> Result<Self, RecordError> {
        let version = bytes.get(MAGIC.len()..HEAD).and_then(|version| version.try_into().ok());
        let version = version.map(u32::from_le_bytes).ok_or_else(|| RecordError::NotARun(NO_STATE.into()))?;
        has_torques(version)?;
        let mut frames = Frames { bytes: &bytes, at: HEAD, number: 0 };
        let first = frames.next().ok_or_else(|| RecordError::NotARun(NO_STATE.into()))?;
        let First { about, origin } = serde_json::from_slice(first)
            .map_err(|e| RecordError::NotARun(format!("its first frame: {e}")))?;
        let mut run = PartialRun { record: RunRecord::of_about(about)?, totals: Totals::default() };
        while let Some(payload) = frames.next() {
            let refused =
                |reason: String| RecordError::NotARun(format!("frame {} {reason}", frames.number - 1));
            let told =
                read_state(payload, &mut run).ok_or_else(|| refused("does not fit its bodies".into()))?;
            if !told.is_empty() {
                let told: Vec<Warning> =
                    serde_json::from_slice(told).map_err(|e| refused(format!("has warnings: {e}")))?;
                told::check(&told, &run.record.bodies).map_err(|e| refused(format!("has warnings: {e}")))?;
                run.record.told = told;
            }
        }
        if run.record.times.is_empty() {
            return Err(RecordError::NotARun(NO_STATE.into()));
        }
        bytes.truncate(frames.at);
        Ok(Self { run, origin, bytes })
    }
}

const NO_STATE: &str = "it was interrupted before its first state was written; simulate the scene again";

/// Iterates over the payloads of the complete frames.
struct Frames<'a> {
    bytes: &'a [u8],
    /// Offset of the next frame.
    at: usize,
    /// Number of the next frame.
    number: u64,
}

impl<'a> Iterator for Frames<'a> {
    type Item = &'a [u8];

    fn next(&mut self) -> Option<&'a [u8]> {
        let (length, rest) = self.bytes.get(self.at..)?.split_first_chunk()?;
        let (expected, rest) = rest.split_first_chunk::<CHECKSUM>()?;
        let payload = rest.get(..usize::try_from(u64::from_le_bytes(*length)).ok()?)?;
        if checksum(self.number, payload) != *expected {
            return None;
        }
        self.at += length.len() + CHECKSUM + payload.len();
        self.number += 1;
        Some(payload)
    }
}

fn frame(number: u64, payload: &[u8]) -> Vec<u8> {
    [&(payload.len() as u64).to_le_bytes()[..], &checksum(number, payload), payload].concat()
}

fn checksum(number: u64, payload: &[u8]) -> [u8; CHECKSUM] {
    let mut hasher = blake3::Hasher::new();
    hasher.update(&number.to_le_bytes()).update(payload);
    let mut checksum = [0; CHECKSUM];
    hasher.finalize_xof().fill(&mut checksum);
    checksum
}

/// The payload of the state after `step` steps, with the bytes of new warnings.
fn state(record: &RunRecord, step: usize, report: &StepReport, told: &[u8], has_torques: bool) -> Vec<u8> {
    let before = step.checked_sub(1).map(|before| before as u64);
    let kept = before.and_then(|before| record.contact_range(before));
    let hidden = before.map_or(0..0, |before| record.hidden.of_step(before));
    let forces = before.and_then(|before| record.forces.place(before));
    let pushing = forces.map(|place| record.forces.contacts_at(place));
    let joints = record.joints.len();
    let of_joints = forces.map_or(0..0, |place| place * joints..(place + 1) * joints);
    let head = StateHead {
        time: record.times[step],
        deepest: report.deepest.unwrap_or(f64::NAN),
        contacts: report.contacts as u64,
        detection: nanoseconds(report.detection),
        solution: nanoseconds(report.solution),
        kept: kept.as_ref().map_or(NOT_KEPT, |range| range.len() as u64),
        hidden: hidden.len() as u64,
        forces: pushing.as_ref().map_or(NOT_KEPT, |range| range.len() as u64),
        warnings: told.len() as u64,
        iterations: report.iterations,
        converged: report.converged.into(),
        residual: [report.residual.way, report.residual.force],
    };
    let bodies = record.bodies.len();
    let of_bodies = step * bodies..(step + 1) * bodies;
    let [kept, pushing] = [kept, pushing].map(Option::unwrap_or_default);
    let torques = if has_torques { pushing.clone() } else { 0..0 };
    [
        bytemuck::bytes_of(&head),
        bytemuck::cast_slice(&record.poses[of_bodies.clone()]),
        bytemuck::cast_slice(&record.velocities[of_bodies]),
        bytemuck::cast_slice(&record.points[kept.clone()]),
        bytemuck::cast_slice(&record.normals[kept.clone()]),
        bytemuck::cast_slice(&record.distances[kept.clone()]),
        bytemuck::cast_slice(&record.ids[kept]),
        bytemuck::cast_slice(&record.hidden.ids[hidden.clone()]),
        bytemuck::cast_slice(&record.hidden.depths[hidden]),
        bytemuck::cast_slice(&record.forces.ids[pushing.clone()]),
        bytemuck::cast_slice(&record.forces.points[pushing.clone()]),
        bytemuck::cast_slice(&record.forces.contacts[pushing]),
        bytemuck::cast_slice(&record.forces.torques[torques]),
        bytemuck::cast_slice(&record.forces.joints[of_joints]),
        told,
    ]
    .concat()
}

fn nanoseconds(duration: std::time::Duration) -> u64 {
    u64::try_from(duration.as_nanos()).unwrap_or(u64::MAX)
}

/// Appends a state to a run, and returns the bytes of its warnings. Returns `None` when the length
/// of the payload does not match its head.
fn read_state<'a>(mut payload: &'a [u8], run: &mut PartialRun) -> Option<&'a [u8]> {
    let record = &mut run.record;
    let (steps, bodies) = (record.times.len() as u64, record.bodies.len());
    let head: StateHead = take(&mut payload, 1)?.pop()?;
    record.times.push(head.time);
    record.poses.extend(take::<[f64; 7]>(&mut payload, bodies)?);
    record.velocities.extend(take::<[f64; 6]>(&mut payload, bodies)?);
    if head.kept != NOT_KEPT {
        let count = usize::try_from(head.kept).ok()?;
        record.points.extend(take::<[f32; 3]>(&mut payload, count)?);
        record.normals.extend(take::<[f32; 3]>(&mut payload, count)?);
        record.distances.extend(take::<f32>(&mut payload, count)?);
        record.ids.extend(take::<[u32; 4]>(&mut payload, count)?);
        record.contact_steps.push(steps.checked_sub(1)?);
        record.contact_starts.push(record.distances.len() as u64);
    }
    if head.hidden > 0 {
        let count = usize::try_from(head.hidden).ok()?;
        record.hidden.ids.extend(take::<[u32; 2]>(&mut payload, count)?);
        record.hidden.depths.extend(take::<f64>(&mut payload, count)?);
        record.hidden.steps.resize(record.hidden.ids.len(), steps.checked_sub(1)?);
    }
    if head.forces != NOT_KEPT {
        let (count, forces) = (usize::try_from(head.forces).ok()?, &mut record.forces);
        forces.ids.extend(take::<[u32; 2]>(&mut payload, count)?);
        forces.points.extend(take::<[f64; 3]>(&mut payload, count)?);
        forces.contacts.extend(take::<[f32; 6]>(&mut payload, count)?);
        match record.has_torques {
            true => forces.torques.extend(take::<f32>(&mut payload, count)?),
            false => forces.torques.resize(forces.ids.len(), 0.0),
        }
        forces.joints.extend(take::<[f32; 8]>(&mut payload, record.joints.len())?);
        forces.steps.push(steps.checked_sub(1)?);
        forces.ends.push(forces.ids.len() as u64);
    }
    if steps > 0 {
        run.totals.add(&StepReport {
            contacts: usize::try_from(head.contacts).ok()?,
            deepest: Some(head.deepest).filter(|deepest| !deepest.is_nan()),
            iterations: head.iterations,
            converged: head.converged != 0,
            residual: Residual { way: head.residual[0], force: head.residual[1] },
            detection: std::time::Duration::from_nanos(head.detection),
            solution: std::time::Duration::from_nanos(head.solution),
            ..StepReport::default()
        });
    }
    (payload.len() as u64 == head.warnings).then_some(payload)
}

/// Removes `count` values from the front of the payload. They are copied because the numbers of a
/// file may be unaligned.
fn take<T: Pod>(payload: &mut &[u8], count: usize) -> Option<Vec<T>> {
    let (values, rest) = payload.split_at_checked(count.checked_mul(size_of::<T>())?)?;
    *payload = rest;
    Some(values.chunks_exact(size_of::<T>()).map(bytemuck::pod_read_unaligned).collect())
}
