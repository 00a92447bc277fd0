//! Reading CAD files in a library without the feature `gmsh`: an error that names the feature.
use super::CadOptions;
use crate::mesh::read::{MeshFormat, RawMesh, ReadError};

pub(in crate::mesh::read) fn parse(
    _: &[u8],
    format: MeshFormat,
    _: &CadOptions,
) -> Result<RawMesh, ReadError> {
    Err(ReadError::NotBuilt { format })
}
