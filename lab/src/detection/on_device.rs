//! Measures a detection on a device, stage by stage.
use std::time::{Duration, Instant};

use tesdf::collide::{CollideOptions, Mode, Reduction};
use tesdf_cli::terminal::report::Failure;
use tesdf_gpu::{Counting, Detector, DetectorOptions, Device, Exchange, Lanes, Memory, Pruning};

use super::arguments::{Args, LanesName};
use super::frames::Frames;
use super::hashes::Hashes;
use super::report::{Bytes, Counts, PHASES, Report, Spread, Stage, ms};

/// The phase of a stage. A stage that only prepares a launch belongs to the phase of that launch.
/// The search for hidden overlaps and the reduction are in none of the three phases.
fn phase(stages: &[(&str, Duration)], stage: usize) -> &'static str {
    match stages[stage].0 {
        "groups" if stage + 1 < stages.len() => phase(stages, stage + 1),
        "instance bounds" | "instance pairs" | "meshlets" => "BP",
        "polygons" | "outside of domains" | "nodes" => "MP",
        "face narrow phase" | "node narrow phase" | "exact narrow phase" => "NP",
        "clear depths" | "hidden overlaps" => "hidden overlaps",
        _ => "reduction",
    }
}

/// Measures all frames on the device: first as they are, then with counted operations, then without
/// pruning.
///
/// # Errors
/// The device fails.
pub fn fill(
    report: &mut Report,
    args: &Args,
    device: &Device,
    frames: &mut Frames,
    options: &CollideOptions,
) -> Result<(), Failure> {
    report.device = device.info().name.clone();
    let with = DetectorOptions {
        memory: Memory::Grow,
        lanes: match args.lanes {
            LanesName::Group => Lanes::Group,
            LanesName::Single => Lanes::Single,
        },
        exchange: if args.shared { Exchange::Shared } else { Exchange::Device },
        ..DetectorOptions::default()
    };
    let mut detector = Detector::new(device, &frames.scene, with).map_err(Failure::new)?;
    let measured = measure(frames, &mut detector, options, report.repeat)?;
    report.launches = detector.report().launches;
    report.phases_ms = measured.phases();
    let counting = DetectorOptions { counting: Counting::Operations, ..with };
    let mut detector = Detector::new(device, &frames.scene, counting).map_err(Failure::new)?;
    let operations = measure(frames, &mut detector, options, 1)?;
    let unpruned = DetectorOptions { pruning: Pruning::Bounds, ..with };
    let mut detector = Detector::new(device, &frames.scene, unpruned).map_err(Failure::new)?;
    let all = measure(frames, &mut detector, options, 1)?;
    report.phases_unpruned_ms = Some(all.phases());
    report.counts = measured.counts;
    report.contacts_hash = measured.contacts_hash;
    report.counts.queries_unpruned = Some(all.counts.queries);
    let searches = options.mode != Mode::Node;
    report.counts.evaluations = operations.counts.evaluations.filter(|_| searches);
    report.counts.distances = operations.counts.distances.filter(|_| searches);
    report.stages = measured.stages;
    report.bytes = Some(measured.bytes);
    report.wall_ms = measured.wall_ms;
    Ok(())
}

/// The narrow phase of the frames, and what it counts.
pub struct FaceTes {
    /// Median device time, ms.
    pub narrow_ms: f64,
    /// Mean device times of the broad, middle and narrow phase, ms.
    pub phases_ms: [f64; 3],
    pub wall_ms: Spread,
    /// With evaluations and distances.
    pub counts: Counts,
}

/// Measures the mode `face` on the device: first as it is, then with counted operations.
///
/// # Errors
/// The device fails.
pub fn face_tes(
    device: &Device,
    frames: &mut Frames,
    options: &CollideOptions,
    repeat: u32,
) -> Result<FaceTes, Failure> {
    let with = DetectorOptions { memory: Memory::Grow, ..DetectorOptions::default() };
    let mut detector = Detector::new(device, &frames.scene, with).map_err(Failure::new)?;
    let measured = measure(frames, &mut detector, options, repeat)?;
    let counting = DetectorOptions { counting: Counting::Operations, ..with };
    let mut detector = Detector::new(device, &frames.scene, counting).map_err(Failure::new)?;
    let counts = measure(frames, &mut detector, options, 1)?.counts;
    let narrow = measured.stages.iter().filter(|stage| stage.phase == "NP");
    let narrow_ms = narrow.map(|stage| stage.ms.median).sum();
    let phases_ms = measured.phases().map(|(_, ms)| ms);
    Ok(FaceTes { narrow_ms, phases_ms, wall_ms: measured.wall_ms, counts })
}

struct Measured {
    stages: Vec<Stage>,
    counts: Counts,
    bytes: Bytes,
    wall_ms: Spread,
    contacts_hash: String,
}

impl Measured {
    fn phases(&self) -> [(&'static str, f64); 3] {
        PHASES.map(|phase| {
            (phase, self.stages.iter().filter(|s| s.phase == phase).map(|s| s.ms.mean).sum::<f64>())
        })
    }
}

fn measure(
    frames: &mut Frames,
    detector: &mut Detector,
    options: &CollideOptions,
    repeat: u32,
) -> Result<Measured, Failure> {
    let (mut walls, mut reports, mut hashes) = (Vec::new(), Vec::new(), Hashes::default());
    let mut kept = Vec::new();
    for frame in 0..frames.poses.len() {
        frames.show(frame)?;
        // The first detection grows the buffers and compiles the kernels.
        detector.detect(&frames.scene, options).map_err(Failure::new)?;
        for _ in 0..repeat {
            let start = Instant::now();
            let contacts = detector.detect(&frames.scene, options).map_err(Failure::new)?;
            walls.push(ms(start.elapsed()));
            hashes.add(frame, contacts.as_slice())?;
            let contacts = detector.detect_timed(&frames.scene, options).map_err(Failure::new)?;
            hashes.add(frame, contacts.as_slice())?;
            reports.push(detector.report().clone());
            kept.push(contacts.len() as f64);
        }
    }
    let stage = |k: usize| {
        let name = reports[0].stages[k].0;
        let ms = Spread::of(reports.iter().map(|r| ms(r.stages[k].1)).collect());
        Stage { name, phase: phase(&reports[0].stages, k), ms }
    };
    let stages = (0..reports.first().map_or(0, |r| r.stages.len())).map(stage).collect();
    let count = |value: fn(&tesdf_gpu::Counts) -> u32| {
        Spread::of(reports.iter().map(|r| f64::from(value(&r.counts))).collect())
    };
    let bytes = |value: fn(&tesdf_gpu::DeviceReport) -> usize| {
        Spread::of(reports.iter().map(|r| value(r) as f64).collect())
    };
    let held = detector.bytes();
    Ok(Measured {
        stages,
        counts: Counts {
            directions: count(|c| c.ordered_pairs),
            meshlets: count(|c| c.meshlets),
            queries: count(|c| c.polygons),
            contacts: count(|c| c.contacts),
            filtered: count(|c| c.filtered),
            kept: matches!(options.reduction, Reduction::PerPair(_) | Reduction::Spread(_))
                .then(|| Spread::of(kept)),
            candidates: count(|c| c.candidates),
            queries_unpruned: None,
            evaluations: Some(count(|c| c.evaluations)),
            distances: Some(count(|c| c.distances)),
        },
        bytes: Bytes {
            sent: bytes(|r| r.sent),
            read: bytes(|r| r.read),
            shapes_table: held.shapes.table,
            shapes_words: held.shapes.words + held.shapes.fans,
            shapes_rows: held.shapes.rows,
            products: held.pipeline.iter().map(|(_, bytes)| bytes).sum(),
            total: held.with_instances(frames.scene.instances().len()),
            per_instance: held.per_instance,
            products_by_buffer: held.pipeline,
        },
        wall_ms: Spread::of(walls),
        contacts_hash: hashes.all(),
    })
}
