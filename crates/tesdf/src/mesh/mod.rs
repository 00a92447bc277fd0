//! From a mesh file to a solid that can be encoded.
mod polygon;
mod read;
mod triangle_mesh;
mod weld;
mod write;

pub use read::{LoadReport, LoadedMesh, MeshFormat, Origin, Place, ReadError, read, read_bytes};
pub use triangle_mesh::{MeshError, TriangleMesh};
pub use write::{WriteError, WriteFormat, write};
