//! Pose sets: two meshes, and the poses at which their contacts are measured.
//! `lab/poses/generate.py` describes the files.
use std::path::{Path, PathBuf};

use serde::Deserialize;
use tesdf::collide::Pose;
use tesdf::glam::{DQuat, DVec3};

use super::Failure;

/// A file of `lab/poses`.
pub struct PoseSet {
    /// File name without extension.
    pub name: String,
    /// Paths of the meshes `a` and `b`.
    pub meshes: [PathBuf; 2],
    /// Contacts are detected up to this distance, in the meshes' unit.
    pub contact_distance: f64,
    /// The poses of `a` and of `b`.
    pub poses: Vec<[Pose; 2]>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    a: PathBuf,
    b: PathBuf,
    contact_distance: f64,
    poses: Vec<Pair>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Pair {
    a: String,
    b: String,
}

impl PoseSet {
    /// Reads a file. Its mesh paths are relative to its folder.
    pub fn read(path: &Path) -> Result<Self, Failure> {
        let at = |e: &dyn std::fmt::Display| Failure::from(format!("{}: {e}", path.display()));
        let text = std::fs::read_to_string(path).map_err(|e| at(&e))?;
        let file: File = serde_json::from_str(&text).map_err(|e| at(&e))?;
        let folder = path.parent().unwrap_or(Path::new(""));
        let poses = file.poses.iter().enumerate().map(|(i, pair)| {
            let read = |text: &str| parse(text).map_err(|e| at(&format!("pose {i}: {e}")));
            Ok([read(&pair.a)?, read(&pair.b)?])
        });
        Ok(Self {
            name: path.file_stem().unwrap_or_default().to_string_lossy().into_owned(),
            meshes: [folder.join(file.a), folder.join(file.b)],
            contact_distance: file.contact_distance,
            poses: poses.collect::<Result<_, Failure>>()?,
        })
    }
}

fn parse(text: &str) -> Result<Pose, String> {
    let numbers: Result<Vec<f64>, _> = text.split_whitespace().map(str::parse).collect();
    match numbers.as_deref() {
        Ok(&[x, y, z, qx, qy, qz, qw]) => {
            let (translation, rotation) = (DVec3::new(x, y, z), DQuat::from_xyzw(qx, qy, qz, qw));
            if translation.is_finite() && (rotation.length() - 1.0).abs() < 1e-9 {
                return Ok(Pose { rotation: rotation.normalize(), translation });
            }
            Err(format!("not finite, or not a unit quaternion: {text:?}"))
        }
        _ => Err(format!("expected seven numbers, tx ty tz qx qy qz qw, found {text:?}")),
    }
}
