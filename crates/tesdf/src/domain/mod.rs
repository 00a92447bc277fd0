//! What the encoder fills with lists: tetrahedra around a surface.
//!
//! - The embedded domain, always there: a cube of six Kuhn tetrahedra, refined by newest-vertex bisection. Comes in:
//!   bounds and an outer band. Goes out: cells, named by their path from a root, whose geometry nothing stores.
//! - The conforming domain: tetrahedra that have the faces of the surface as sides. Comes in: a [`SolidMesh`] and a
//!   [`TetMesh`] from a file or a mesher. Goes out: a [`ConformingMesh`], checked.
//!
//! [`SolidMesh`]: crate::mesh::SolidMesh
mod bisection;
mod classes;
mod conforming;
mod cube;
pub mod gmsh;
mod read;
mod sides;
mod tet_mesh;

pub use bisection::{Barycentric, Cell, MAX_DEPTH, ROOTS};
pub use classes::Classes;
pub use conforming::{ConformingError, ConformingMesh, MissingFace};
pub use cube::DomainCube;
pub use read::{
    LoadedTetrahedra, ReadTetrahedraError, Skipped, TetFormat, load_tetrahedra, read_tetrahedra,
    tetrahedra_files,
};
pub use tet_mesh::{TetMesh, TetMeshError};
