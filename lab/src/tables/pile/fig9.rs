//! Figure 9: time of the narrow phase of Face-TES at the start and the end of the pile, by E_max.
use std::time::Instant;

use serde::Serialize;
use tesdf::collide::{CollideOptions, Mode, Pose, detect};
use tesdf_sim::scene_file::DetectorMode;
use tesdf_sim::{RunRecord, System};

use super::plot::{Curve, Plot, Scale};
use super::scene::Pile;
use super::{PileArgs, Shaft, Study};
use crate::detection::frames::Frames;
use crate::detection::report::{Spread, ms};
use crate::tables::detector::Shared;
use crate::tables::output::{Text, or_dash, short};
use crate::tables::paper;
use tesdf_cli::terminal::device::Device;
use tesdf_cli::terminal::progress::Bar;
use tesdf_cli::terminal::report::{Failure, note};

/// Arguments of Figure 9.
#[derive(clap::Args, Clone, Debug)]
pub struct Args {
    /// What both figures need.
    #[command(flatten)]
    pub pile: PileArgs,
    /// Number of measurements per setting [default: 9; with --quick 2]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=100_000))]
    pub repeat: Option<u32>,
}

#[derive(Serialize)]
struct Settings {
    repeat: u32,
}

type Figure = super::Figure<Settings, Row>;

/// A frame of the pile, detected with lists of at most E_max faces.
#[derive(Clone, Debug, Serialize)]
struct Row {
    domain: String,
    /// `start` or `end`.
    frame: &'static str,
    max_entries: u32,
    longest_list: usize,
    list_mean: f64,
    /// Polygons in cells that reach the narrow phase.
    queries: usize,
    /// Evaluations of the field, and point–triangle distances in them; a device counts them.
    evaluations: Option<usize>,
    distances: Option<usize>,
    contacts: usize,
    /// Median time of the narrow phase alone, ms; known for a device.
    narrow_ms: Option<f64>,
    /// Median time of the whole detection, ms.
    detection_ms: f64,
    /// The time of the narrow phase (on the processor: of the detection), relative to that of the
    /// smallest E_max.
    ratio: f64,
}

impl Row {
    fn time(&self) -> f64 {
        self.narrow_ms.unwrap_or(self.detection_ms)
    }

    /// The row without figures of a detection.
    fn new(shaft: &Shaft, frame: &'static str, setting: &Setting) -> Self {
        Self {
            domain: shaft.domain().into(),
            frame,
            max_entries: setting.max_entries,
            longest_list: setting.longest_list,
            list_mean: setting.list_mean,
            queries: 0,
            evaluations: None,
            distances: None,
            contacts: 0,
            narrow_ms: None,
            detection_ms: 0.0,
            ratio: 1.0,
        }
    }
}

/// The pile with lists of at most E_max faces.
struct Setting {
    max_entries: u32,
    longest_list: usize,
    list_mean: f64,
    system: System,
}

impl Setting {
    fn new(pile: &Pile, shaft: &Shaft, max_entries: u32) -> Result<Self, Failure> {
        let asset = shaft.encode(Some(max_entries))?;
        let cost = crate::tables::measure::Cost::of(&asset);
        let (longest_list, list_mean) = (cost.longest_list, cost.list_mean);
        Ok(Self { max_entries, longest_list, list_mean, system: pile.with(asset)? })
    }

    fn frames(&self, poses: &[Pose]) -> Frames {
        Frames { scene: self.system.scene().clone(), poses: vec![poses.to_vec()], contact_distance: None }
    }
}

/// Face-TES with the paper's parameters.
fn face_tes() -> CollideOptions {
    CollideOptions::with_mode(Mode::PAPER)
}

impl Args {
    fn max_entries(&self) -> Vec<u32> {
        let all = paper::TABLE_4.iter().map(|column| column.max_entries);
        // The first, the middle and the last setting.
        all.step_by(if self.pile.quick { 4 } else { 1 }).collect()
    }

    fn repeat(&self) -> u32 {
        self.repeat.unwrap_or(if self.pile.quick { 2 } else { 9 })
    }
}

/// Simulates the pile, detects its first and its last frame with all settings, and prints the
/// times.
///
/// # Errors
/// The scene or the mesh cannot be read, the device is missing or fails, or the result cannot be
/// written.
pub fn run(args: &Args) -> Result<(), Failure> {
    let pile_args = &args.pile;
    let bar = Bar::new("encoding");
    let device = pile_args.device.open()?;
    let study = Study::open(pile_args, 9)?;
    let pile = &study.pile;
    bar.stage("simulating");
    let (record, _) =
        pile.simulate(pile.exact.clone(), DetectorMode::Exact, Shared::open(&Default::default())?, &bar)?;
    let device_name = device.as_ref().map_or("cpu".into(), |device| device.name().to_string());
    let mut figure: Figure = study.figure(pile_args, device_name, Settings { repeat: args.repeat() });
    for &domain in &pile_args.domain {
        let shaft = Shaft::open(pile_args, domain)?;
        bar.stage("encoding");
        let settings = args.max_entries().into_iter().map(|e| Setting::new(pile, &shaft, e));
        let settings = settings.collect::<Result<Vec<_>, _>>()?;
        for (frame, step) in [("start", 0), ("end", record.steps() as usize)] {
            bar.stage("detecting");
            let poses = poses(&record, step)?;
            let mut rows: Vec<Row> = settings.iter().map(|s| Row::new(&shaft, frame, s)).collect();
            let frames = settings.iter().map(|setting| setting.frames(&poses)).collect::<Vec<_>>();
            match &device {
                Some(device) => on_device(device, frames, args.repeat(), &mut rows, &bar)?,
                None => on_processor(frames, args.repeat(), &mut rows, &bar)?,
            }
            let least = rows[0].time();
            for row in &mut rows {
                row.ratio = row.time() / least;
                note(&format!("{frame}, E_max {}: {} ms", row.max_entries, short(row.time())));
            }
            figure.rows.extend(rows);
        }
    }
    study.print(&figure, &csv(&figure), &markdown(&figure), &plot(&figure))
}

fn poses(record: &RunRecord, step: usize) -> Result<Vec<Pose>, Failure> {
    let poses = (0..record.bodies.len()).map(|body| record.pose(step, body)).collect::<Option<_>>();
    poses.ok_or_else(|| Failure::new(format!("the run has no frame {step}")))
}

/// Detects all settings in turn, again and again, so that other work of the machine slows all of
/// them down alike.
fn on_processor(mut frames: Vec<Frames>, repeat: u32, rows: &mut [Row], bar: &Bar) -> Result<(), Failure> {
    let options = face_tes();
    let mut times = vec![Vec::new(); rows.len()];
    for (frames, row) in frames.iter_mut().zip(&mut *rows) {
        frames.show(0)?;
        // The first detection is not timed: it reads the memory for the first time.
        let found = detect(&frames.scene, &options).map_err(Failure::new)?.statistics;
        row.queries = found.polygons;
        row.contacts = found.touching - found.filtered;
    }
    for round in 0..repeat {
        bar.set(f64::from(round) / f64::from(repeat));
        for (frames, times) in frames.iter().zip(&mut times) {
            let start = Instant::now();
            detect(&frames.scene, &options).map_err(Failure::new)?;
            times.push(ms(start.elapsed()));
        }
    }
    for (row, times) in rows.iter_mut().zip(times) {
        row.detection_ms = Spread::of(times).median;
    }
    Ok(())
}

#[cfg(feature = "gpu")]
fn on_device(
    device: &Device,
    mut frames: Vec<Frames>,
    repeat: u32,
    rows: &mut [Row],
    bar: &Bar,
) -> Result<(), Failure> {
    let count = rows.len();
    for (k, (frames, row)) in frames.iter_mut().zip(rows).enumerate() {
        bar.set(k as f64 / count as f64);
        let found = crate::detection::on_device::face_tes(&device.0, frames, &face_tes(), repeat)?;
        row.queries = found.counts.queries.max as usize;
        row.evaluations = found.counts.evaluations.map(|e| e.max as usize);
        row.distances = found.counts.distances.map(|d| d.max as usize);
        row.contacts = found.counts.contacts.max as usize;
        row.narrow_ms = Some(found.narrow_ms);
        row.detection_ms = found.wall_ms.median;
    }
    Ok(())
}

/// Without the GPU no value of `Device` exists.
#[cfg(not(feature = "gpu"))]
fn on_device(_: &Device, _: Vec<Frames>, _: u32, _: &mut [Row], _: &Bar) -> Result<(), Failure> {
    Ok(())
}

const COLUMNS: [&str; 12] = [
    "domain",
    "frame",
    "max_entries",
    "longest_list",
    "list_mean",
    "queries",
    "evaluations",
    "distances",
    "contacts",
    "narrow_ms",
    "detection_ms",
    "ratio",
];

fn csv(figure: &Figure) -> Text {
    let text = |v: Option<f64>| v.map_or(String::new(), |v| v.to_string());
    let count = |v: Option<usize>| v.map_or(String::new(), |v| v.to_string());
    let line = |row: &Row| {
        vec![
            row.domain.clone(),
            row.frame.into(),
            row.max_entries.to_string(),
            row.longest_list.to_string(),
            row.list_mean.to_string(),
            row.queries.to_string(),
            count(row.evaluations),
            count(row.distances),
            row.contacts.to_string(),
            text(row.narrow_ms),
            row.detection_ms.to_string(),
            row.ratio.to_string(),
        ]
    };
    Text { columns: COLUMNS.map(str::to_string).to_vec(), rows: figure.rows.iter().map(line).collect() }
}

fn markdown(figure: &Figure) -> String {
    let columns = [
        "domain",
        "frame",
        "E_max",
        "longest list",
        "mean list",
        "queries",
        "evaluations",
        "distances",
        "contacts",
        "narrow phase, ms",
        "detection, ms",
        "ratio",
    ];
    let count = |v: Option<usize>| or_dash(v.map(|v| v.to_string()));
    let line = |row: &Row| {
        vec![
            row.domain.clone(),
            row.frame.into(),
            row.max_entries.to_string(),
            row.longest_list.to_string(),
            short(row.list_mean),
            row.queries.to_string(),
            count(row.evaluations),
            count(row.distances),
            row.contacts.to_string(),
            or_dash(row.narrow_ms.map(short)),
            short(row.detection_ms),
            format!("{:.2}", row.ratio),
        ]
    };
    let of_paper = |(frame, queries): (&str, u32)| {
        let cells = ["*paper*", frame, "–", "–", "–", &queries.to_string(), "–", "–", "–", "–", "–", "–"];
        cells.map(str::to_string).to_vec()
    };
    let rows = paper::FIGURE_9_QUERIES.into_iter().map(of_paper).chain(figure.rows.iter().map(line));
    let text = Text { columns: columns.map(str::to_string).to_vec(), rows: rows.collect() }.markdown(2);
    format!(
        "{}\n{} shafts, Face-TES with K = 16 and cos θ = 0.3, one contact per face and cell, contact \
         distance 0. Found on: {}. Medians of {} measurements.\n\n{text}",
        crate::heading::lines(),
        figure.shafts,
        figure.device,
        figure.settings.repeat
    )
}

/// Times by E_max.
fn plot(figure: &Figure) -> Plot {
    let mut curves: Vec<Curve> = Vec::new();
    for row in &figure.rows {
        let name = format!("{}, {}", row.frame, row.domain);
        let point = [f64::from(row.max_entries), row.time()];
        match curves.iter_mut().find(|curve| curve.name == name) {
            Some(curve) => curve.points.push(point),
            None => curves.push(Curve { name, points: vec![point] }),
        }
    }
    let is_narrow = figure.rows.iter().all(|row| row.narrow_ms.is_some());
    let mut ticks: Vec<u32> = figure.rows.iter().map(|row| row.max_entries).collect();
    ticks.sort_unstable();
    ticks.dedup();
    Plot {
        axes: ["E_max", if is_narrow { "narrow phase, ms" } else { "detection, ms" }],
        scale: Scale::Linear,
        ticks: ticks.into_iter().map(f64::from).collect(),
        curves,
    }
}
