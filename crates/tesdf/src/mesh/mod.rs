//! From a mesh file to a solid that can be encoded.
mod triangle_mesh;

pub use triangle_mesh::{MeshError, TriangleMesh};
