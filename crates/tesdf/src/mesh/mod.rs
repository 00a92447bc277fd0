//! Reads, checks, repairs and writes meshes. The product is a [`SolidMesh`], which can be encoded.
mod check;
mod count;
mod defect;
mod hairs;
pub(crate) mod msh;
mod other_rules;
mod polygon;
mod presented;
mod read;
mod repair;
mod solid;
mod split;
mod topology;
mod triangle_mesh;
mod weld;
mod winding;
mod write;

pub use crate::program::ProgramError;
pub use check::{BoundaryLoop, CheckReport, check, check_for};
pub(crate) use check::{FaceClass, Survey, check_and_survey, coordinate_in_range};
pub use defect::{Defect, DefectKind, Severity};
pub use other_rules::other_rules;
pub(crate) use presented::{Presented, Telling};
pub(crate) use read::text;
pub use read::{
    CadError, CadOptions, LoadReport, LoadedMesh, MeshFormat, MeshPart, Origin, Place, ReadError, files,
    read, read_bytes, read_with, source_blake3,
};
pub use repair::{
    AutoRepaired, FillMethod, FilledHole, HoleLeft, LeftReason, RepairError, RepairMode, RepairOptions,
    RepairReport, Repaired, ShellOrientation, SplitEdge, UnknownRepair, closing_tolerance, repair,
    repair_auto,
};
pub use solid::{LoadedSolid, NotSolid, ReadSolidError, SolidMesh, SolidOptions};
pub use split::{NamedMesh, split};
pub use topology::{Edge, EdgeUse, Topology};
pub use triangle_mesh::{MeshError, TriangleMesh};
pub use winding::WindingNumber;
pub use write::{WriteError, WriteFormat, write, write_bytes};
