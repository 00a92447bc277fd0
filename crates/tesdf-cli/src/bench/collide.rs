//! `tesdf bench collide SCENE|RUN|POSES`
use std::fmt::Write as _;
use std::path::PathBuf;
use std::time::{Duration, Instant};

use clap::ValueEnum;
use serde::Serialize;
use tesdf::collide::{CollideOptions, FaceMethod, Mode, Reduction, detect};
use tesdf_gpu::{Counting, Detector, DetectorOptions, Exchange, Lanes, Memory, Pruning};

use super::frames::Frames;
use crate::devices::{self, Choice};
use crate::parse;
use crate::report::{self, Failure, Outcome, size};

/// Arguments of `tesdf bench collide`.
#[derive(clap::Args, Debug)]
pub struct Args {
    /// A scene (.toml), a run (.tesrun) whose poses are replayed, or a file of poses (.json)
    #[arg(value_name = "SCENE|RUN|POSES")]
    pub source: PathBuf,
    /// Where contacts are found
    #[arg(long, value_name = "DEVICE", value_parser = Choice::parse, default_value_t = Choice::Best, help = devices::help("contacts are found"))]
    pub device: Choice,
    /// What is tested against the other body's field
    #[arg(long, value_enum, default_value_t = ModeName::Face)]
    pub mode: ModeName,
    /// Frank-Wolfe iterations of the mode `face`
    #[arg(long, value_name = "K", default_value_t = 16)]
    pub iterations: u32,
    /// Threshold of the cosine filter
    #[arg(long, value_name = "C", value_parser = parse::number, default_value_t = 0.3, allow_hyphen_values = true)]
    pub cos_theta: f64,
    /// Contacts are taken up to this signed distance [default: what the file says, else 0]
    #[arg(long, value_name = "D", value_parser = parse::length)]
    pub contact_distance: Option<f64>,
    /// Longest lists of meshes that are encoded for a file of poses [default: not cut]
    #[arg(long, value_name = "E")]
    pub e_max: Option<u32>,
    /// Keep at most N contacts of a pair of bodies
    #[arg(long, value_name = "N")]
    pub reduce: Option<u32>,
    /// The scene so many times, in worlds of their own
    #[arg(long, value_name = "N", default_value_t = 1)]
    pub worlds: u32,
    /// Frames of a run or of a file of poses, at most
    #[arg(long, value_name = "N", default_value_t = 16)]
    pub frames: usize,
    /// Measurements of each frame
    #[arg(long, value_name = "N", default_value_t = 5, value_parser = clap::value_parser!(u32).range(1..=100_000))]
    pub repeat: u32,
    /// Threads that work on a polygon
    #[arg(long, value_enum, default_value_t = LanesName::Group)]
    pub lanes: LanesName,
    /// Exchange values through shared memory, where there are planes of 32 threads too
    #[arg(long)]
    pub shared: bool,
    /// Detect on the processor too, and print the ratio
    #[arg(long)]
    pub against_cpu: bool,
    /// Print the result as JSON
    #[arg(long)]
    pub json: bool,
}

/// What is tested.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum ModeName {
    /// The vertices
    Node,
    /// The faces, by Frank-Wolfe iterations
    Face,
    /// The faces, exactly
    Exact,
}

/// How a polygon is worked on.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum LanesName {
    /// 32 threads, which share the faces of the list
    Group,
    /// A thread alone
    Single,
}

/// Mean, 99th percentile and greatest of some numbers.
#[derive(Clone, Copy, Debug, Default, Serialize)]
struct Spread {
    mean: f64,
    p99: f64,
    max: f64,
}

impl Spread {
    fn of(mut values: Vec<f64>) -> Self {
        values.sort_unstable_by(f64::total_cmp);
        let last = values.len().saturating_sub(1);
        let at = |share: f64| values.get((share * last as f64).ceil() as usize).copied().unwrap_or(0.0);
        let mean = values.iter().sum::<f64>() / values.len().max(1) as f64;
        Self { mean, p99: at(0.99), max: at(1.0) }
    }
}

#[derive(Serialize)]
struct Stage {
    name: &'static str,
    /// `BP`, `MP` or `NP`: the paper's broad, middle and narrow phase; or `reduction`.
    phase: &'static str,
    ms: Spread,
}

#[derive(Default, Serialize)]
struct Counts {
    directions: Spread,
    meshlets: Spread,
    candidates: Spread,
    queries: Spread,
    /// Without pruning by least signed distances.
    queries_unpruned: Option<Spread>,
    contacts: Spread,
    filtered: Spread,
    /// Of the contacts, those that a reduction keeps.
    kept: Option<Spread>,
    /// Of Face-TES: evaluations of the field, and point–triangle distances of the lists.
    evaluations: Option<Spread>,
    distances: Option<Spread>,
}

#[derive(Serialize)]
struct Bytes {
    sent: Spread,
    read: Spread,
    shapes_table: usize,
    shapes_words: usize,
    shapes_rows: usize,
    products: usize,
    products_by_buffer: Vec<(&'static str, usize)>,
    per_instance: usize,
    /// Shapes, products and instances.
    total: usize,
}

#[derive(Serialize)]
struct Report {
    source: String,
    device: String,
    mode: ModeName,
    iterations: u32,
    cos_theta: f64,
    contact_distance: f64,
    e_max: Option<u32>,
    lanes: LanesName,
    worlds: u32,
    instances: usize,
    frames: usize,
    repeat: u32,
    /// Launches of one pass.
    launches: usize,
    stages: Vec<Stage>,
    /// Device time by phase; without pruning for comparison.
    phases_ms: [(&'static str, f64); 3],
    phases_unpruned_ms: Option<[(&'static str, f64); 3]>,
    counts: Counts,
    bytes: Option<Bytes>,
    /// From the poses to the contacts on the processor.
    wall_ms: Spread,
    /// The same on the processor.
    cpu_wall_ms: Option<Spread>,
    /// Time of the processor over that of the device.
    cpu_over_device: Option<f64>,
}

const PHASES: [&str; 3] = ["BP", "MP", "NP"];

/// Of a stage, among all; what only prepares a launch belongs to that. Reduction is none of the three.
fn phase(stages: &[(&str, Duration)], stage: usize) -> &'static str {
    match stages[stage].0 {
        "groups" if stage + 1 < stages.len() => phase(stages, stage + 1),
        "instance bounds" | "instance pairs" | "meshlets" => "BP",
        "polygons" | "outside of domains" | "nodes" => "MP",
        "face narrow phase" | "node narrow phase" | "exact narrow phase" => "NP",
        _ => "reduction",
    }
}

fn ms(time: Duration) -> f64 {
    time.as_secs_f64() * 1e3
}

/// Measures and prints.
///
/// # Errors
/// A file that cannot be read, or a device that fails.
pub fn run(args: &Args) -> Result<Outcome, Failure> {
    let device = args.device.open()?;
    let mut frames = Frames::read(&args.source, args.frames, args.worlds, args.e_max)?;
    let contact_distance = args.contact_distance.or(frames.contact_distance).unwrap_or(0.0);
    let mode = match args.mode {
        ModeName::Node => Mode::Node,
        ModeName::Face => Mode::Face(FaceMethod::FrankWolfe { iterations: args.iterations }),
        ModeName::Exact => Mode::EXACT,
    };
    let options = CollideOptions {
        contact_distance,
        cos_theta: Some(args.cos_theta),
        reduction: args.reduce.map_or(Reduction::None, Reduction::PerPair),
        ..CollideOptions::with_mode(mode)
    };
    options.validate().map_err(Failure::new)?;
    let mut report = Report {
        source: args.source.display().to_string(),
        device: "cpu".into(),
        mode: args.mode,
        iterations: args.iterations,
        cos_theta: args.cos_theta,
        contact_distance,
        e_max: args.e_max,
        lanes: args.lanes,
        worlds: args.worlds,
        instances: frames.scene.instances().len(),
        frames: frames.poses.len(),
        repeat: args.repeat.max(1),
        launches: 0,
        stages: Vec::new(),
        phases_ms: PHASES.map(|phase| (phase, 0.0)),
        phases_unpruned_ms: None,
        counts: Counts::default(),
        bytes: None,
        wall_ms: Spread::default(),
        cpu_wall_ms: None,
        cpu_over_device: None,
    };
    match device {
        Some(device) => {
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
            let mut detector = Detector::new(&device, &frames.scene, with).map_err(Failure::new)?;
            let measured = measure(&mut frames, &mut detector, &options, report.repeat)?;
            report.launches = detector.report().launches;
            report.phases_ms = measured.phases();
            let counting = DetectorOptions { counting: Counting::Operations, ..with };
            let mut detector = Detector::new(&device, &frames.scene, counting).map_err(Failure::new)?;
            let operations = measure(&mut frames, &mut detector, &options, 1)?;
            let unpruned = DetectorOptions { pruning: Pruning::Bounds, ..with };
            let mut detector = Detector::new(&device, &frames.scene, unpruned).map_err(Failure::new)?;
            let all = measure(&mut frames, &mut detector, &options, 1)?;
            report.phases_unpruned_ms = Some(all.phases());
            report.counts = measured.counts;
            report.counts.queries_unpruned = Some(all.counts.queries);
            let is_face = args.mode == ModeName::Face;
            report.counts.evaluations = operations.counts.evaluations.filter(|_| is_face);
            report.counts.distances = operations.counts.distances.filter(|_| is_face);
            report.stages = measured.stages;
            report.bytes = Some(measured.bytes);
            report.wall_ms = measured.wall_ms;
            if args.against_cpu {
                let (cpu, _) = on_processor(&mut frames, &options, report.repeat)?;
                report.cpu_over_device = Some(cpu.mean / report.wall_ms.mean);
                report.cpu_wall_ms = Some(cpu);
            }
        }
        None => (report.wall_ms, report.counts) = on_processor(&mut frames, &options, report.repeat)?,
    }
    if args.json {
        report::json(&report)?;
    } else {
        report::text(&text(&report))?;
    }
    Ok(Outcome::Good)
}

fn on_processor(
    frames: &mut Frames,
    options: &CollideOptions,
    repeat: u32,
) -> Result<(Spread, Counts), Failure> {
    let (mut times, mut found) = (Vec::new(), Vec::new());
    for frame in 0..frames.poses.len() {
        frames.show(frame)?;
        for _ in 0..repeat {
            let start = Instant::now();
            let contacts = detect(&frames.scene, options).map_err(Failure::new)?;
            times.push(ms(start.elapsed()));
            found.push(contacts.statistics);
        }
    }
    let spread = |value: fn(&tesdf::collide::Statistics) -> usize| {
        Spread::of(found.iter().map(|s| value(s) as f64).collect())
    };
    let counts = Counts {
        directions: spread(|s| s.instance_pairs),
        candidates: spread(|s| s.candidates),
        queries: spread(|s| s.polygons),
        contacts: spread(|s| s.touching - s.filtered),
        filtered: spread(|s| s.filtered),
        kept: (options.reduction != Reduction::None).then(|| spread(|s| s.touching - s.filtered - s.reduced)),
        ..Counts::default()
    };
    Ok((Spread::of(times), counts))
}

struct Measured {
    stages: Vec<Stage>,
    counts: Counts,
    bytes: Bytes,
    wall_ms: Spread,
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
    let (mut walls, mut reports) = (Vec::new(), Vec::new());
    for frame in 0..frames.poses.len() {
        frames.show(frame)?;
        // Buffers grow, and kernels are compiled, before anything is measured.
        detector.detect(&frames.scene, options).map_err(Failure::new)?;
        for _ in 0..repeat {
            let start = Instant::now();
            detector.detect(&frames.scene, options).map_err(Failure::new)?;
            walls.push(ms(start.elapsed()));
            detector.detect_timed(&frames.scene, options).map_err(Failure::new)?;
            reports.push(detector.report().clone());
        }
    }
    let stage = |k: usize| {
        let name = reports[0].stages[k].0;
        let ms = Spread::of(reports.iter().map(|r| ms(r.stages[k].1)).collect());
        Stage { name, phase: phase(&reports[0].stages, k), ms }
    };
    let stages = (0..reports.first().map_or(0, |r| r.stages.len())).map(stage).collect();
    let count = |k: usize| Spread::of(reports.iter().map(|r| f64::from(r.counts[k])).collect());
    let bytes = |value: fn(&tesdf_gpu::DeviceReport) -> usize| {
        Spread::of(reports.iter().map(|r| value(r) as f64).collect())
    };
    let held = detector.bytes();
    Ok(Measured {
        stages,
        counts: Counts {
            directions: count(0),
            meshlets: count(2),
            queries: count(3),
            contacts: count(4),
            filtered: count(5),
            kept: (options.reduction != Reduction::None).then(|| count(14)),
            candidates: count(6),
            queries_unpruned: None,
            evaluations: Some(count(8)),
            distances: Some(count(9)),
        },
        bytes: Bytes {
            sent: bytes(|r| r.sent),
            read: bytes(|r| r.read),
            shapes_table: held.shapes.table,
            shapes_words: held.shapes.words,
            shapes_rows: held.shapes.rows,
            products: held.products.iter().map(|(_, bytes)| bytes).sum(),
            total: held.with_instances(frames.scene.instances().len()),
            per_instance: held.per_instance,
            products_by_buffer: held.products,
        },
        wall_ms: Spread::of(walls),
    })
}

fn text(r: &Report) -> String {
    let mut text = String::new();
    let mut line = |name: &str, value: String| {
        let _ = writeln!(text, "{name:<28} {value}");
    };
    let spread = |s: &Spread| format!("{:.0} on average, {:.0} at most", s.mean, s.max);
    let times = |s: &Spread| format!("{:.4} ms on average, p99 {:.4}, at most {:.4}", s.mean, s.p99, s.max);
    line("device", r.device.clone());
    line(
        "scene",
        format!(
            "{} instances in {} worlds, {} frames, {} times each",
            r.instances, r.worlds, r.frames, r.repeat
        ),
    );
    line("ordered pairs", spread(&r.counts.directions));
    if r.launches > 0 {
        line("meshlets", spread(&r.counts.meshlets));
    }
    line("faces or nodes", spread(&r.counts.candidates));
    line("narrow-phase queries", spread(&r.counts.queries));
    if let Some(all) = &r.counts.queries_unpruned {
        line("  without pruning", spread(all));
    }
    if let (Some(evaluations), Some(distances)) = (&r.counts.evaluations, &r.counts.distances) {
        line("  evaluations", spread(evaluations));
        line("  distances", spread(distances));
    }
    line("contacts", spread(&r.counts.contacts));
    line("  filtered", spread(&r.counts.filtered));
    if let Some(kept) = &r.counts.kept {
        line("  kept", spread(kept));
    }
    if r.launches > 0 {
        line("launches", r.launches.to_string());
    }
    for stage in &r.stages {
        line(&format!("{} {}", stage.phase, stage.name), times(&stage.ms));
    }
    let phases = |p: &[(&str, f64); 3]| {
        let sum: f64 = p.iter().map(|(_, ms)| ms).sum();
        format!("{:.4} / {:.4} / {:.4} ms, together {sum:.4} ms", p[0].1, p[1].1, p[2].1)
    };
    if r.launches > 0 {
        line("BP / MP / NP", phases(&r.phases_ms));
    }
    if let Some(all) = &r.phases_unpruned_ms {
        line("  without pruning", phases(all));
    }
    line("poses to contacts", times(&r.wall_ms));
    if let (Some(cpu), Some(ratio)) = (&r.cpu_wall_ms, r.cpu_over_device) {
        line("  on the processor", format!("{}: {ratio:.2} times as long", times(cpu)));
    }
    if let Some(b) = &r.bytes {
        line("bytes sent, read", format!("{}, {}", size(b.sent.mean as usize), size(b.read.mean as usize)));
        line("bytes held", size(b.total));
        line("  shapes", size(b.shapes_table + b.shapes_words + b.shapes_rows));
        line("  instances", format!("{}, {} each", size(r.instances * b.per_instance), b.per_instance));
        for (name, bytes) in &b.products_by_buffer {
            line(&format!("  {name}"), size(*bytes));
        }
    }
    text
}
