//! Reading glTF in a library without the feature `gltf`: an error that names the feature.
use std::path::{Path, PathBuf};

use super::{MeshFormat, RawMesh, ReadError};

pub(super) fn parse(
    _: &[u8],
    format: MeshFormat,
    _: Option<&Path>,
    _: &mut blake3::Hasher,
) -> Result<RawMesh, ReadError> {
    Err(ReadError::NotBuilt { format })
}

pub(super) fn external_files(_: &[u8], _: MeshFormat, _: &Path) -> Vec<PathBuf> {
    Vec::new()
}
