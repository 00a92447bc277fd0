//! VTU in a library without the feature `vtu`: an error that says so.
use super::{Parsed, ReadTetrahedraError, TetFormat};

pub(super) fn parse(_: &[u8]) -> Result<Parsed, ReadTetrahedraError> {
    Err(ReadTetrahedraError::NotBuilt { format: TetFormat::Vtu })
}
