//! `tesdf encode ROBOT -o FOLDER`: encodes the collision meshes of a robot description.
mod mjcf;
mod urdf;

use std::collections::HashMap;
use std::fs;
use std::path::{Path, PathBuf};

use crate::terminal::report::{Failure, Outcome};
use tesdf::glam::{DAffine3, DVec3};
use tesdf::mesh::MeshFormat;
use tesdf_sim::robot::RobotFormat;

use super::Args;
use crate::encode_all::file_names;
use crate::encode_all::meshes::{Content, Details, Mesh, Placed, Use};

/// The use of a mesh in a robot description.
struct MeshUse {
    /// The mesh file, as the description names it.
    reference: String,
    /// Its path, or why there is none.
    path: Result<PathBuf, String>,
    scale: DVec3,
    /// From the coordinates of the file to those of the mesh, with the scale.
    pose: DAffine3,
    used_by: Use,
}

/// Parses `--package NAME=PATH`.
pub(super) fn package(text: &str) -> Result<(String, PathBuf), String> {
    match text.split_once('=') {
        Some((name, path)) if !name.is_empty() && !path.is_empty() => Ok((name.into(), path.into())),
        _ => Err("expected NAME=PATH, such as robot_description=../robot_description".into()),
    }
}

/// Encodes each mesh once for each scale. A mesh that cannot be encoded stops nothing: the manifest
/// says why.
pub(super) fn run(args: &Args, format: RobotFormat) -> Result<Outcome, Failure> {
    if args.split {
        return Err(Failure::new(
            "--split is for one mesh file; a robot description has an asset for each mesh",
        ));
    }
    let uses = match format {
        RobotFormat::Urdf => urdf::uses(&args.mesh, &args.packages)?,
        RobotFormat::Mjcf if !args.packages.is_empty() => {
            return Err(Failure::new(
                "--package is of URDF files; MJCF names files without packages; leave it out",
            ));
        }
        RobotFormat::Mjcf => mjcf::uses(&args.mesh)?,
    };
    if uses.is_empty() {
        let found = format!("{} names no collision mesh; expected at least one", args.mesh.display());
        return Err(Failure::new(found));
    }
    args.batch(meshes(uses, format))?.run(args.consent)
}

/// The meshes, each once, in the order of their first uses.
fn meshes(uses: Vec<MeshUse>, format: RobotFormat) -> Vec<Mesh> {
    let mut known: HashMap<(PathBuf, [u64; 12]), usize> = HashMap::new();
    let mut meshes: Vec<Mesh> = Vec::new();
    let mut stems = Vec::new();
    for found in uses {
        let (path, unreadable) = match found.path {
            Ok(path) => {
                let reason = unreadable(&path, &found.reference);
                (path, reason)
            }
            Err(reason) => (PathBuf::from(&found.reference), Some(reason)),
        };
        let same = fs::canonicalize(&path).unwrap_or_else(|_| path.clone());
        let key = (same, found.pose.to_cols_array().map(f64::to_bits));
        if let Some(&mesh) = known.get(&key) {
            meshes[mesh].entry.uses.push(found.used_by);
            continue;
        }
        known.insert(key, meshes.len());
        stems.push(path.file_stem().unwrap_or_default().to_string_lossy().into_owned());
        let placed = Placed {
            asset: String::new(),
            pose: found.pose,
            label: label(&found.pose, found.scale),
            // URDF is in metres.
            unit: (format == RobotFormat::Urdf).then(|| "m".to_owned()),
        };
        meshes.push(Mesh {
            name: found.reference,
            bytes: fs::metadata(&path).map_or(0, |file| file.len()),
            path,
            unreadable,
            content: Content::Placed(Box::new(placed)),
            entry: Details { scale: Some(found.scale.to_array()), uses: vec![found.used_by], part: None },
        });
    }
    let names = file_names::unique(stems.iter().map(String::as_str), "mesh");
    for (mesh, name) in meshes.iter_mut().zip(names) {
        if let Content::Placed(placed) = &mut mesh.content {
            placed.asset = name;
        }
    }
    meshes
}

/// Why a file is not read, if its extension says so.
fn unreadable(path: &Path, reference: &str) -> Option<String> {
    let extension = path.extension().unwrap_or_default().to_string_lossy().to_lowercase();
    if extension == "dae" {
        let help = "convert it to STL, OBJ or glTF, for example in Blender";
        return Some(format!("{}: COLLADA files (.dae) are not read; {help}", path.display()));
    }
    if let Err(error) = MeshFormat::of_path(path) {
        return Some(error.to_string());
    }
    (!path.exists()).then(|| {
        let found = format!("{} does not exist", path.display());
        format!("{found}; the robot description names it as {reference}")
    })
}

/// The transform as text, if there is one.
fn label(pose: &DAffine3, scale: DVec3) -> Option<String> {
    if *pose == DAffine3::IDENTITY {
        return None;
    }
    let scaled = format!("scale={} {} {}", scale.x, scale.y, scale.z);
    if *pose == DAffine3::from_scale(scale) {
        return Some(scaled);
    }
    let numbers: Vec<_> = pose.to_cols_array().iter().map(f64::to_string).collect();
    Some(format!("transform={}", numbers.join(" ")))
}
