//! Runs the program on the surface of a solid.
use super::{GmshError, GmshOptions, RefusedBecause, input::SURFACE};
use crate::base::Progress;
use crate::domain::{TetMesh, read_tetrahedra};
use crate::program::{Gmsh, RunError};

const SCRIPT: &str = "domain.geo";
const RESULT: &str = "domain.msh";

/// Runs Gmsh and returns its tetrahedra, in the local frame. The inner error is one that other
/// settings may not have.
pub(super) fn run(
    surface: &str,
    script: &str,
    options: &GmshOptions,
    progress: &Progress,
) -> Result<Result<TetMesh, RefusedBecause>, GmshError> {
    let gmsh = Gmsh::new(options.executable.as_deref())?;
    gmsh.write(SURFACE, surface)?;
    gmsh.write(SCRIPT, script)?;
    let arguments = [SCRIPT, "-3", "-format", "msh2", "-bin", "-o", RESULT, "-nt", "1", "-v", "3"];
    let printed = match gmsh.run(&arguments, options.time_limit, progress) {
        Ok(printed) => printed,
        Err(RunError::TimeLimit) => return Ok(Err(RefusedBecause::TimeLimit(options.time_limit))),
        Err(RunError::Program(error)) => return Err(error.into()),
        Err(RunError::Cancelled) => return Err(GmshError::Cancelled),
    };
    let result = gmsh.path(RESULT);
    if !result.exists() {
        return Ok(Err(RefusedBecause::Gmsh(gmsh.why_no_result(&printed)?)));
    }
    Ok(read_tetrahedra(&result).map_err(|error| match printed.first_error() {
        // Such a message, for example "no elements in volume", says more than that the file has no
        // tetrahedra.
        Some(said) => RefusedBecause::Gmsh(said),
        None => RefusedBecause::Read(error),
    }))
}
