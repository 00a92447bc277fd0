//! Table I: each mesh with full lists and with at most 32 faces per list, by both encoders.
use crate::on_grid::BandReport;
use std::time::Instant;

use serde::Serialize;
use tesdf::TeSdf;
use tesdf::encode::{Deformation, Sampler};

use super::deformed::Bend;
use super::domains::{Subject, open};
use super::measure::{Cells, Cost, Setup, compare};
use super::meshes::{Deforms, MESHES, Mesh, Quick};
use super::output::{Sink, Text, band, error, or_dash, short, threshold};
use super::{TableArgs, paper};
use tesdf_cli::terminal::report::{Failure, note};

/// E_max of the truncated lists.
const MAX_ENTRIES: u32 = 32;

/// The output of `--format json`.
#[derive(Serialize)]
struct Table {
    table: u32,
    /// Number of voxels along the diagonal.
    grid: u32,
    max_entries: u32,
    rows: Vec<Row>,
}

/// A mesh in a domain, encoded by an encoder, or a row of the paper.
#[derive(Serialize)]
struct Row {
    name: String,
    /// `paper` or `tesdf`.
    from: &'static str,
    mesh: Option<String>,
    domain: String,
    /// `certified`, or Q / ε.
    encoder: String,
    /// Number of vertices of the surface and of the tetrahedra.
    vertices: usize,
    faces: usize,
    full: Figures,
    truncated: Figures,
    /// Encoding time of full lists, s; for a re-encoded asset the time of the stale cells.
    encode_seconds: Option<f64>,
    reencoded: Option<Reencoded>,
    /// Bending angle of a deformed body.
    bend_degrees: Option<f64>,
    twist_degrees: Option<f64>,
}

/// Numbers of cells in a re-encoding.
#[derive(Clone, Copy, Serialize)]
struct Reencoded {
    cells: usize,
    checked: usize,
    stale: usize,
}

/// Figures of an asset.
#[derive(Clone, Serialize)]
struct Figures {
    tetrahedra: usize,
    list_mean: Option<f64>,
    longest_list: Option<usize>,
    list_by_volume: Option<f64>,
    read_by_volume: Option<f64>,
    memory_mib: f64,
    whole_bytes: Option<usize>,
    max_error_percent: Option<f64>,
    exactness_band: Option<f64>,
    one_percent_band: Option<f64>,
    /// The report of the comparison on the grid.
    on_grid: Option<BandReport>,
}

impl Figures {
    fn of(cost: Cost, on_grid: BandReport) -> Self {
        Self {
            tetrahedra: cost.tetrahedra,
            list_mean: Some(cost.list_mean),
            longest_list: Some(cost.longest_list),
            list_by_volume: Some(cost.list_by_volume),
            read_by_volume: Some(cost.read_by_volume),
            memory_mib: cost.memory_mib,
            whole_bytes: Some(cost.whole_bytes),
            max_error_percent: on_grid.max_error_percent,
            exactness_band: on_grid.exactness_band,
            one_percent_band: on_grid.one_percent_band,
            on_grid: Some(on_grid),
        }
    }
}

fn paper_row(row: &paper::Table1) -> Row {
    let figures = |i: usize| Figures {
        tetrahedra: row.tetrahedra,
        list_mean: (i == 0).then_some(row.list_mean),
        longest_list: (i == 0).then_some(row.longest_list),
        list_by_volume: None,
        read_by_volume: None,
        memory_mib: row.memory[i],
        whole_bytes: None,
        max_error_percent: Some(row.max_error_percent[i]),
        exactness_band: Some(row.exactness_band[i]),
        one_percent_band: Some(row.one_percent_band[i]),
        on_grid: None,
    };
    Row {
        name: row.name.into(),
        from: "paper",
        mesh: None,
        domain: "Gmsh".into(),
        encoder: or_dash(row.sampling.map(|(q, epsilon)| format!("{q} / {}", threshold(epsilon)))),
        vertices: row.vertices,
        faces: row.faces,
        full: figures(0),
        truncated: figures(1),
        encode_seconds: None,
        reencoded: None,
        bend_degrees: None,
        twist_degrees: None,
    }
}

/// A mesh that was encoded with one set of options.
struct Made {
    setup: Setup,
    full: TeSdf,
    /// `None` when no list of the full asset exceeds the limit.
    truncated: Option<TeSdf>,
    seconds: f64,
}

impl Made {
    fn new(setup: Setup, subject: &Subject, sampler: &dyn Sampler) -> Result<Self, Failure> {
        let (full, seconds) = setup.encode(subject, sampler)?;
        let cut = full.about().statistics.longest_list > MAX_ENTRIES as usize;
        let truncated =
            cut.then(|| setup.truncated(MAX_ENTRIES).encode(subject, sampler)).transpose()?.map(|(a, _)| a);
        Ok(Self { setup, full, truncated, seconds })
    }

    fn assets(&self) -> impl Iterator<Item = &TeSdf> {
        std::iter::once(&self.full).chain(&self.truncated)
    }

    fn assets_mut(&mut self) -> impl Iterator<Item = &mut TeSdf> {
        std::iter::once(&mut self.full).chain(&mut self.truncated)
    }
}

/// The rows of these assets. One pass over the grid compares all of them with exact distances.
fn rows(mesh: &Mesh, subject: &Subject, made: &[Made], fineness: u32) -> Result<Vec<Row>, Failure> {
    let assets: Vec<&TeSdf> = made.iter().flat_map(Made::assets).collect();
    let mut reports = compare(&assets, fineness)?.into_iter();
    let mut figures = |asset: &TeSdf| reports.next().map(|report| Figures::of(Cost::of(asset), report));
    let mut rows = Vec::new();
    for made in made {
        let Some(full) = figures(&made.full) else { break };
        let truncated = made.truncated.as_ref().and_then(&mut figures).unwrap_or_else(|| full.clone());
        let solid = subject.solid.mesh();
        rows.push(Row {
            name: mesh.name.into(),
            from: "tesdf",
            mesh: Some(mesh.path.into()),
            domain: made.setup.domain.clone(),
            encoder: made.setup.encoder.clone(),
            vertices: subject.conforming.as_ref().map_or(solid.vertices().len(), |d| d.vertices().len()),
            faces: solid.faces().len(),
            full,
            truncated,
            encode_seconds: Some(made.seconds),
            reencoded: None,
            bend_degrees: None,
            twist_degrees: None,
        });
    }
    Ok(rows)
}

/// Measures and prints the table.
///
/// # Errors
/// The same errors as [`run`](super::run).
pub fn run(args: &TableArgs, sink: &Sink) -> Result<(), Failure> {
    let fineness = args.fineness();
    let sampler = args.device.sampler()?;
    let mut table = Table { table: 1, grid: fineness, max_entries: MAX_ENTRIES, rows: Vec::new() };
    for mesh in chosen(args)? {
        let mut domains = args.domain.clone();
        if mesh.path.ends_with(".ele") {
            domains.truncate(1);
        }
        table.rows.extend(mesh.paper.iter().filter_map(|name| paper::table_1(name)).map(paper_row));
        for domain in domains {
            note(&format!("{}, {domain:?}", mesh.name));
            let subject = open(mesh, &args.data, domain)?;
            measure(mesh, &subject, args, &*sampler, fineness, &mut table.rows)?;
        }
    }
    sink.print(&table, &csv(&table.rows), &markdown(&table))
}

fn chosen(args: &TableArgs) -> Result<Vec<&'static Mesh>, Failure> {
    let names = || MESHES.iter().map(|m| m.name).collect::<Vec<_>>().join(", ");
    if let Some(wrong) = args.meshes.iter().flatten().find(|n| MESHES.iter().all(|m| m.name != **n)) {
        return Err(Failure::new(format!("there is no mesh {wrong} in the table; expected {}", names())));
    }
    let wanted = |mesh: &&Mesh| match &args.meshes {
        Some(names) => names.iter().any(|n| n == mesh.name),
        None => !args.quick || mesh.quick == Quick::Yes,
    };
    Ok(MESHES.iter().filter(wanted).collect())
}

fn measure(
    mesh: &Mesh,
    subject: &Subject,
    args: &TableArgs,
    sampler: &dyn Sampler,
    fineness: u32,
    table: &mut Vec<Row>,
) -> Result<(), Failure> {
    let deforms = subject.conforming.is_some() && mesh.deforms == Deforms::Yes;
    let deformation = if deforms { Deformation::Expected } else { Deformation::None };
    let setups = [
        Setup::certified(subject, Cells::Plain, deformation).with_preset(args.preset),
        Setup::sampled(subject, args.resolution(mesh), mesh.threshold, deformation).with_preset(args.preset),
    ];
    let mut made =
        setups.into_iter().map(|setup| Made::new(setup, subject, sampler)).collect::<Result<Vec<_>, _>>()?;
    if subject.conforming.is_some() {
        made.push(Made::new(
            Setup::certified(subject, Cells::Bisected, deformation).with_preset(args.preset),
            subject,
            sampler,
        )?);
    }
    table.extend(rows(mesh, subject, &made, fineness)?);
    let Some(domain) = subject.conforming.as_ref().filter(|_| deforms) else { return Ok(()) };

    let bend = Bend::of(domain);
    for asset in made.iter_mut().flat_map(Made::assets_mut) {
        bend.move_vertices(asset, domain)?;
    }
    let moved = |row: &mut Row, name: &str| {
        row.bend_degrees = Some(bend.bend.to_degrees());
        row.twist_degrees = Some(bend.twist.to_degrees());
        row.name = format!("{name}, bent {:.0}°", bend.bend.to_degrees());
    };
    let mut bent = rows(mesh, subject, &made, fineness)?;
    for row in &mut bent {
        row.encode_seconds = None;
        moved(row, &format!("deformed {}", mesh.name));
    }
    table.extend(bent);

    let mut reencoded = Vec::new();
    for made in &mut made {
        let start = Instant::now();
        let found = made.full.reencode_stale().map_err(Failure::new)?;
        made.seconds = start.elapsed().as_secs_f64();
        reencoded.push(Reencoded { cells: found.cells, checked: found.checked, stale: found.stale.len() });
        if let Some(truncated) = &mut made.truncated {
            truncated.reencode_stale().map_err(Failure::new)?;
        }
    }
    let mut again = rows(mesh, subject, &made, fineness)?;
    for (row, reencoded) in again.iter_mut().zip(reencoded) {
        row.reencoded = Some(reencoded);
        moved(row, &format!("deformed {}, re-encoded", mesh.name));
    }
    table.extend(again);
    Ok(())
}

fn csv(rows: &[Row]) -> Text {
    let columns = [
        "name",
        "from",
        "mesh",
        "domain",
        "encoder",
        "max_entries",
        "vertices",
        "faces",
        "tetrahedra",
        "list_mean",
        "longest_list",
        "list_by_volume",
        "read_by_volume",
        "memory_mib",
        "whole_bytes",
        "max_error_percent",
        "exactness_band",
        "one_percent_band",
        "exactness_width",
        "cells_inexact",
        "max_error",
        "points",
        "points_inside",
        "points_by_tree",
        "voxel",
        "encode_seconds",
        "cells_stale",
    ]
    .map(str::to_string)
    .to_vec();
    let text = |v: Option<f64>| v.map_or(String::new(), |v| v.to_string());
    let count = |v: Option<usize>| v.map_or(String::new(), |v| v.to_string());
    let line = |row: &Row, max_entries: String, f: &Figures| {
        let on_grid = |get: fn(&BandReport) -> f64| text(f.on_grid.as_ref().map(get));
        vec![
            row.name.clone(),
            row.from.into(),
            row.mesh.clone().unwrap_or_default(),
            row.domain.clone(),
            row.encoder.clone(),
            max_entries,
            row.vertices.to_string(),
            row.faces.to_string(),
            f.tetrahedra.to_string(),
            text(f.list_mean),
            count(f.longest_list),
            text(f.list_by_volume),
            text(f.read_by_volume),
            f.memory_mib.to_string(),
            count(f.whole_bytes),
            text(f.max_error_percent),
            text(f.exactness_band),
            text(f.one_percent_band),
            on_grid(|r| r.exactness_width),
            on_grid(|r| r.cells_inexact as f64),
            on_grid(|r| r.max_error),
            on_grid(|r| r.points as f64),
            on_grid(|r| r.points_inside as f64),
            on_grid(|r| r.points_by_tree as f64),
            on_grid(|r| r.voxel),
            text(row.encode_seconds),
            count(row.reencoded.map(|r| r.stale)),
        ]
    };
    let lines =
        |row: &Row| [line(row, String::new(), &row.full), line(row, MAX_ENTRIES.to_string(), &row.truncated)];
    Text { columns, rows: rows.iter().flat_map(lines).collect() }
}

/// Both figures, or a single one if they are equal.
fn pair(a: String, b: String) -> String {
    if a == b { a } else { format!("{a} / {b}") }
}

fn markdown(table: &Table) -> String {
    let columns = [
        "mesh",
        "domain",
        "Q / ε",
        "N_V",
        "N_F",
        "N_T",
        "# faces avg / max",
        "list by volume; read",
        "memory, MiB",
        "whole, MB",
        "max error, %",
        "exactness band",
        "1 % band",
        "exact up to",
        "cells with error",
        "encode, s",
        "grid points",
    ]
    .map(str::to_string)
    .to_vec();
    let both = |row: &Row, get: &dyn Fn(&Figures) -> Option<String>| {
        pair(or_dash(get(&row.full)), or_dash(get(&row.truncated)))
    };
    let line = |row: &Row| {
        let name = if row.from == "paper" { format!("*{}, paper*", row.name) } else { row.name.clone() };
        let seconds = row.encode_seconds.map(|s| match row.reencoded {
            Some(r) => format!("{s:.2} for {} of {} cells", r.stale, r.cells),
            None => format!("{s:.1}"),
        });
        let full = &row.full;
        let lists =
            full.list_mean.zip(full.longest_list).map(|(mean, most)| format!("{} / {most}", short(mean)));
        let reads = full.list_by_volume.zip(full.read_by_volume);
        vec![
            name,
            row.domain.clone(),
            row.encoder.clone(),
            row.vertices.to_string(),
            row.faces.to_string(),
            full.tetrahedra.to_string(),
            or_dash(lists),
            or_dash(reads.map(|(list, read)| format!("{}; {}", short(list), short(read)))),
            both(row, &|f| Some(format!("{:.3}", f.memory_mib))),
            both(row, &|f| f.whole_bytes.map(|b| format!("{:.3}", b as f64 / 1e6))),
            both(row, &|f| match &f.on_grid {
                Some(on_grid) => error(on_grid),
                None => f.max_error_percent.map(short),
            }),
            both(row, &|f| f.exactness_band.map(band)),
            both(row, &|f| f.one_percent_band.map(band)),
            both(row, &|f| f.on_grid.as_ref().map(|r| format!("{:.1e}", r.exactness_width))),
            both(row, &|f| f.on_grid.as_ref().map(|r| r.cells_inexact.to_string())),
            or_dash(seconds),
            or_dash(full.on_grid.as_ref().map(|r| format!("{:.1e}", r.points as f64))),
        ]
    };
    let text = Text { columns, rows: table.rows.iter().map(line).collect() };
    format!(
        "{}\nGrid: {} voxels along the diagonal. Two figures: full lists / at most {MAX_ENTRIES} faces; one figure: both.\n\n{}",
        crate::heading::lines(),
        table.grid,
        text.markdown(3)
    )
}
