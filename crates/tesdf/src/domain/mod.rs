//! Domains: the tetrahedra around a surface, to which the encoder gives lists.
//!
//! - The bisection domain is a cube of six Kuhn tetrahedra, refined by newest-vertex bisection. The
//!   input is bounds and an outer band. The output is cells, each named by its path from a root, so
//!   that their geometry needs no storage.
//! - The conforming domain consists of tetrahedra that have the faces of the surface as sides. The
//!   input is a [`SolidMesh`] and a [`TetMesh`] from a file or a mesher. The output is a
//!   [`ConformingMesh`], which was checked.
//!
//! [`SolidMesh`]: crate::mesh::SolidMesh
mod bisection;
mod classes;
#[cfg(feature = "encode")]
mod conforming;
mod cube;
#[cfg(feature = "gmsh")]
pub mod gmsh;
#[cfg(feature = "encode")]
mod read;
#[cfg(feature = "encode")]
mod sides;
#[cfg(feature = "encode")]
mod tet_mesh;

pub use bisection::{Barycentric, Cell, MAX_DEPTH, ROOTS};
pub use classes::Classes;
#[cfg(feature = "encode")]
pub use conforming::{ConformingError, ConformingMesh, MissingFace};
pub use cube::DomainCube;
#[cfg(feature = "encode")]
pub use read::{
    LoadedTetrahedra, ReadTetrahedraError, Skipped, TetFormat, load_tetrahedra, read_tetrahedra,
    tetrahedra_files,
};
#[cfg(feature = "encode")]
pub use tet_mesh::{TetMesh, TetMeshError};
