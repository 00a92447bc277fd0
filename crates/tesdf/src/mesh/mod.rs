//! From a mesh file to a solid that can be encoded.
mod solid;
mod triangle_mesh;

pub use solid::SolidMesh;
pub use triangle_mesh::{MeshError, TriangleMesh};
