//! Finds the files that a URDF file names.
use std::env;
use std::path::{Path, PathBuf};

use super::{parse, read};

/// Where the packages of a URDF file may be.
pub struct Packages<'a> {
    named: &'a [(String, PathBuf)],
    /// Folders that contain packages, or are one.
    roots: Vec<PathBuf>,
    /// The folder of the URDF file.
    folder: PathBuf,
}

impl<'a> Packages<'a> {
    /// For the URDF file at `path`, with the packages of `--package`.
    pub fn new(path: &Path, named: &'a [(String, PathBuf)]) -> Self {
        let folders = |name: &str, below: &str| -> Vec<PathBuf> {
            let value = env::var_os(name).unwrap_or_default();
            let found = env::split_paths(&value).filter(|path| !path.as_os_str().is_empty());
            found.map(|path| path.join(below)).collect()
        };
        // ROS 1 and ROS 2.
        let roots = [folders("ROS_PACKAGE_PATH", ""), folders("AMENT_PREFIX_PATH", "share")].concat();
        let folder = path.parent().unwrap_or(Path::new("")).to_path_buf();
        Self { named, roots, folder }
    }

    /// The path of the file that `reference` names, or why it has none.
    pub fn resolve(&self, reference: &str) -> Result<PathBuf, String> {
        let scheme = reference.split_once("://");
        match scheme {
            Some(("package" | "model", rest)) => {
                let (name, file) = rest.split_once('/').unwrap_or((rest, ""));
                let package = self.package(name).ok_or_else(|| {
                    format!(
                        "{reference}: the package {name} was not found; give --package {name}=PATH, or set ROS_PACKAGE_PATH"
                    )
                })?;
                Ok(package.join(file))
            }
            Some(("file", rest)) => Ok(self.folder.join(rest)),
            Some((other, _)) => {
                Err(format!("{reference}: addresses of the kind {other}:// are not read; expected a file"))
            }
            None => Ok(self.folder.join(reference)),
        }
    }

    fn package(&self, name: &str) -> Option<PathBuf> {
        if let Some((_, path)) = self.named.iter().find(|(known, _)| known == name) {
            return Some(path.clone());
        }
        let of_root = |root: &PathBuf| match root.join(name) {
            below if below.is_dir() => Some(below),
            _ => is_package(root, name).then(|| root.clone()),
        };
        self.roots.iter().find_map(of_root).or_else(|| {
            // The file is mostly in its package, or beside it.
            let folder = std::path::absolute(&self.folder).ok()?;
            folder.ancestors().map(Path::to_path_buf).find_map(|above| match is_package(&above, name) {
                true => Some(above),
                false => of_root(&above),
            })
        })
    }
}

/// Whether a folder is the package, by its own name or by that in its `package.xml`.
fn is_package(folder: &Path, name: &str) -> bool {
    if folder.file_name().is_some_and(|own| own == name) {
        return true;
    }
    let file = folder.join("package.xml");
    let Ok(text) = read(&file) else { return false };
    parse(&file, &text).is_ok_and(|document| {
        let mut own = document.root_element().children().filter(|node| node.has_tag_name("name"));
        own.any(|node| node.text().unwrap_or_default().trim() == name)
    })
}
