use std::fmt;

use glam::DVec3;

use super::GmshSettings;
use crate::domain::{ConformingError, ReadTetrahedraError, TetMeshError};
use crate::program::ProgramError;

/// Why Gmsh did not give tetrahedra.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum GmshError {
    /// Gmsh cannot be used.
    #[error(transparent)]
    Program(#[from] ProgramError),
    /// The layer around the solid has no width.
    #[error(
        "the band of {width:e} is no layer around a solid with a diagonal of {diagonal:e}; expected a positive length, or no \
         band"
    )]
    Band {
        /// The width, in the unit of the mesh.
        width: f64,
        /// The diagonal of the solid, in the unit of the mesh.
        diagonal: f64,
    },
    /// A region is no box.
    #[error(
        "region {index} (0-based) from {min} to {max} is no box; expected finite corners, the lesser first"
    )]
    Region {
        /// Number of the region.
        index: usize,
        /// First corner.
        min: DVec3,
        /// Second corner.
        max: DVec3,
    },
    /// The caller asked to stop.
    #[error("the run of Gmsh was cancelled")]
    Cancelled,
    /// No settings gave tetrahedra that conform.
    #[error("{}", describe(.0))]
    AllRefused(
        /// The error of each of the settings.
        Vec<Refused>,
    ),
}

/// Settings that did not give tetrahedra that conform.
#[derive(Debug)]
pub struct Refused {
    /// The settings.
    pub settings: GmshSettings,
    /// The reason.
    pub because: RefusedBecause,
}

/// Why settings did not give tetrahedra that conform.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum RefusedBecause {
    /// Gmsh ended with an error.
    #[error("Gmsh gave no tetrahedra: {0}")]
    Gmsh(
        /// The end of its output.
        String,
    ),
    /// Gmsh took too long.
    #[error("Gmsh was stopped after {0:?}")]
    TimeLimit(
        /// The time limit.
        std::time::Duration,
    ),
    /// The file that Gmsh wrote cannot be read.
    #[error(transparent)]
    Read(ReadTetrahedraError),
    /// The tetrahedra of Gmsh do not make a mesh.
    #[error(transparent)]
    Mesh(#[from] TetMeshError),
    /// The tetrahedra of Gmsh do not conform to the surface.
    #[error(transparent)]
    Gate(#[from] ConformingError),
}

impl fmt::Display for Refused {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: {}", self.settings, self.because)
    }
}

fn describe(refused: &[Refused]) -> String {
    if refused.is_empty() {
        return "no settings for Gmsh to try; expected at least one".to_owned();
    }
    let mut text = "Gmsh gave no tetrahedra that conform to the surface:\n".to_owned();
    for refused in refused {
        text += &format!("  {refused}\n");
    }
    text + "Look at the surface with `tesdf check`, mesh it with another program and give the file, or use the bisection \
            domain, which needs no mesher"
}
