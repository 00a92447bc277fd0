//! Finds the meshes of a folder or of a list.
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use tesdf::input;
use tesdf::mesh::MeshFormat;
use tesdf_terminal::report::Failure;
use walkdir::WalkDir;

use super::Shard;

/// A mesh that is to be encoded.
#[derive(Clone, Debug)]
pub struct Mesh {
    /// Its path in the manifest: below the folder, with `/` between names, or the line of the list.
    pub name: String,
    /// Its path from the working folder.
    pub path: PathBuf,
    /// Size of its file; 0 when that cannot be read.
    pub bytes: u64,
    /// Why its folder cannot be read. The path is that of the folder then.
    pub unreadable: Option<String>,
}

/// The meshes of one part of a folder or of a list, by their names. A mesh that a list names twice
/// is there once.
///
/// # Errors
/// There is no such folder or list, or it names no mesh.
pub fn find(from: &Path, shard: Option<Shard>) -> Result<Vec<Mesh>, Failure> {
    let all = if from.is_dir() { in_folder(from) } else { in_list(from)? };
    if all.is_empty() {
        let known: Vec<_> = MeshFormat::ALL.iter().map(ToString::to_string).collect();
        return Err(Failure::new(format!("{} has no mesh; expected {}", from.display(), known.join(", "))));
    }
    let chosen = all.into_iter().filter(|(name, _)| shard.is_none_or(|shard| shard.has(name)));
    Ok(chosen
        .map(|(name, (path, unreadable))| {
            let bytes = fs::metadata(&path).map_or(0, |found| found.len());
            Mesh { name, path, bytes, unreadable }
        })
        .collect())
}

/// Paths by name, and why a folder cannot be read.
type Found = BTreeMap<String, (PathBuf, Option<String>)>;

/// The files in `folder` and below it that have the extension of a mesh. Links to files are
/// followed, and links to folders are not: they may lead in a circle.
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
                if MeshFormat::of_path(&path).is_ok() && !path.is_dir() {
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
