//! Reads STEP, IGES and BREP: Gmsh, which carries OpenCASCADE, makes triangles of their surfaces.
use std::path::PathBuf;
use std::time::Duration;

use super::Place;
use crate::base::Length;
use crate::program::ProgramError;

#[cfg(feature = "gmsh")]
mod by_gmsh;
#[cfg(feature = "gmsh")]
mod surface;

#[cfg(feature = "gmsh")]
pub(super) use by_gmsh::parse;

/// How finely the surfaces of a CAD file become triangles, and how to run Gmsh.
#[derive(Clone, Debug, PartialEq)]
pub struct CadOptions {
    /// Largest length that Gmsh aims at for an edge: its option `Mesh.MeshSizeMax`.
    pub mesh_size: Length,
    /// Largest distance between the triangles and the curved surface. It is measured at the middle
    /// of each edge, where Gmsh knows the surface, so it is no proven bound between these places.
    /// If it is exceeded, Gmsh runs again with more edges around each curve.
    pub deviation: Length,
    /// The program. `None` stands for the program that the environment variable `TESDF_GMSH` names,
    /// or else `gmsh`.
    pub executable: Option<PathBuf>,
    /// Time limit of each run of Gmsh.
    pub time_limit: Duration,
}

impl Default for CadOptions {
    /// Edges of up to a tenth, and a deviation of up to a thousandth, of the diagonal.
    fn default() -> Self {
        Self {
            mesh_size: Length::OfDiagonal(0.1),
            deviation: Length::OfDiagonal(1e-3),
            executable: None,
            time_limit: Duration::from_secs(600),
        }
    }
}

/// Why Gmsh gave no triangles of a CAD file.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum CadError {
    /// Gmsh cannot be used.
    #[error("CAD files are read by Gmsh: {0}; or export STL, 3MF or glTF from the CAD program")]
    Program(#[from] ProgramError),
    /// A length is no length.
    #[error("the {what} of {found} is no length; expected a positive one")]
    Length {
        /// The option.
        what: &'static str,
        /// Its value.
        found: Length,
    },
    /// Gmsh took too long.
    #[error("Gmsh was stopped after {0:?}; choose a larger mesh size or deviation")]
    TimeLimit(Duration),
    /// Gmsh gave no triangles.
    #[error("Gmsh gave no triangles: {0}; open the file in a CAD program, or export it again")]
    Failed(String),
    /// The output of Gmsh is not what was expected.
    #[error("the mesh that Gmsh wrote cannot be read: {place}: {found}; try Gmsh 4.15")]
    Output {
        /// The place in the mesh file.
        place: Place,
        /// The content found there.
        found: String,
    },
    /// The triangles are too far from the surface.
    #[error(
        "the triangles of Gmsh are {measured:.3e} from the surface at the middle of an edge, more than the deviation of \
         {wanted:.3e}, also with {turn} edges around a circle; choose a larger deviation or a smaller mesh size"
    )]
    Deviation {
        /// Largest distance found, in the unit of the mesh.
        measured: f64,
        /// Largest distance wanted, in the unit of the mesh.
        wanted: f64,
        /// Edges around a circle in the last run.
        turn: u32,
    },
}
