//! `tesdf-lab peers`: prints one JSON document for `lab/scripts/peers.py`, which runs the
//! other peers and makes the table.
//!
//! Each pose set has the true clearance of each pose, and rows of raw measurements with one entry
//! per pose. All lengths are in the unit of the meshes.
use std::collections::HashMap;
use std::hint::black_box;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Duration, Instant};
use tesdf::encode::EncodeOptions;
use tesdf_cli::terminal::parse;

use parry3d::math::Pose as ParryPose;
use rayon::ThreadPoolBuilder;
use serde::Serialize;
use tesdf::collide::{
    ClearanceOptions, CollideOptions, ContactsPer, Instance, InstanceId, Mode, Pose, Reduction, Scene,
    clearance, detect,
};
use tesdf::glam::DVec3;
use tesdf::mesh::TriangleMesh;
use tesdf::query::Precision;
use tesdf::{Length, TeSdf};

use super::clearance::Body;
use super::input::{Input, Preset};
use super::parry::{self, Peer};
use super::poses::PoseSet;
use super::{Failure, output};
use tesdf_sim::criterion::measure::relative;

/// Arguments of `tesdf-lab peers`.
#[derive(clap::Args)]
pub struct Args {
    /// Pose sets, as in `lab/poses`
    #[arg(required = true)]
    sets: Vec<PathBuf>,
    /// Preset of the encoder
    #[arg(long, value_parser = parse::named::<Preset>(), default_value_t = Preset::Default)]
    preset: Preset,
    /// Scale of parry3d's unit to the mesh's unit, because parry3d computes in f32 with absolute
    /// tolerances
    #[arg(long, default_value_t = 1000.0)]
    parry_scale: f64,
}

/// The measurements of one pose set.
#[derive(Serialize)]
struct Measured {
    set: String,
    /// The true clearance of each pose; see [`Body::clearance`].
    clearance: Vec<f64>,
    rows: Vec<Row>,
}

/// One operation of one contender.
#[derive(Serialize)]
struct Row {
    contender: String,
    operation: &'static str,
    /// Whether the result is exact for the given meshes, or why it is not.
    exact: &'static str,
    /// Time to prepare both meshes, s.
    build: f64,
    poses: Vec<Outcome>,
}

/// The result of one operation at one pose.
#[derive(Serialize)]
struct Outcome {
    /// Best time of several runs, s.
    seconds: f64,
    /// Whether the solids overlap, if the operation reports it.
    overlap: Option<bool>,
    /// Number of contacts, if the operation reports contacts.
    contacts: Option<usize>,
    /// Distance or negative depth, in the unit of the meshes, if the operation reports it.
    clearance: Option<f64>,
}

/// The result of a contender at a pose.
#[derive(Default)]
struct Found {
    overlap: Option<bool>,
    contacts: Option<usize>,
    clearance: Option<f64>,
}

pub fn run(args: &Args) -> Result<(), Failure> {
    // The encoder may use all threads, but the measured operations use one.
    let one = ThreadPoolBuilder::new().num_threads(1).build()?;
    let mut bodies = HashMap::new();
    let mut all = Vec::new();
    for path in &args.sets {
        let set = PoseSet::read(path)?;
        for mesh in &set.meshes {
            if !bodies.contains_key(mesh) {
                eprintln!("encoding {}", mesh.display());
                bodies.insert(mesh.clone(), Encoded::new(mesh, args)?);
            }
        }
        eprintln!("measuring {}", set.name);
        let [a, b] = set.meshes.each_ref().map(|mesh| &bodies[mesh]);
        let (first, second) = (Body::new(a.input.solid.mesh()), Body::new(b.input.solid.mesh()));
        let rows = one.install(|| {
            let mut rows = ours(&set, a, b)?;
            rows.extend(peers(&set, a, b, args.parry_scale)?);
            Ok::<_, Failure>(rows)
        })?;
        let clearance = set.poses.iter().map(|&poses| first.clearance(&second, poses)).collect();
        all.push(Measured { set: set.name, clearance, rows });
    }
    output::line(&serde_json::to_string_pretty(&all)?)
}

/// A mesh, prepared for all contenders.
struct Encoded {
    input: Input,
    asset: Arc<TeSdf>,
    encode_seconds: f64,
    peer: Peer,
    peer_seconds: f64,
}

impl Encoded {
    fn new(path: &Path, args: &Args) -> Result<Self, Failure> {
        let input = Input::read(path)?;
        let (asset, encode_seconds) = input.encode(&EncodeOptions::preset(args.preset))?;
        let start = Instant::now();
        let mesh = input.solid.mesh();
        let vertices = mesh.vertices().iter().map(|&v| v * args.parry_scale).collect();
        let peer = Peer::new(&TriangleMesh::new(vertices, mesh.faces().to_vec())?)?;
        let peer_seconds = start.elapsed().as_secs_f64();
        Ok(Self { input, asset: Arc::new(asset), encode_seconds, peer, peer_seconds })
    }
}

/// The rows of tesdf.
fn ours(set: &PoseSet, a: &Encoded, b: &Encoded) -> Result<Vec<Row>, Failure> {
    let mut rows = detector(set, a, b)?;
    rows.extend(vertices(set, a, b)?);
    Ok(rows)
}

const ALL: Reduction = Reduction::None;
const KEPT: Reduction = Reduction::PerPair(64);
const SPREAD: Reduction = Reduction::Spread(64);

/// What the exact operations give.
const CERTIFIED: &str = "f64; signed, of the solids, to 1e-7";

const SPREAD_ONLY: &str = "f64; signed; not always the deepest";

/// The rows of the detector in each mode, and of the clearance.
fn detector(set: &PoseSet, a: &Encoded, b: &Encoded) -> Result<Vec<Row>, Failure> {
    use ContactsPer::{Cell, Face};
    let scene = |poses: [Pose; 2]| -> Result<(Scene, [InstanceId; 2]), Failure> {
        let mut scene = Scene::new();
        let mut add = |asset: &Arc<TeSdf>, pose: Pose| -> Result<InstanceId, Failure> {
            let shape = scene.add_shape(asset.clone())?;
            Ok(scene.add(Instance::new(shape, pose))?)
        };
        let ids = [add(&a.asset, poses[0])?, add(&b.asset, poses[1])?];
        Ok((scene, ids))
    };
    let row = |operation, exact, poses| Row {
        contender: format!("tesdf {}", env!("CARGO_PKG_VERSION")),
        operation,
        exact,
        build: a.encode_seconds + b.encode_seconds,
        poses,
    };
    let contacts = |mode: Mode, contacts_per, reduction| {
        measure(set, |poses, contact_distance| {
            let options = CollideOptions {
                contact_distance,
                reduction,
                ..CollideOptions::with_mode(mode.per(contacts_per))
            };
            let found = detect(&scene(poses)?.0, &options)?;
            let least = found.iter().map(|c| c.distance).fold(f64::INFINITY, f64::min);
            Ok(Found {
                contacts: Some(found.len()),
                clearance: Some(least).filter(|c| c.is_finite()),
                overlap: Some(least < 0.0),
            })
        })
    };
    let apart = measure(set, |poses, _| {
        let (scene, [a, b]) = scene(poses)?;
        let options = ClearanceOptions { tolerance: Length::OfDiagonal(1e-7) };
        let found = clearance(&scene, a, b, &options)?.distance;
        Ok(Found { contacts: None, clearance: Some(found), overlap: Some(found < 0.0) })
    })?;
    Ok(vec![
        row("detect, nodes", "no: at vertices only", contacts(Mode::Node, Face, ALL)?),
        row("detect, nodes, 64 kept", "no: at vertices only", contacts(Mode::Node, Face, KEPT)?),
        row("detect, Frank-Wolfe, per cell", "no: minima from above", contacts(Mode::face(), Cell, ALL)?),
        row("detect, Frank-Wolfe, per face", "no: minima from above", contacts(Mode::face(), Face, ALL)?),
        row("detect, exact, per cell", CERTIFIED, contacts(Mode::exact(), Cell, ALL)?),
        row("detect, exact, per face", CERTIFIED, contacts(Mode::exact(), Face, ALL)?),
        row("detect, exact, per face, 64 kept", CERTIFIED, contacts(Mode::exact(), Face, KEPT)?),
        row("detect, exact, per face, 64 spread", SPREAD_ONLY, contacts(Mode::exact(), Face, SPREAD)?),
        row("clearance", CERTIFIED, apart),
    ])
}

/// The rows of signed distances at the vertices, without the detector.
fn vertices(set: &PoseSet, a: &Encoded, b: &Encoded) -> Result<Vec<Row>, Failure> {
    let build = a.encode_seconds + b.encode_seconds;
    [(Precision::F32, "f32"), (Precision::F64, "f64")]
        .map(|(precision, name)| {
            let poses = measure(set, |[pose_a, pose_b], distance| {
                let of_a = vertex_contacts(a, b, relative(pose_b, pose_a), distance, precision);
                let of_b = vertex_contacts(b, a, relative(pose_a, pose_b), distance, precision);
                Ok(Found {
                    contacts: Some(of_a.0 + of_b.0),
                    clearance: Some(of_a.1.min(of_b.1)).filter(|c| c.is_finite()),
                    overlap: Some(of_a.1.min(of_b.1) < 0.0),
                })
            })?;
            Ok(Row {
                contender: format!("tesdf {}, {name}", env!("CARGO_PKG_VERSION")),
                operation: "signed distance at vertices, both ways",
                exact: "no: at vertices only",
                build,
                poses,
            })
        })
        .into_iter()
        .collect()
}

/// The number of vertices of `a` within `distance` of `b`, and the smallest signed distance of the
/// vertices near the bounds of `b`.
fn vertex_contacts(
    a: &Encoded,
    b: &Encoded,
    pose: Pose,
    distance: f64,
    precision: Precision,
) -> (usize, f64) {
    let bounds = b.input.solid.mesh().bounds().grown(distance);
    let vertices = a.input.solid.mesh().vertices().iter().map(|&v| pose.to_world(v));
    let near: Vec<DVec3> = vertices.filter(|&v| bounds.contains(v)).collect();
    let answers = b.asset.query_batch_with(&near, precision);
    let contacts = answers.iter().filter(|a| a.signed_distance <= distance).count();
    (contacts, answers.iter().map(|a| a.signed_distance).fold(f64::INFINITY, f64::min))
}

/// The rows of parry3d.
fn peers(set: &PoseSet, a: &Encoded, b: &Encoded, scale: f64) -> Result<Vec<Row>, Failure> {
    type Find<'a> = &'a dyn Fn(&[ParryPose; 2], f32) -> Result<Found, Failure>;
    let row = |operation, exact, find: Find<'_>| -> Result<Row, Failure> {
        Ok(Row {
            contender: parry::NAME.into(),
            operation,
            exact,
            build: a.peer_seconds + b.peer_seconds,
            poses: measure(set, |poses, distance| {
                find(&parry::pair(poses, scale), (distance * scale) as f32)
            })?,
        })
    };
    let unscaled = |distance: f32| f64::from(distance) / scale;
    Ok(vec![
        row("intersection_test", "f32; surfaces only", &|poses, _| {
            Ok(Found { overlap: Some(a.peer.meets(&b.peer, poses)?), ..Found::default() })
        })?,
        row("distance", "f32; 0 where they overlap", &|poses, _| {
            let separation = a.peer.separation(&b.peer, poses)?;
            Ok(Found {
                overlap: Some(separation <= 0.0),
                clearance: Some(separation).filter(|&s| s > 0.0).map(unscaled),
                ..Found::default()
            })
        })?,
        row("contact", "no: depth of two triangles", &|poses, distance| {
            let deepest = a.peer.deepest_contact(&b.peer, poses, distance)?;
            Ok(Found {
                overlap: Some(deepest.is_some_and(|d| d < 0.0)),
                contacts: Some(usize::from(deepest.is_some())),
                clearance: deepest.map(unscaled),
            })
        })?,
        row("contact_manifolds", "no: depth of two triangles", &|poses, distance| {
            let contacts = a.peer.contacts(&b.peer, poses, distance)?;
            let least = contacts.iter().copied().reduce(f32::min);
            Ok(Found {
                overlap: Some(least.is_some_and(|d| d < 0.0)),
                contacts: Some(contacts.len()),
                clearance: least.map(unscaled),
            })
        })?,
    ])
}

/// Measures each pose three times after a warm-up run, or until half a second has passed. `find`
/// takes the poses and the contact distance.
fn measure(
    set: &PoseSet,
    find: impl Fn([Pose; 2], f64) -> Result<Found, Failure>,
) -> Result<Vec<Outcome>, Failure> {
    const ENOUGH: Duration = Duration::from_millis(500);
    let at = |&poses: &[Pose; 2]| {
        let begin = Instant::now();
        let mut found = find(poses, set.contact_distance)?;
        let mut best = begin.elapsed();
        for _ in 0..3 {
            if begin.elapsed() > ENOUGH {
                break;
            }
            let start = Instant::now();
            found = black_box(find(black_box(poses), set.contact_distance)?);
            best = best.min(start.elapsed());
        }
        let Found { overlap, contacts, clearance } = found;
        Ok(Outcome { seconds: best.as_secs_f64(), overlap, contacts, clearance })
    };
    set.poses.iter().map(at).collect()
}
