//! Reads mesh files for all commands.
use std::path::Path;

use tesdf::Length;
use tesdf::mesh::{CadOptions, LoadReport, LoadedMesh, MeshFormat};

use crate::terminal::parse;
use crate::terminal::report::{Failure, count};

/// The formats of mesh files, for the help of arguments.
pub const MESH_HELP: &str =
    "Mesh file: STL, OBJ, PLY, OFF, glTF, GLB, 3MF, or STEP, IGES, BREP by the program Gmsh";

/// Options for files of CAD programs.
#[derive(clap::Args, Clone, Debug, Default, PartialEq)]
pub struct CadArgs {
    /// STEP, IGES, BREP: longest edge that Gmsh aims at, in millimetres, or in the unit of a BREP
    /// file [default: a tenth of the diagonal]
    #[arg(long, value_name = "LENGTH", value_parser = parse::length)]
    pub mesh_size: Option<f64>,
    /// STEP, IGES, BREP: largest distance between the triangles and the curved surface, measured at
    /// the middle of the edges, in the same unit [default: a thousandth of the diagonal]
    #[arg(long, value_name = "LENGTH", value_parser = parse::length)]
    pub deviation: Option<f64>,
}

impl CadArgs {
    /// Whether one of them is given.
    pub fn is_given(&self) -> bool {
        *self != Self::default()
    }

    /// The options for the library.
    pub fn options(&self) -> CadOptions {
        let default = CadOptions::default();
        CadOptions {
            mesh_size: self.mesh_size.map_or(default.mesh_size, Length::Absolute),
            deviation: self.deviation.map_or(default.deviation, Length::Absolute),
            ..default
        }
    }

    /// Reads a mesh. The error message names the file.
    ///
    /// # Errors
    /// The same errors as [`tesdf::mesh::read_with`], and those of [`check`](Self::check).
    pub fn read(&self, path: &Path) -> Result<LoadedMesh, Failure> {
        self.check(path)?;
        tesdf::mesh::read_with(path, &self.options()).map_err(|e| Failure::new(e.in_file(path)))
    }

    /// # Errors
    /// Options are given, and do not apply to the file.
    pub fn check(&self, path: &Path) -> Result<(), Failure> {
        if self.is_given() && MeshFormat::of_path(path).is_ok_and(|format| !format.is_cad()) {
            return Err(Failure::new(format!(
                "--mesh-size and --deviation are of STEP, IGES and BREP files, and {} is a mesh; leave them out",
                path.display()
            )));
        }
        Ok(())
    }
}

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
