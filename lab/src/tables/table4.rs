//! Table IV: the shaft with increasing maximum list lengths.
use crate::on_grid::BandReport;
use serde::Serialize;
use tesdf::TeSdf;
use tesdf::encode::Deformation;

use super::domains::open;
use super::measure::{Cells, Cost, Setup, compare};
use super::meshes::{MESHES, SHAFT};
use super::output::{Sink, Text, band, error, or_dash, short};
use super::{TableArgs, paper};
use tesdf_cli::terminal::report::{Failure, note};

/// The output of `--format json`.
#[derive(Serialize)]
struct Table {
    table: u32,
    /// Number of voxels along the diagonal.
    grid: u32,
    rows: Vec<Row>,
}

/// The shaft in a domain, encoded by an encoder, or the paper's figures.
#[derive(Serialize)]
struct Row {
    /// `paper` or `tesdf`.
    from: &'static str,
    domain: String,
    encoder: String,
    columns: Vec<Column>,
}

/// The figures for one E_max.
#[derive(Serialize)]
struct Column {
    max_entries: u32,
    memory_mib: f64,
    max_error_percent: Option<f64>,
    exactness_band: Option<f64>,
    one_percent_band: Option<f64>,
    longest_list: Option<usize>,
    list_mean: Option<f64>,
    on_grid: Option<BandReport>,
}

impl Column {
    fn of(max_entries: u32, cost: &Cost, on_grid: BandReport) -> Self {
        Self {
            max_entries,
            memory_mib: cost.memory_mib,
            max_error_percent: on_grid.max_error_percent,
            exactness_band: on_grid.exactness_band,
            one_percent_band: on_grid.one_percent_band,
            longest_list: Some(cost.longest_list),
            list_mean: Some(cost.list_mean),
            on_grid: Some(on_grid),
        }
    }
}

fn paper_row() -> Row {
    let column = |c: &paper::Table4| Column {
        max_entries: c.max_entries,
        memory_mib: c.memory,
        max_error_percent: Some(c.max_error_percent),
        exactness_band: Some(c.exactness_band),
        one_percent_band: Some(c.one_percent_band),
        longest_list: None,
        list_mean: None,
        on_grid: None,
    };
    Row {
        from: "paper",
        domain: "Gmsh".into(),
        encoder: "256 / 1e-7".into(),
        columns: paper::TABLE_4.iter().map(column).collect(),
    }
}

/// Measures and prints the table.
///
/// # Errors
/// The same errors as [`run`](super::run).
pub fn run(args: &TableArgs, sink: &Sink) -> Result<(), Failure> {
    let fineness = args.fineness();
    let sampler = args.device.sampler()?;
    let mut table = Table { table: 4, grid: fineness, rows: vec![paper_row()] };
    let Some(mesh) = MESHES.iter().find(|m| m.path == SHAFT) else { return Ok(()) };
    for &domain in &args.domain {
        let subject = open(mesh, &args.data, domain)?;
        let mut setups = vec![
            Setup::certified(&subject, Cells::Plain, Deformation::None).with_preset(args.preset),
            Setup::sampled(&subject, args.resolution(mesh), mesh.threshold, Deformation::None)
                .with_preset(args.preset),
        ];
        if subject.conforming.is_some() {
            setups.push(
                Setup::certified(&subject, Cells::Bisected, Deformation::None).with_preset(args.preset),
            );
        }
        // One pass over the grid compares all assets.
        let mut assets: Vec<TeSdf> = Vec::new();
        // For each set of options, the asset of each column.
        let mut columns: Vec<Vec<usize>> = Vec::new();
        for setup in &setups {
            note(&format!("{}, {}, {}", mesh.name, setup.domain, setup.encoder));
            let (full, _) = setup.encode(&subject, &*sampler)?;
            let longest = full.about().statistics.longest_list;
            let whole = assets.len();
            assets.push(full);
            let mut at = Vec::new();
            for column in &paper::TABLE_4 {
                if longest <= column.max_entries as usize {
                    at.push(whole);
                } else {
                    at.push(assets.len());
                    assets.push(setup.truncated(column.max_entries).encode(&subject, &*sampler)?.0);
                }
            }
            columns.push(at);
        }
        let reports = compare(&assets.iter().collect::<Vec<_>>(), fineness)?;
        let costs: Vec<Cost> = assets.iter().map(Cost::of).collect();
        for (setup, at) in setups.into_iter().zip(columns) {
            let column =
                |(c, at): (&paper::Table4, usize)| Column::of(c.max_entries, &costs[at], reports[at].clone());
            let columns = paper::TABLE_4.iter().zip(at).map(column).collect();
            table.rows.push(Row { from: "tesdf", domain: setup.domain, encoder: setup.encoder, columns });
        }
    }
    sink.print(&table, &csv(&table.rows), &markdown(&table))
}

fn csv(rows: &[Row]) -> Text {
    let columns = [
        "from",
        "domain",
        "encoder",
        "max_entries",
        "memory_mib",
        "max_error_percent",
        "exactness_band",
        "one_percent_band",
        "longest_list",
        "list_mean",
        "exactness_width",
        "cells_inexact",
        "points",
    ]
    .map(str::to_string)
    .to_vec();
    let text = |v: Option<f64>| v.map_or(String::new(), |v| v.to_string());
    let line = |row: &Row, c: &Column| {
        let on_grid = |get: fn(&BandReport) -> f64| text(c.on_grid.as_ref().map(get));
        vec![
            row.from.to_string(),
            row.domain.clone(),
            row.encoder.clone(),
            c.max_entries.to_string(),
            c.memory_mib.to_string(),
            text(c.max_error_percent),
            text(c.exactness_band),
            text(c.one_percent_band),
            text(c.longest_list.map(|l| l as f64)),
            text(c.list_mean),
            on_grid(|r| r.exactness_width),
            on_grid(|r| r.cells_inexact as f64),
            on_grid(|r| r.points as f64),
        ]
    };
    Text {
        columns,
        rows: rows.iter().flat_map(|row| row.columns.iter().map(move |c| line(row, c))).collect(),
    }
}

fn markdown(table: &Table) -> String {
    let mut columns = vec!["", "domain", "Q / ε"];
    let steps: Vec<String> = paper::TABLE_4.iter().map(|c| c.max_entries.to_string()).collect();
    columns.extend(steps.iter().map(String::as_str));
    type Get = fn(&Column) -> Option<String>;
    let figures: [(&str, Get); 6] = [
        ("memory, MiB", |c| Some(format!("{:.3}", c.memory_mib))),
        ("max error, %", |c| match &c.on_grid {
            Some(on_grid) => error(on_grid),
            None => c.max_error_percent.map(short),
        }),
        ("exactness band", |c| c.exactness_band.map(band)),
        ("1 % band", |c| c.one_percent_band.map(band)),
        ("exact up to, m", |c| c.on_grid.as_ref().map(|r| format!("{:.1e}", r.exactness_width))),
        ("longest list", |c| c.longest_list.map(|l| l.to_string())),
    ];
    let mut rows = Vec::new();
    for (name, get) in figures {
        for row in &table.rows {
            let name = if row.from == "paper" { format!("*{name}, paper*") } else { name.into() };
            let mut cells = vec![name, row.domain.clone(), row.encoder.clone()];
            cells.extend(row.columns.iter().map(|c| or_dash(get(c))));
            rows.push(cells);
        }
    }
    let on_grid = table.rows.iter().rev().find_map(|row| row.columns.first()?.on_grid.as_ref());
    let points = on_grid.map_or(0, |r| r.points);
    let text = Text { columns: columns.into_iter().map(str::to_string).collect(), rows }.markdown(3);
    format!(
        "{}\nThe shaft by E_max. Grid: {} voxels along the diagonal, {points} points in the last domain.\n\n{text}",
        crate::heading::lines(),
        table.grid
    )
}
