//! `tesdf inspect FILE…`: prints the contents of `.tesdf` files.
use std::path::{Path, PathBuf};
use std::sync::Arc;

use serde::Serialize;
use tesdf::asset::about::{Repair, Source, Statistics};
use tesdf::collide::Shape;
use tesdf::encode::EncodeOptions;
use tesdf::inspect::{InspectOptions, Inspection, inspect};
use tesdf::{Certificate, Length};
use tesdf_sim::MassProperties;

use crate::terminal::asset_file;
use crate::terminal::files::{self, Found, Solid};
use crate::terminal::parse;
use crate::terminal::report::{self, Failure, Outcome, count, size};

/// Arguments of `tesdf inspect`.
#[derive(clap::Args, Debug)]
pub struct Args {
    /// .tesdf files
    #[arg(value_name = "FILE", required = true, value_parser = parse::input())]
    pub files: Vec<PathBuf>,
    /// Print the result as JSON: an object, or of several files a list of them
    #[arg(long)]
    pub json: bool,
}

/// The output of `--json`.
#[derive(Serialize)]
struct Report<'a> {
    file: String,
    format_version: u32,
    unit: Option<&'a str>,
    #[serde(flatten)]
    found: &'a Inspection,
    source: &'a Source,
    options: &'a EncodeOptions,
    certificate: &'a Certificate,
    statistics: &'a Statistics,
    /// `null` where the faces do not enclose the inside.
    solid: Option<Solid>,
}

/// Opens assets, which checks their structure, and prints their contents.
///
/// # Errors
/// An asset cannot be opened, or stdout cannot be written.
pub fn run(args: &Args) -> Result<Outcome, Failure> {
    files::each(&args.files, args.json, |path| inspect_one(args, path))
}

fn inspect_one(args: &Args, path: &Path) -> Result<Found, Failure> {
    let asset = Arc::new(asset_file::open(path)?);
    let found = inspect(&asset, &InspectOptions::default());
    let about = asset.about();
    let of_faces = || MassProperties::of_shape(&Shape::Mesh(Arc::clone(&asset)), 1.0, 1.0).ok();
    let report = Report {
        file: path.display().to_string(),
        format_version: asset.container().version(),
        unit: about.options.unit.as_deref(),
        found: &found,
        source: &about.source,
        options: &about.options,
        certificate: about.certificate(),
        statistics: &about.statistics,
        solid: asset.faces_enclose_the_solid().then(of_faces).flatten().map(Solid::of),
    };
    let result = match args.json {
        true => report::to_json(&report)? + "\n",
        false => report::columns(&rows(&report)),
    };
    Ok(Found { outcome: Outcome::Good, result, hint: None })
}

fn inside(certificate: &Certificate) -> String {
    let jumps = if certificate.jumps() {
        "; the sign changes in holes of the mesh, where the distance is not 0"
    } else {
        ""
    };
    format!("{}{jumps}", certificate.inside())
}

fn rows(report: &Report) -> Vec<(String, String)> {
    let Report { source, options, certificate, statistics, .. } = report;
    let Inspection { counts, classes, lists, reads, memory } = report.found;
    let unit = report.unit.map_or(String::new(), |unit| format!(" {unit}"));
    let percent = |share: f64| format!("{:.2} %", 100.0 * share);
    let yes_no = |b: bool| if b { "yes" } else { "no" };
    let length = |length: f64| format!("{}{unit}", Length::Absolute(length));
    let band = match options.band {
        Length::OfDiagonal(_) => options.band.to_string(),
        Length::Absolute(band) => length(band),
    };
    let list_sizes = format!(
        "half up to {}, 9 of 10 up to {}, 99 of 100 up to {}, longest {}",
        lists.p50, lists.p90, lists.p99, lists.longest
    );
    let mut rows: Vec<(&str, String)> = vec![
        ("file", format!("{}, format version {}", report.file, report.format_version)),
        ("source", if source.name.is_empty() { "made in memory".into() } else { source.name.clone() }),
        ("repaired", source.repair.as_ref().map_or("no".into(), Repair::to_string)),
        ("source BLAKE3", if source.blake3.is_empty() { "-".into() } else { source.blake3.clone() }),
        ("unit", report.unit.unwrap_or("not given").into()),
        ("", String::new()),
        ("mesh", format!("{}, {}", count(counts.faces, "face"), count(counts.vertices, "vertex"))),
        ("diagonal", length(statistics.diagonal)),
        ("inside", inside(certificate)),
    ];
    rows.extend(report.solid.iter().flat_map(|solid| solid.rows(&unit)));
    rows.extend([
        (
            "cells with a list",
            format!("{}, {} of them at the surface", counts.listed_cells, counts.crossing_cells),
        ),
        ("cells without", format!("{}, answered by the face tree", counts.far_cells)),
        ("deepest cell", count(counts.depth as usize, "bisection")),
        ("list entries", format!("{}, {:.2} per cell", counts.entries, lists.mean)),
        ("list lengths", list_sizes),
        ("", String::new()),
        ("reads per query", format!("{:.2} within 2 % of the diagonal from the surface", reads.near_surface)),
        ("", format!("{:.2} by volume, the face tree's reads included", reads.volume_weighted)),
        (
            "face tree",
            format!(
                "answers {} of the volume with {:.1} reads, {} near the surface",
                percent(reads.fallback_volume),
                reads.fallback,
                percent(reads.near_surface_fallback)
            ),
        ),
        ("", String::new()),
    ]);
    if let Some(c) = classes {
        let [surface, inner, outer] = [c.surface_vertices, c.inner_vertices, c.outer_vertices];
        let vertices = format!("{surface} of the surface, {inner} inside, {outer} outside");
        let [bi, i, bo, o] = [
            c.boundary_inner_tetrahedra,
            c.inner_tetrahedra,
            c.boundary_outer_tetrahedra,
            c.outer_tetrahedra,
        ];
        let tetrahedra = format!(
            "inside {bi} at the boundary and {i} others, outside {bo} at the boundary and {o} others"
        );
        rows.extend([("domain's vertices", vertices), ("tetrahedra", tetrahedra), ("", String::new())]);
    }
    let mut bytes: Vec<(&str, String)> =
        memory.parts.iter().map(|(name, bytes)| (name.as_str(), format!("{bytes:>12} B"))).collect();
    bytes.push(("file in all", format!("{:>12} B  {}", memory.file, size(memory.file))));
    bytes.push((
        "resident in all",
        format!("{:>12} B  {}, {:.1} per face", memory.whole, size(memory.whole), memory.whole_per_face),
    ));
    bytes.push(("lists and tree", format!("{:>12} B  domain.*, lists.* and entries", memory.lists_and_tree)));
    bytes.push((
        "as in the paper",
        format!(
            "{:>12} B  {:.3} MiB: 4 per list entry, 16 per tetrahedron with a list",
            memory.paper, memory.paper_mib
        ),
    ));
    rows.append(&mut bytes);
    let exact = match certificate.exactness_distance() {
        None => "in the whole domain".into(),
        Some(distance) => format!("up to {} from the surface", length(distance)),
    };
    rows.extend([
        ("", String::new()),
        ("encoder", format!("{}, domain {}", certificate.encoder(), certificate.domain())),
        (
            "exact",
            match (certificate.delta(), certificate.delta_of_diagonal()) {
                (Some(delta), Some(share)) => {
                    format!("{exact}, to {delta:.1e}{unit} ({share:.1e} of the diagonal)")
                }
                _ => "not proven".into(),
            },
        ),
        ("truncated lists", yes_no(certificate.truncated()).into()),
        ("band", band),
        ("regions", options.regions.len().to_string()),
        ("byte worth", options.byte_worth.to_string()),
        ("tighten levels", options.tighten_levels.to_string()),
    ]);
    rows.into_iter().map(|(name, value)| (name.to_string(), value)).collect()
}
