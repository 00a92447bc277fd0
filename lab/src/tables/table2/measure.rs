//! Measures a scenario in its recorded poses.
use std::collections::BTreeSet;
use std::path::Path;
use std::time::Instant;

use serde::Serialize;
use tesdf::collide::internal::{count_faces, count_polygons};
use tesdf::collide::{
    CollideError, CollideOptions, ContactsPer, Mode, Reduction, Scene, Shape, Statistics, detect,
};
use tesdf::encode::EncodeOptions;
use tesdf::inspect::{InspectOptions, inspect};

use super::{Args, Scenario};
use crate::detection::frames::Frames;
use crate::detection::report::{Spread, ms};
use tesdf_cli::terminal::device::Device;
use tesdf_cli::terminal::progress::Bar;
use tesdf_cli::terminal::report::Failure;

/// Contacts that a reduction keeps of a pair of bodies.
pub const KEPT: u32 = 64;

/// A scenario with lists of at most `max_entries` faces.
#[derive(Clone, Debug, Serialize)]
pub struct Row {
    pub scenario: Scenario,
    pub max_entries: Option<u32>,
    pub instances: usize,
    pub frames: usize,
    /// Contacts are detected up to this signed distance, m.
    pub contact_distance: f64,
    pub memory: Memory,
    /// Face-TES with the paper's parameters: one problem for each polygon of a face in a cell.
    pub paper_form: Cost,
    /// Mean times of the broad, middle and narrow phase of Face-TES, ms.
    pub phases_ms: [f64; 3],
    /// The exact minimum, one problem for each face, local minima only.
    pub per_face: Cost,
    /// Contacts of `per_face` after a reduction to 64 per pair.
    pub kept: Count,
}

/// Memory of a scene.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Memory {
    /// The paper's account, in which each instance counts, MiB.
    pub paper_mib: f64,
    /// Resident bytes of all assets, each once, with the normals that a detection stores.
    pub assets: usize,
    /// Resident bytes of all instances.
    pub instances: usize,
    /// Largest size of contacts and intermediate products, with one contact for each local minimum.
    pub detection: usize,
}

impl Memory {
    pub fn whole(&self) -> usize {
        self.assets + self.instances + self.detection
    }
}

/// A number that differs from frame to frame.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Count {
    pub mean: f64,
    pub max: f64,
}

/// Narrow-phase queries, contacts and time of a detection.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Cost {
    pub queries: Count,
    pub contacts: Count,
    /// Mean wall time, from the poses to the contacts, ms.
    pub detection_ms: f64,
}

/// Normal and offset of a face, which the first detection of a body stores.
const NORMAL_BYTES: usize = 32;

/// Face-TES as in Sec. VII-B of the paper.
fn face_tes(contact_distance: f64) -> CollideOptions {
    CollideOptions { contact_distance, ..CollideOptions::with_mode(Mode::PAPER) }
}

fn per_face(contact_distance: f64) -> CollideOptions {
    CollideOptions { contact_distance, ..CollideOptions::with_mode(Mode::exact().per(ContactsPer::Minimum)) }
}

/// Encodes the meshes of a scenario, and detects its contacts in all frames.
///
/// # Errors
/// A file cannot be read, a mesh cannot be encoded, or the device fails.
pub fn row(
    args: &Args,
    (scenario, file): (Scenario, &Path),
    max_entries: Option<u32>,
    device: Option<&Device>,
    bar: &Bar,
) -> Result<Row, Failure> {
    bar.stage("encoding");
    let options = EncodeOptions { max_entries, ..EncodeOptions::preset(args.preset) };
    let mut frames = Frames::read(file, args.frames(), 1, &options)?;
    bar.stage("detecting");
    let repeat = args.repeat();
    let distance = frames.contact_distance.unwrap_or(0.0);
    let paper = on_processor(&mut frames, &face_tes(distance), repeat, bar)?;
    let ours = on_processor(&mut frames, &per_face(distance), repeat, bar)?;
    let reduced = CollideOptions { reduction: Reduction::PerPair(KEPT), ..per_face(distance) };
    let kept = on_processor(&mut frames, &reduced, 1, bar)?;
    let mut memory = memory(&frames.scene)?;
    memory.detection = ours.bytes;
    let phases_ms = phases(&mut frames, distance, repeat, paper.cost.detection_ms)?;
    let mut row = Row {
        scenario,
        max_entries,
        instances: frames.poses[0].len(),
        frames: frames.poses.len(),
        contact_distance: distance,
        memory,
        phases_ms,
        paper_form: paper.cost,
        per_face: ours.cost,
        kept: kept.cost.contacts,
    };
    if let Some(device) = device {
        on_device(device, &mut frames, repeat, &mut row)?;
    }
    Ok(row)
}

struct Measured {
    cost: Cost,
    bytes: usize,
}

fn on_processor(
    frames: &mut Frames,
    options: &CollideOptions,
    repeat: u32,
    bar: &Bar,
) -> Result<Measured, Failure> {
    let mut found: Vec<Statistics> = Vec::new();
    let time = timed(frames, repeat, |scene| {
        let contacts = detect(scene, options)?;
        found.push(contacts.statistics);
        Ok(())
    });
    bar.set(1.0);
    let count = |value: fn(&Statistics) -> usize| {
        Count::of(Spread::of(found.iter().map(|s| value(s) as f64).collect()))
    };
    let cost = Cost {
        queries: count(|s| s.polygons),
        contacts: count(|s| s.touching - s.filtered - s.reduced),
        detection_ms: time?,
    };
    Ok(Measured { cost, bytes: found.iter().map(|s| s.bytes).max().unwrap_or(0) })
}

/// Mean times of the broad, middle and narrow phase on the processor. The phases of a detection run
/// mixed there, so each is the difference between the times up to its end and up to its beginning.
fn phases(frames: &mut Frames, distance: f64, repeat: u32, detection: f64) -> Result<[f64; 3], Failure> {
    let options = face_tes(distance);
    let broad = timed(frames, repeat, |scene| count_faces(scene, &options).map(|_| ()))?;
    let middle = timed(frames, repeat, |scene| count_polygons(scene, &options).map(|_| ()))?;
    Ok([broad, (middle - broad).max(0.0), (detection - middle).max(0.0)])
}

/// Mean time of `work` over all frames, ms. The first time in each frame does not count: it reads
/// the memory for the first time.
fn timed(
    frames: &mut Frames,
    repeat: u32,
    mut work: impl FnMut(&Scene) -> Result<(), CollideError>,
) -> Result<f64, Failure> {
    let mut times = Vec::new();
    for frame in 0..frames.poses.len() {
        frames.show(frame)?;
        work(&frames.scene).map_err(Failure::new)?;
        for _ in 0..repeat {
            let start = Instant::now();
            work(&frames.scene).map_err(Failure::new)?;
            times.push(ms(start.elapsed()));
        }
    }
    Ok(Spread::of(times).mean)
}

impl Count {
    fn of(spread: Spread) -> Self {
        Self { mean: spread.mean, max: spread.max }
    }
}

/// Without the products of a detection.
fn memory(scene: &Scene) -> Result<Memory, Failure> {
    let mut memory = Memory { paper_mib: 0.0, assets: 0, instances: scene.instance_bytes(), detection: 0 };
    let mut counted = BTreeSet::new();
    for (_, instance) in scene.instances() {
        let Shape::Mesh(asset) = scene.shape(instance.shape).map_err(Failure::new)? else { continue };
        let found = inspect(asset, &InspectOptions::default()).memory;
        memory.paper_mib += found.paper_mib;
        if counted.insert(instance.shape) {
            memory.assets += found.whole + NORMAL_BYTES * asset.face_count();
        }
    }
    Ok(memory)
}

#[cfg(feature = "gpu")]
fn on_device(device: &Device, frames: &mut Frames, repeat: u32, row: &mut Row) -> Result<(), Failure> {
    use crate::detection::on_device::face_tes as measure;
    let found = measure(&device.0, frames, &face_tes(row.contact_distance), repeat)?;
    row.phases_ms = found.phases_ms;
    row.paper_form = Cost {
        queries: Count::of(found.counts.queries),
        contacts: Count::of(found.counts.contacts),
        detection_ms: found.wall_ms.mean,
    };
    Ok(())
}

/// Without the GPU no value of `Device` exists.
#[cfg(not(feature = "gpu"))]
fn on_device(_: &Device, _: &mut Frames, _: u32, _: &mut Row) -> Result<(), Failure> {
    Ok(())
}
