//! The figures of `tesdf-lab collide`, as JSON and as text.
use std::fmt::Write as _;
use std::time::Duration;

use serde::Serialize;
use tesdf::collide::ModeChoices;
use tesdf_cli::terminal::report::size;

use super::arguments::LanesName;

/// Mean, median, 99th percentile and maximum of a series.
#[derive(Clone, Copy, Debug, Default, Serialize)]
pub struct Spread {
    pub mean: f64,
    /// Unlike the mean, it leaves out the first detection of a pair, which makes data that later
    /// ones use.
    pub median: f64,
    pub p99: f64,
    pub max: f64,
}

impl Spread {
    /// The figures of a series of values.
    pub fn of(mut values: Vec<f64>) -> Self {
        values.sort_unstable_by(f64::total_cmp);
        let last = values.len().saturating_sub(1);
        let at = |share: f64| values.get((share * last as f64).ceil() as usize).copied().unwrap_or(0.0);
        let mean = values.iter().sum::<f64>() / values.len().max(1) as f64;
        Self { mean, median: at(0.5), p99: at(0.99), max: at(1.0) }
    }
}

#[derive(Serialize)]
pub struct Stage {
    pub name: &'static str,
    /// `BP`, `MP` or `NP` for the paper's broad, middle and narrow phase; `hidden overlaps` or
    /// `reduction`.
    pub phase: &'static str,
    pub ms: Spread,
}

#[derive(Default, Serialize)]
pub struct Counts {
    pub directions: Spread,
    pub meshlets: Spread,
    pub candidates: Spread,
    pub queries: Spread,
    /// The queries without pruning by smallest signed distances.
    pub queries_unpruned: Option<Spread>,
    pub contacts: Spread,
    pub filtered: Spread,
    /// The contacts that a reduction keeps.
    pub kept: Option<Spread>,
    /// In the mode `face`: evaluations of the field, and point–triangle distances of the lists.
    pub evaluations: Option<Spread>,
    pub distances: Option<Spread>,
}

#[derive(Serialize)]
pub struct Bytes {
    pub sent: Spread,
    pub read: Spread,
    pub shapes_table: usize,
    pub shapes_words: usize,
    pub shapes_rows: usize,
    pub products: usize,
    pub products_by_buffer: Vec<(&'static str, usize)>,
    pub per_instance: usize,
    /// Shapes, pipeline buffers and instances.
    pub total: usize,
}

#[derive(Serialize)]
pub struct Report {
    pub source: String,
    pub device: String,
    #[serde(flatten)]
    pub mode: ModeChoices,
    pub contact_distance: f64,
    /// Preset of the encoder for the meshes of a file of poses.
    pub preset: &'static str,
    pub e_max: Option<u32>,
    pub lanes: LanesName,
    pub worlds: u32,
    pub instances: usize,
    pub frames: usize,
    pub repeat: u32,
    /// Number of launches of a detection.
    pub launches: usize,
    pub stages: Vec<Stage>,
    /// Device time of each phase; also without pruning, for comparison.
    pub phases_ms: [(&'static str, f64); 3],
    pub phases_unpruned_ms: Option<[(&'static str, f64); 3]>,
    pub counts: Counts,
    /// Hash of all contacts of all frames.
    pub contacts_hash: String,
    pub bytes: Option<Bytes>,
    /// Time from the poses to the contacts in host memory.
    pub wall_ms: Spread,
    /// The same time for a detection on the processor.
    pub cpu_wall_ms: Option<Spread>,
    /// Time on the processor divided by the time on the device.
    pub cpu_over_device: Option<f64>,
}

pub const PHASES: [&str; 3] = ["BP", "MP", "NP"];

/// A duration in milliseconds.
pub fn ms(time: Duration) -> f64 {
    time.as_secs_f64() * 1e3
}

/// The figures as lines of text.
pub fn text(r: &Report) -> String {
    let mut text = String::new();
    let mut line = |name: &str, value: String| {
        let _ = writeln!(text, "{name:<28} {value}");
    };
    let spread = |s: &Spread| format!("{:.0} on average, {:.0} at most", s.mean, s.max);
    let times = |s: &Spread| {
        let Spread { mean, median, p99, max } = s;
        format!("{mean:.4} ms on average, median {median:.4}, p99 {p99:.4}, at most {max:.4}")
    };
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
    line("faces or vertices", spread(&r.counts.candidates));
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
    line("  hash of all", r.contacts_hash.clone());
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
