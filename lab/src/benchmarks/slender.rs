//! `tesdf-lab slender`: time and size of meshes with slender faces.
use std::f64::consts::TAU;
use std::fs;
use std::path::PathBuf;
use std::time::Instant;
use tesdf::base::Named as _;
use tesdf_cli::terminal::parse;

use rayon::ThreadPoolBuilder;
use tesdf::encode::Encoder;
use tesdf::glam::DVec3;
use tesdf::mesh::{SolidMesh, TriangleMesh};

use super::encode::peak_resident_kib;
use super::input::{Input, Preset};
use super::output::mb;
use super::{Failure, heading, output};

/// Arguments of `tesdf-lab slender`.
#[derive(clap::Args)]
pub struct Args {
    /// The mesh file that times per face are compared with
    reference: PathBuf,
    /// Preset of the encoder
    #[arg(long, value_parser = parse::named::<Preset>(), default_value_t = Preset::Fast)]
    preset: Preset,
    /// Leave out cones, discs and prisms of more sides
    #[arg(long, value_name = "N", default_value_t = 20_000)]
    max_sides: u32,
}

const COLUMNS: [&str; 8] = [
    "mesh",
    "faces",
    "check, s",
    "encode, s",
    "per face, against the first row",
    "peak resident, MiB",
    "entries per face",
    "file, MB",
];

pub fn run(args: &Args) -> Result<(), Failure> {
    heading::print()?;
    output::line(&format!(
        "Preset `{}`, one thread. *Cone*: n sides and a tip; its bottom is a fan around one corner. *Disc*: both \
         ends are fans around their centres. *Prism*: both ends are fans around a corner. *Rod*: a stretched cube. *Spike*: a \
         cube with one corner far away. *Stray*: the first mesh with one vertex far away. *Hair*: n long tetrahedra in \
         random positions.\n",
        args.preset.name()
    ))?;
    output::head(&COLUMNS, 1)?;
    let reference = Input::read(&args.reference)?;
    let mesh = reference.solid.mesh();
    let stray = |far: f64| {
        let mut vertices = mesh.vertices().to_vec();
        if let Some(v) = vertices.get_mut(100) {
            v.x = far * mesh.diagonal();
        }
        TriangleMesh::new(vertices, mesh.faces().to_vec())
    };
    let pool = ThreadPoolBuilder::new().num_threads(1).build()?;
    let mut unit = None;
    let mut row = |name: String, mesh: TriangleMesh| -> Result<(), Failure> {
        let faces = mesh.faces().len();
        let per_face =
            pool.install(|| one(&name, mesh, args.preset, unit).map_err(|e| format!("{name}: {e}")))?;
        unit = unit.or(Some(per_face / faces as f64));
        Ok(())
    };
    row(reference.name.clone(), mesh.clone())?;
    let is_asked = |n: &u32| *n <= args.max_sides;
    for n in [1000, 2000, 5000, 20_000].into_iter().filter(is_asked) {
        row(format!("cone {n}"), cone(n)?)?;
    }
    for n in [1000, 5000].into_iter().filter(is_asked) {
        row(format!("disc {n}"), disc(n)?)?;
        row(format!("prism {n}"), prism(n)?)?;
    }
    for length in [1e6, 1e12] {
        row(format!("rod 1 : {length:.0e}"), stretched(|v| v * DVec3::new(length, 1.0, 1.0))?)?;
        row(format!("spike 1 : {length:.0e}"), stretched(|v| if v == DVec3::ONE { v * length } else { v })?)?;
        row(format!("stray 1 : {length:.0e}"), stray(length)?)?;
    }
    row("hair 1000".into(), hair(1000)?)
}

/// Checks and encodes a mesh and prints a row. Returns the time of the encode, s.
fn one(name: &str, mesh: TriangleMesh, preset: Preset, unit: Option<f64>) -> Result<f64, Failure> {
    let faces = mesh.faces().len();
    // Resets the peak resident size.
    fs::write("/proc/self/clear_refs", "5")
        .map_err(|e| format!("cannot write /proc/self/clear_refs, which Linux has: {e}"))?;
    let start = Instant::now();
    let solid = SolidMesh::new(mesh)?;
    let checked = start.elapsed().as_secs_f64();
    let start = Instant::now();
    let asset = Encoder::new().preset(preset).encode(&solid)?;
    let seconds = start.elapsed().as_secs_f64();
    let ratio = seconds / faces as f64 / unit.unwrap_or(seconds / faces as f64);
    output::row(&[
        name.into(),
        faces.to_string(),
        format!("{checked:.2}"),
        format!("{seconds:.2}"),
        format!("{ratio:.2}"),
        format!("{:.0}", peak_resident_kib()? as f64 / 1024.0),
        format!("{:.0}", asset.about().statistics.entries as f64 / faces as f64),
        mb(asset.as_bytes().len()),
    ])?;
    Ok(seconds)
}

type Made = Result<TriangleMesh, tesdf::mesh::MeshError>;

fn rim(n: u32, z: f64) -> impl Iterator<Item = DVec3> {
    (0..n).map(move |k| {
        let angle = TAU * f64::from(k) / f64::from(n);
        DVec3::new(angle.cos(), angle.sin(), z)
    })
}

/// The quads between two rims of `n` corners, as triangles.
fn sides(n: u32) -> impl Iterator<Item = [u32; 3]> {
    (0..n).flat_map(move |k| {
        let next = (k + 1) % n;
        [[k, next, n + next], [k, n + next, n + k]]
    })
}

fn cone(n: u32) -> Made {
    let side = (0..n).map(|k| [k, (k + 1) % n, n]);
    let bottom = (1..n - 1).map(|k| [0, k + 1, k]);
    TriangleMesh::new(rim(n, 0.0).chain([DVec3::Z]).collect(), side.chain(bottom).collect())
}

fn disc(n: u32) -> Made {
    let ends = (0..n).flat_map(|k| {
        let next = (k + 1) % n;
        [[next, k, 2 * n], [n + k, n + next, 2 * n + 1]]
    });
    let centres = [DVec3::ZERO, 0.2 * DVec3::Z];
    let vertices = rim(n, 0.0).chain(rim(n, 0.2)).chain(centres).collect();
    TriangleMesh::new(vertices, sides(n).chain(ends).collect())
}

fn prism(n: u32) -> Made {
    let ends = (1..n - 1).flat_map(|k| [[0, k + 1, k], [n, n + k, n + k + 1]]);
    TriangleMesh::new(rim(n, 0.0).chain(rim(n, 0.5)).collect(), sides(n).chain(ends).collect())
}

/// A cube with moved vertices.
fn stretched(move_vertex: impl Fn(DVec3) -> DVec3) -> Made {
    let corner = |k: u32| DVec3::new(f64::from(k & 1), f64::from(k >> 1 & 1), f64::from(k >> 2));
    let squares = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
    let faces = squares.into_iter().flat_map(|[a, b, c, d]| [[a, b, c], [a, c, d]]);
    TriangleMesh::new((0..8).map(corner).map(move_vertex).collect(), faces.collect())
}

fn hair(n: u32) -> Made {
    let mut random = fastrand::Rng::with_seed(12);
    let mut point = || DVec3::new(random.f64(), random.f64(), random.f64()) - 0.5;
    let mut vertices = Vec::new();
    let mut faces = Vec::new();
    for k in (0..4 * n).step_by(4) {
        let (a, b) = (point(), point());
        let (c, d) = (a + 1e-4 * point(), a + 1e-4 * point());
        vertices.extend(if (b - a).cross(c - a).dot(d - a) < 0.0 { [a, b, c, d] } else { [a, b, d, c] });
        faces.extend([[k, k + 1, k + 2], [k, k + 3, k + 1], [k, k + 2, k + 3], [k + 1, k + 3, k + 2]]);
    }
    TriangleMesh::new(vertices, faces)
}
