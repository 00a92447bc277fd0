//! Opening a `.tesdf` file the way every command does.
use std::path::Path;

use tesdf::TeSdf;
use tesdf::asset::AssetError;
use tesdf::geometry::Aabb;

use crate::report::Failure;

/// Opens an asset; the message names the file.
///
/// # Errors
/// As [`TeSdf::open`].
pub fn open(path: &Path) -> Result<TeSdf, Failure> {
    TeSdf::open(path).map_err(|e| failure(path, &e))
}

/// The error with the file's name.
pub fn failure(path: &Path, error: &AssetError) -> Failure {
    match error {
        AssetError::Io { .. } => Failure::new(error),
        _ => Failure::new(format!("{}: {error}", path.display())),
    }
}

/// Bounds of the faces, mesh unit.
pub fn bounds(asset: &TeSdf) -> Aabb {
    (0..asset.face_count()).fold(Aabb::EMPTY, |b, face| b.union(Aabb::of(&asset.face_corners(face))))
}
