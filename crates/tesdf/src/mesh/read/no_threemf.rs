//! Reading 3MF in a library without the feature `threemf`: an error that names the feature.
use super::{MeshFormat, RawMesh, ReadError};

pub(super) fn parse(_: &[u8]) -> Result<RawMesh, ReadError> {
    Err(ReadError::NotBuilt { format: MeshFormat::ThreeMf })
}
