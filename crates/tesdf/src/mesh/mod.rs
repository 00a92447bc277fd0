//! From a mesh file to a solid that can be encoded.
mod check;
mod defect;
mod repair;
mod solid;
mod topology;
mod triangle_mesh;

pub use check::{BoundaryLoop, CheckReport, check};
pub use defect::{Defect, DefectKind, Severity};
pub use repair::{RepairError, RepairOptions, RepairReport, Repaired, SplitEdge, repair};
pub use solid::{NotSolid, SolidMesh};
pub use topology::{Edge, EdgeUse, Topology};
pub use triangle_mesh::{MeshError, TriangleMesh};
