//! Table III as text.
use std::fmt::Write;

use super::cell::Cell;
use super::memory::Voxels;
use super::{Args, Features, Scenario, Table};
use crate::tables::output::{Text, or_dash, short};
use crate::tables::paper;

const MIB: f64 = 1024.0 * 1024.0;

/// A cell in one line.
pub fn line(cell: &Cell) -> String {
    let column = match cell.voxels {
        Some([moving, fixed]) => format!("voxels {moving}/{fixed}"),
        None => "encoded".into(),
    };
    let verdict = if cell.success { "success".into() } else { cell.failures.join("; ") };
    format!(
        "{}, {} µm, {} ms, {column}, {}: {verdict} ({:.1} s)",
        cell.scenario,
        cell.tolerance_um,
        cell.time_step_ms,
        cell.features.name(),
        cell.seconds
    )
}

pub fn csv(cells: &[Cell]) -> Text {
    let columns = [
        "scenario",
        "tolerance_um",
        "voxels_moving",
        "voxels_fixed",
        "features",
        "time_step_ms",
        "success",
        "reasons",
        "penetration_um",
        "travel_mm",
        "contacts",
        "steps",
        "detection_ms",
        "solution_ms",
        "seconds",
    ];
    let row = |cell: &Cell| {
        let quality = |k: usize| cell.voxels.map_or(String::new(), |q| q[k].to_string());
        vec![
            cell.scenario.to_string(),
            cell.tolerance_um.to_string(),
            quality(0),
            quality(1),
            cell.features.name().to_string(),
            cell.time_step_ms.to_string(),
            cell.success.to_string(),
            cell.reasons.join("; "),
            cell.penetration_um.to_string(),
            cell.travel_mm.to_string(),
            cell.contacts.to_string(),
            cell.steps.to_string(),
            cell.step_ms[0].to_string(),
            cell.step_ms[1].to_string(),
            cell.seconds.to_string(),
        ]
    };
    Text { columns: columns.map(str::to_string).to_vec(), rows: cells.iter().map(row).collect() }
}

pub fn markdown(args: &Args, table: &Table) -> String {
    let mut text = crate::heading::lines();
    let _ = write!(
        text,
        "\nS: success, F: failure, for each tolerance ([table3.csv](table3.csv) has the reasons). Columns: voxels \
         along the longest side of the moving and the fixed body, and meshes encoded with the preset {}. A dash: not \
         run. Memory in MiB.\n",
        table.preset
    );
    if table.quick {
        text += "Quick: a part of the table, and the nut for 0.06 s.\n";
    }
    for &scenario in &args.scenarios {
        let tolerances = args.tolerances(scenario);
        if tolerances.is_empty() {
            continue;
        }
        let _ = write!(text, "\n## {}: {} µm\n\n", scenario.name(), join(&tolerances));
        text += &verdicts(args, scenario, table).markdown(2);
    }
    text
}

fn join(values: &[u32]) -> String {
    values.iter().map(u32::to_string).collect::<Vec<_>>().join(" / ")
}

/// The table of a scene: verdicts, memory, errors.
fn verdicts(args: &Args, scenario: Scenario, table: &Table) -> Text {
    let qualities = args.qualities(scenario);
    let names = qualities.iter().map(|[moving, fixed]| format!("voxels {moving}/{fixed}"));
    let columns: Vec<String> =
        ["step, ms".to_string(), String::new()].into_iter().chain(names).chain(["encoded".into()]).collect();
    let all: Vec<Option<[u32; 2]>> = qualities.iter().copied().map(Some).chain([None]).collect();
    let mut rows = Vec::new();
    for step in args.time_steps() {
        for features in args.features() {
            let cells = all.iter().map(|voxels| letters(args, scenario, table, (step, features, *voxels)));
            rows.push([step.to_string(), features.name().into()].into_iter().chain(cells).collect());
        }
        if let Some((_, cells)) = scenario.paper().rows.iter().find(|(ms, _)| *ms == step) {
            let encoded = format!("node {}, face {}", cells[4], cells[5]);
            let voxels = cells[..qualities.len()].iter().map(|c| c.to_string());
            let start = [step.to_string(), "*paper*".into()];
            rows.push(start.into_iter().chain(voxels).chain([encoded]).collect());
        }
    }
    rows.extend(memory(args, scenario, table));
    Text { columns, rows }
}

/// S or F for each tolerance, or a dash.
fn letters(
    args: &Args,
    scenario: Scenario,
    table: &Table,
    (step, features, voxels): (f64, Features, Option<[u32; 2]>),
) -> String {
    let letter = |tolerance: u32| {
        let is_meant = |cell: &&Cell| {
            (cell.scenario, cell.tolerance_um, cell.time_step_ms, cell.features, cell.voxels)
                == (scenario.name(), tolerance, step, features, voxels)
        };
        table.cells.iter().find(is_meant).map_or("–", |cell| if cell.success { "S" } else { "F" })
    };
    args.tolerances(scenario).into_iter().map(letter).collect::<Vec<_>>().join("/")
}

/// Rows of memory, and of the greatest error of the grids. Where grids or assets differ by
/// tolerance, the largest figure.
fn memory(args: &Args, scenario: Scenario, table: &Table) -> Vec<Vec<String>> {
    let qualities = args.qualities(scenario);
    let paper::Table3 { memory: of_paper, .. } = scenario.paper();
    let encoded: Vec<_> = table.encoded.iter().filter(|e| e.scenario == scenario.name()).collect();
    let greatest = |values: &mut dyn Iterator<Item = f64>| values.reduce(f64::max);
    let grids = |body: &str, quality: u32, get: fn(&Voxels) -> f64| {
        let is_meant = |v: &&Voxels| v.body == body && v.quality == quality;
        greatest(&mut table.voxels.iter().filter(is_meant).map(get))
    };
    let [moving, fixed] = scenario.bodies();
    let sums = |get: fn(&Voxels) -> f64| {
        let of = |&[q, r]: &[u32; 2]| Some(grids(moving, q, get)? + grids(fixed, r, get)?);
        qualities.iter().map(move |q| or_dash(of(q).map(short))).collect::<Vec<_>>()
    };
    let row = |name: &str, voxels: Vec<String>, last: Option<f64>| {
        let start = ["memory".to_string(), name.to_string()];
        start.into_iter().chain(voxels).chain([or_dash(last.map(short))]).collect::<Vec<_>>()
    };
    let dashes = vec![or_dash(None); qualities.len()];
    let errors = |get: fn(&Voxels) -> f64| {
        let of = |&[q, r]: &[u32; 2]| {
            Some(format!("{} / {}", short(grids(moving, q, get)? * 1e6), short(grids(fixed, r, get)? * 1e6)))
        };
        qualities.iter().map(|q| or_dash(of(q))).collect::<Vec<_>>()
    };
    let error = |name: &str, get: fn(&Voxels) -> f64| {
        let start = ["error, µm".to_string(), name.to_string()];
        start.into_iter().chain(errors(get)).chain(["0".into()]).collect::<Vec<_>>()
    };
    let of_paper_voxels = of_paper[..qualities.len()].iter().map(|m| m.to_string()).collect();
    vec![
        row("dense grid", sums(|v| v.dense_bytes as f64 / MIB), None),
        row("sparse grid", sums(|v| v.sparse_bytes as f64 / MIB), None),
        row("paper's account", dashes.clone(), greatest(&mut encoded.iter().map(|e| e.paper_mib))),
        row("whole account", dashes, greatest(&mut encoded.iter().map(|e| e.whole_bytes as f64 / MIB))),
        row("*paper*", of_paper_voxels, Some(of_paper[4])),
        error("near the surface", |v| v.accuracy.max_error),
        error("on the surface", |v| v.accuracy.max_error_on_surface),
    ]
}
