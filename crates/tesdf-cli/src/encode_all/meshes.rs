//! Finds the meshes of a folder or of a list.
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use crate::terminal::mesh_file::CadArgs;
use crate::terminal::report::Failure;
use serde::Serialize;
use tesdf::glam::DAffine3;
use tesdf::input;
use tesdf::mesh::{LoadReport, MeshFormat, TriangleMesh};
use walkdir::WalkDir;

use super::Shard;

/// A mesh that is to be encoded.
#[derive(Clone, Debug, Default)]
pub struct Mesh {
    /// Its path in the manifest: below the folder, with `/` between names, or the line of the list.
    pub name: String,
    /// Its path from the working folder.
    pub path: PathBuf,
    /// Size of its file; 0 when that cannot be read.
    pub bytes: u64,
    /// Why it cannot be read.
    pub unreadable: Option<String>,
    /// What is encoded.
    pub content: Content,
    /// What the manifest says about it besides.
    pub entry: Details,
}

/// What is encoded of a file.
#[derive(Clone, Debug, Default)]
pub enum Content {
    /// The mesh of the whole file, as it is. The name of its asset is a hash.
    #[default]
    File,
    /// An object of the file, which has been read.
    Part(Box<Part>),
    /// The mesh of the whole file after a transform.
    Placed(Box<Placed>),
}

/// An object of a file.
#[derive(Clone, Debug)]
pub struct Part {
    /// File name of the asset.
    pub asset: String,
    pub mesh: TriangleMesh,
    /// The report of the whole file.
    pub load: LoadReport,
}

/// A transform of the mesh of a file.
#[derive(Clone, Debug)]
pub struct Placed {
    /// File name of the asset.
    pub asset: String,
    pub pose: DAffine3,
    /// The transform as text, for the name of the source in the asset. `None` if there is none.
    pub label: Option<String>,
    /// Name of the unit after the transform. `None` if it is that of the file.
    pub unit: Option<String>,
}

/// Fields of the manifest that only some meshes have.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Details {
    /// Name of the object in the file.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub part: Option<String>,
    /// Factors along the axes, by which a robot description scales the mesh.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub scale: Option<[f64; 3]>,
    /// What of a robot uses the mesh.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub uses: Vec<Use>,
}

/// What of a robot uses a mesh.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
#[serde(untagged)]
pub enum Use {
    /// A collision of a link in a URDF file.
    Urdf { link: String, collision: String },
    /// A geom of a body in an MJCF file.
    Mjcf { body: String, geom: String },
}

/// The meshes of one part of a folder or of a list, by their names. A mesh that a list names twice
/// is there once.
///
/// # Errors
/// There is no such folder or list, or it names no mesh.
pub fn find(from: &Path, shard: Option<Shard>, cad: &CadArgs) -> Result<Vec<Mesh>, Failure> {
    let all = if from.is_dir() { in_folder(from) } else { in_list(from)? };
    let is_cad = |(path, _): &(PathBuf, _)| MeshFormat::of_path(path).is_ok_and(MeshFormat::is_cad);
    if cad.is_given() && !all.values().any(is_cad) {
        return Err(Failure::new(format!(
            "--mesh-size and --deviation are of STEP, IGES and BREP files, and {} has none; leave them out, or list such \
             files in a text file",
            from.display()
        )));
    }
    if all.is_empty() {
        let known = MeshFormat::ALL.iter().filter(|format| !format.is_cad());
        let known: Vec<_> = known.map(ToString::to_string).collect();
        return Err(Failure::new(format!("{} has no mesh; expected {}", from.display(), known.join(", "))));
    }
    let chosen = all.into_iter().filter(|(name, _)| shard.is_none_or(|shard| shard.has(name)));
    Ok(chosen
        .map(|(name, (path, unreadable))| {
            let bytes = fs::metadata(&path).map_or(0, |found| found.len());
            Mesh { name, path, bytes, unreadable, ..Mesh::default() }
        })
        .collect())
}

/// Paths by name, and why a folder cannot be read.
type Found = BTreeMap<String, (PathBuf, Option<String>)>;

/// The files in `folder` and below it that have the extension of a mesh. CAD files are read by
/// another program and often stand beside a mesh of the same part, so only a list names them. Links
/// to files are followed, and links to folders are not: they may lead in a circle.
fn in_folder(folder: &Path) -> Found {
    let name = |path: &Path| {
        let below = path.strip_prefix(folder).unwrap_or(path);
        let names: Vec<_> = below.components().map(|part| part.as_os_str().to_string_lossy()).collect();
        names.join("/")
    };
    let mut found = Found::new();
    for entry in WalkDir::new(folder) {
        match entry {
            Ok(entry) => {
                let path = entry.into_path();
                if MeshFormat::of_path(&path).is_ok_and(|format| !format.is_cad()) && !path.is_dir() {
                    found.insert(name(&path), (path, None));
                }
            }
            Err(e) => {
                let path = e.path().unwrap_or(folder).to_path_buf();
                let reason = match e.io_error() {
                    Some(reason) => format!("cannot read {}: {reason}", path.display()),
                    None => e.to_string(),
                };
                found.insert(name(&path), (path, Some(reason)));
            }
        }
    }
    found
}

fn in_list(list: &Path) -> Result<Found, Failure> {
    if MeshFormat::of_path(list).is_ok() {
        let name = list.display();
        return Err(Failure::new(format!("{name} is a mesh; expected a folder or a list of paths"))
            .hint(format!("`tesdf encode {name} -o FILE` encodes it")));
    }
    let text = input::read_to_string(list)
        .map_err(|e| Failure::new(format!("cannot read {}: {e}", list.display())))?;
    let lines = text.lines().map(str::trim_end).filter(|line| !line.is_empty());
    Ok(lines.map(|line| (line.to_string(), (line.into(), None))).collect())
}
