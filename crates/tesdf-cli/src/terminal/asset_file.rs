//! Opens `.tesdf` files for all commands.
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use tesdf::TeSdf;
use tesdf::asset::{AssetError, Container, layout};
use tesdf::base::unit::is_same_unit;
use tesdf::geometry::Aabb;

use crate::terminal::report::{self, Failure};

/// Opens an asset. The error message names the file.
///
/// # Errors
/// The same errors as [`TeSdf::open`].
pub fn open(path: &Path) -> Result<TeSdf, Failure> {
    TeSdf::open(path).map_err(|e| failure(path, &e))
}

/// Opens an asset after its checksums: all other checks then read the bytes that were written.
///
/// # Errors
/// The same errors as [`TeSdf::open`], and [`AssetError::Checksum`].
pub fn open_intact(path: &Path) -> Result<TeSdf, AssetError> {
    // The file is opened once, because a pipe gives its bytes once, and a file could be replaced
    // between two reads.
    let container = Container::open(path, &layout::SECTIONS)?;
    container.verify_checksums()?;
    TeSdf::from_container(container)
}

/// Assets by path, so a file that is named twice is opened once.
#[derive(Default)]
pub struct Assets(BTreeMap<PathBuf, Arc<TeSdf>>);

impl Assets {
    /// Opens an asset, or returns the asset that is already open.
    ///
    /// # Errors
    /// The same errors as [`open`].
    pub fn open(&mut self, path: &Path) -> Result<Arc<TeSdf>, Failure> {
        // The path of a pipe cannot be canonicalised. A pipe also gives its bytes only once.
        let file = path.canonicalize().unwrap_or_else(|_| path.to_path_buf());
        if let Some(asset) = self.0.get(&file) {
            return Ok(asset.clone());
        }
        let asset = Arc::new(open(path)?);
        self.0.insert(file, asset.clone());
        Ok(asset)
    }
}

/// Checks that the coordinates of assets are in the same unit. Different units are an error. If
/// only some of the assets record a unit, that is a warning.
///
/// # Errors
/// The message names two files and their units.
pub fn check_units<'a>(assets: impl IntoIterator<Item = (&'a Path, &'a TeSdf)>) -> Result<(), Failure> {
    let (mut known, mut without): (Option<(&Path, &str)>, Option<&Path>) = (None, None);
    for (path, asset) in assets {
        match (asset.unit(), known) {
            (None, _) => without = without.or(Some(path)),
            (Some(unit), Some((other, of_other))) if !is_same_unit(unit, of_other) => {
                let [path, other] = [path, other].map(Path::display);
                return Err(Failure::new(format!(
                    "{other} is in {of_other} and {path} in {unit}: their coordinates do not fit together"
                ))
                .hint("encode both meshes in one unit; `tesdf encode --unit` records its name and scales nothing"));
            }
            (Some(unit), _) => known = known.or(Some((path, unit))),
        }
    }
    if let (Some((path, unit)), Some(without)) = (known, without) {
        let [path, without] = [path, without].map(Path::display);
        report::warning(&format!("{without} records no unit and is taken to be in {unit}, as {path} is"));
    }
    Ok(())
}

/// The error as a failure whose message names the file.
pub fn failure(path: &Path, error: &AssetError) -> Failure {
    match error {
        AssetError::Io { .. } => Failure::new(error),
        _ => Failure::new(format!("{}: {error}", path.display())),
    }
}

/// Bounding box of the faces, in the mesh's unit.
pub fn bounds(asset: &TeSdf) -> Aabb {
    (0..asset.face_count()).fold(Aabb::EMPTY, |b, face| b.union(Aabb::of(&asset.face_corners(face))))
}
