//! Reads mesh files for all commands.
use std::path::Path;

use tesdf::mesh::{LoadReport, LoadedMesh};

use crate::report::{Failure, count};

/// Reads a mesh. The error message names the file.
///
/// # Errors
/// The same errors as [`tesdf::mesh::read`].
pub fn read(path: &Path) -> Result<LoadedMesh, Failure> {
    tesdf::mesh::read(path).map_err(|e| Failure::new(e.in_file(path)))
}

/// A description of what was read, as lines of text.
pub fn describe(path: &Path, load: &LoadReport) -> String {
    let LoadReport { format, vertices_in_file, faces_in_file, .. } = load;
    let (faces, vertices) = (count(*faces_in_file, "face"), count(*vertices_in_file, "vertex"));
    let mut text = format!("{}: {format}, {faces}, {vertices}\n", path.display());
    for note in &load.notes {
        text += &format!("note: {note}\n");
    }
    text
}
