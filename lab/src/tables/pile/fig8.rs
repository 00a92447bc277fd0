//! Figure 8: penetrations in the pile by frame, for each mode, with full and with truncated lists.
use std::path::PathBuf;

use serde::Serialize;
use tesdf::base::Named as _;
use tesdf_sim::criterion::{SeparationCriterion, SeparationReport, SeparationTracker, Tracker};
use tesdf_sim::scene_file::DetectorMode;
use tesdf_sim::{HiddenPair, RunRecord, Summary};

use super::plot::{Curve, Plot, Scale};
use super::scene::Pile;
use super::{PileArgs, Shaft, Study, e_max};
use crate::tables::detector::Shared;
use crate::tables::output::{Text, short};
use crate::tables::paper;
use tesdf_cli::terminal::output;
use tesdf_cli::terminal::progress::Bar;
use tesdf_cli::terminal::report::{Failure, note};

/// Arguments of Figure 8.
#[derive(clap::Args, Clone, Debug)]
pub struct Args {
    /// What both figures need.
    #[command(flatten)]
    pub pile: PileArgs,
    /// Write the runs to this folder, for `tesdf render --run`; it is created if necessary
    #[arg(long, value_name = "FOLDER")]
    pub runs: Option<PathBuf>,
}

#[derive(Serialize)]
struct Settings {
    time_step: f64,
    criterion: SeparationCriterion,
}

type Figure = super::Figure<Settings, Row>;

/// A run, and what it says.
#[derive(Serialize)]
struct Row {
    domain: String,
    mode: DetectorMode,
    /// E_max; null for full lists.
    max_entries: Option<u32>,
    longest_list: usize,
    /// Whether the run meets the criterion of the scene.
    success: bool,
    failures: Vec<String>,
    /// The greatest penetration of two bodies by frame, by the exact clearance, m.
    penetration: Vec<f64>,
    /// From this frame on, no penetration exceeds the first limit of the criterion; null when one
    /// does at the end.
    resolved_at: Option<usize>,
    /// The greatest kinetic energy, as a fraction of that of free fall.
    kinetic_energy: f64,
    most_contacts: usize,
    /// Mean wall time of a step, ms: detection, and the rest.
    step_ms: [f64; 2],
}

const MODES: [DetectorMode; 3] = [DetectorMode::Exact, DetectorMode::Face, DetectorMode::Node];

impl Row {
    fn new(
        shaft: &Shaft,
        (mode, max_entries, longest_list): (DetectorMode, Option<u32>, usize),
        summary: &Summary,
        measured: SeparationReport,
        limit: f64,
    ) -> Self {
        let SeparationReport { penetration, kinetic_energy, mut failures } = measured;
        failures.extend(summary.hidden.iter().map(HiddenPair::message));
        let last = penetration.iter().rposition(|&depth| depth > limit);
        let resolved = last.map_or(0, |frame| frame + 1);
        Self {
            domain: shaft.domain().into(),
            mode,
            max_entries,
            longest_list,
            success: failures.is_empty(),
            failures,
            resolved_at: (resolved < penetration.len()).then_some(resolved),
            penetration,
            kinetic_energy,
            most_contacts: summary.most_contacts,
            step_ms: [summary.detection_ms, summary.solution_ms],
        }
    }

    fn verdict(&self) -> &'static str {
        if self.success { "S" } else { "F" }
    }

    /// Mode, E_max and domain.
    fn title(&self) -> String {
        format!("{}, {}, {}", self.mode, e_max(self.max_entries), self.domain)
    }

    fn file_name(&self) -> String {
        let domain = self.domain.to_lowercase();
        format!("pile-{domain}-{}-{}.tesrun", self.mode, e_max(self.max_entries))
    }
}

/// Runs the pile with all modes and truncations, and prints the penetrations.
///
/// # Errors
/// The scene or the mesh cannot be read, the device is missing, a run breaks down, or the result
/// cannot be written.
pub fn run(args: &Args) -> Result<(), Failure> {
    let pile_args = &args.pile;
    let bar = Bar::new("encoding");
    let detector = Shared::open(&pile_args.device)?;
    let study = Study::open(pile_args, 8)?;
    let pile = &study.pile;
    let criterion = pile.loaded.scene.criterion.get::<SeparationCriterion>().cloned();
    let criterion = criterion.filter(|of| !of.limits.is_empty()).ok_or_else(|| {
        Failure::new(format!("{}: it has no criterion.separation", pile.loaded.path.display()))
    })?;
    let settings = Settings { time_step: pile.loaded.scene.time_step, criterion };
    let limit = settings.criterion.limits[0][1];
    let mut figure: Figure = study.figure(pile_args, pile_args.device.to_string(), settings);
    for &domain in &pile_args.domain {
        let shaft = Shaft::open(pile_args, domain)?;
        for max_entries in [Some(paper::FIGURE_8_MAX_ENTRIES), None] {
            bar.stage("encoding");
            let asset = shaft.encode(max_entries)?;
            let longest_list = asset.about().statistics.longest_list;
            let system = pile.with(asset)?;
            for mode in MODES {
                bar.stage("simulating");
                let (record, summary) = pile.simulate(system.clone(), mode, detector.clone(), &bar)?;
                bar.stage("measuring penetrations");
                let measured = measure(pile, &figure.settings.criterion, &record, &bar)?;
                let setting = (mode, max_entries, longest_list);
                let row = Row::new(&shaft, setting, &summary, measured, limit);
                note(&format!("{}: {} {}", row.title(), row.verdict(), row.failures.join("; ")));
                if let Some(folder) = &args.runs {
                    save(&record, folder, &row, pile_args)?;
                }
                figure.rows.push(row);
            }
        }
    }
    study.print(&figure, &csv(&figure), &markdown(&figure), &plot(&figure))
}

/// Measures the penetrations of a run. The fields are exact, whatever those of the run were.
fn measure(
    pile: &Pile,
    criterion: &SeparationCriterion,
    record: &RunRecord,
    bar: &Bar,
) -> Result<SeparationReport, Failure> {
    let mut system = pile.exact.clone();
    let steps = record.steps() as usize;
    let mut tracker = SeparationTracker::new(criterion, &system).map_err(Failure::new)?;
    for step in 1..=steps {
        system.set_states(record.states(step).unwrap_or_default()).map_err(Failure::new)?;
        tracker.observe(&system, pile.loaded.scene.time_step);
        bar.set(step as f64 / steps as f64);
    }
    Ok(tracker.report(&system))
}

fn save(record: &RunRecord, folder: &std::path::Path, row: &Row, args: &PileArgs) -> Result<(), Failure> {
    std::fs::create_dir_all(folder)
        .map_err(|e| Failure::new(format!("cannot make the folder {}: {e}", folder.display())))?;
    let file = output::open(&folder.join(row.file_name()), &[], args.output.consent)?;
    output::write(&file, &record.to_bytes().map_err(Failure::new)?)
}

/// One line for each run and frame.
fn csv(figure: &Figure) -> Text {
    let columns = ["domain", "mode", "max_entries", "success", "frame", "time_s", "penetration_m"];
    let line = |row: &Row, (frame, depth): (usize, &f64)| {
        vec![
            row.domain.clone(),
            row.mode.name().into(),
            e_max(row.max_entries),
            row.success.to_string(),
            frame.to_string(),
            (frame as f64 * figure.settings.time_step).to_string(),
            depth.to_string(),
        ]
    };
    let lines = |row| Row::penetrations(row).map(move |frame| line(row, frame)).collect::<Vec<_>>();
    Text { columns: columns.map(str::to_string).to_vec(), rows: figure.rows.iter().flat_map(lines).collect() }
}

impl Row {
    fn penetrations(&self) -> impl Iterator<Item = (usize, &f64)> {
        self.penetration.iter().enumerate()
    }
}

fn markdown(figure: &Figure) -> String {
    let columns = [
        "run",
        "domain",
        "mode",
        "E_max",
        "longest list",
        "criterion",
        "resolved at frame",
        "contacts, most",
        "detection, ms",
        "solver, ms",
        "kinetic energy",
    ];
    let claim = paper::FIGURE_8_RESOLVED_AT.to_string();
    let e_max_of_paper = paper::FIGURE_8_MAX_ENTRIES.to_string();
    let mut rows = vec![
        ["*paper*", "Gmsh", "face", &e_max_of_paper, "–", "–", &claim, "–", "–", "–", "–"]
            .map(str::to_string)
            .to_vec(),
    ];
    rows.extend(figure.rows.iter().enumerate().map(|(k, row)| {
        vec![
            (k + 1).to_string(),
            row.domain.clone(),
            row.mode.name().into(),
            e_max(row.max_entries),
            row.longest_list.to_string(),
            row.verdict().into(),
            row.resolved_at.map_or("–".into(), |frame| frame.to_string()),
            row.most_contacts.to_string(),
            short(row.step_ms[0]),
            short(row.step_ms[1]),
            format!("{:.3}", row.kinetic_energy),
        ]
    }));
    let runs = Text { columns: columns.map(str::to_string).to_vec(), rows }.markdown(4);
    let numbers = (1..=figure.rows.len()).map(|k| format!("run {k}"));
    let frames = figure.rows.iter().map(|row| row.penetration.len()).max().unwrap_or(0);
    let line = |frame: usize| {
        let depth =
            |row: &Row| row.penetration.get(frame).map_or("–".into(), |d| format!("{:.1}", d * 1e6));
        std::iter::once(frame.to_string()).chain(figure.rows.iter().map(depth)).collect()
    };
    let by_frame = Text {
        columns: std::iter::once("frame".to_string()).chain(numbers).collect(),
        rows: (0..frames).map(line).collect(),
    };
    let Settings { time_step, criterion } = &figure.settings;
    let limits = criterion.limits.iter();
    let limits = limits.map(|[t, d]| format!("{:.0} µm from frame {:.0} on", d * 1e6, t / time_step));
    format!(
        "{}\n{} shafts, steps of {} ms, contacts found on: {}. Criterion: {}; kinetic energy at most {} of \
         that of free fall. S: the run meets it, F: [fig8.json](fig8.json) says why not.\n\n{runs}\n\
         Greatest penetration by the exact clearance, µm:\n\n{}",
        crate::heading::lines(),
        figure.shafts,
        time_step * 1e3,
        figure.device,
        limits.collect::<Vec<_>>().join(", "),
        criterion.max_kinetic_energy,
        by_frame.markdown(0)
    )
}

/// The penetrations by frame, from 0.1 µm on.
fn plot(figure: &Figure) -> Plot {
    let micrometres = |row: &Row| row.penetrations().map(|(f, &depth)| [f as f64, depth * 1e6]).collect();
    let curves = figure.rows.iter().map(|row| Curve { name: row.title(), points: micrometres(row) });
    let frames = figure.rows.iter().map(|row| row.penetration.len()).max().unwrap_or(0);
    Plot {
        axes: ["frame", "penetration, µm"],
        scale: Scale::Logarithmic(0.1),
        ticks: (0..frames).step_by(2).map(|f| f as f64).collect(),
        curves: curves.collect(),
    }
}
