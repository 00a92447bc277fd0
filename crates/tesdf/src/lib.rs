//! Exact, memory-lean signed distances to triangle meshes, and the contacts between them.
//!
//! ```text
//! mesh file ──mesh──▶ SolidMesh ──domain, encode──▶ TeSdf ──asset──▶ model.tesdf
//!                                                     └──query──▶ signed distance, gradient,
//!                                                                 closest point, face
//! ```
//!
//! A [`SolidMesh`] is a triangle mesh that has an inside: one without gaps, unless a rule takes
//! others. Its triangles are called *faces*. The *domain* is a set of tetrahedra, the *cells*, in
//! and around the solid. A [`TeSdf`], the *asset*, holds a *list* for each cell: the faces that can
//! be nearest to a point of the cell. The distance at a point is the least distance to the faces on
//! its cell's list. The [`Certificate`] says what the encoder has proved about the lists.
//!
//! Each module uses only modules to its left: `base`, `input`, `save` ← `geometry` ← `mesh` ←
//! `domain` ← `asset` ← `query` ← `verify` ← `encode` ← `deform`. Besides, `collide` comes after
//! `query`, and `inspect` after `asset`.
//!
//! # Signed distances
//!
//! ```
//! use tesdf::TeSdf;
//! use tesdf::glam::DVec3;
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! # let folder = tempfile::tempdir()?;
//! # let path = folder.path().join("part.obj");
//! # let faces = "f 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n";
//! # std::fs::write(&path, format!("v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\n{faces}"))?;
//! let asset = TeSdf::encode_file(&path)?; // or Encoder::new()…encode(&solid), with options
//! // Or query_f32, query_batch, signed_distance.
//! let answer = asset.query(DVec3::new(0.1, 0.3, 0.3));
//! assert!((answer.signed_distance + 0.1).abs() < 1e-12); // 0.1 inside of the side x = 0
//! assert!(answer.gradient.distance(DVec3::NEG_X) < 1e-12);
//! assert!(answer.closest_point.distance(DVec3::new(0.0, 0.3, 0.3)) < 1e-12);
//! assert_eq!(answer.face, 3);
//!
//! asset.save(path.with_extension("tesdf"))?;
//! let asset = TeSdf::open(path.with_extension("tesdf"))?;
//! assert!(asset.signed_distance(DVec3::new(5.0, 0.3, 0.3)) > 0.0);
//! # Ok(())
//! # }
//! ```
//!
//! # Contacts
//!
//! A [`Scene`] holds shapes, and *instances* of them: bodies that share a shape, each with its own
//! pose. [`CollideOptions`] choose the [`Mode`]: the exact minimum over each face (the default), an
//! upper bound of it by the Frank–Wolfe method, or vertices alone.
//!
//! ```
//! use tesdf::glam::DVec3;
//! use tesdf::{CollideOptions, Instance, Pose, Scene, TeSdf, detect};
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! # let folder = tempfile::tempdir()?;
//! # let path = folder.path().join("part.obj");
//! # let faces = "f 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n";
//! # std::fs::write(&path, format!("v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\n{faces}"))?;
//! let mut scene = Scene::new();
//! let part = scene.add_shape(TeSdf::encode_file(&path)?)?;
//! scene.add(Instance::new(part, Pose::IDENTITY))?;
//! scene.add(Instance::new(part, Pose::at(DVec3::new(0.1, 0.1, 0.5))))?;
//! for contact in detect(&scene, &CollideOptions::default())? {
//!     println!("{} {} {}", contact.point_a, contact.normal, contact.distance);
//! }
//! # Ok(())
//! # }
//! ```
//!
//! The main types are here at the root; the modules have the rest.
#![warn(missing_docs)]
#![cfg_attr(docsrs, feature(doc_cfg))]
// What all features use together, some of them leave alone.
#![cfg_attr(
    not(all(feature = "collide", feature = "gltf", feature = "gmsh", feature = "parallel")),
    allow(dead_code, unused_imports)
)]

pub mod asset;
pub mod base;
#[cfg(feature = "collide")]
pub mod collide;
#[cfg(feature = "encode")]
pub mod deform;
pub mod domain;
#[cfg(feature = "encode")]
pub mod encode;
pub mod geometry;
pub mod input;
#[cfg(feature = "encode")]
pub mod inspect;
#[cfg(feature = "encode")]
pub mod mesh;
mod parallel;
#[cfg(feature = "encode")]
mod program;
pub mod query;
#[cfg(feature = "encode")]
mod sampling;
#[cfg(feature = "encode")]
pub mod save;
#[cfg(test)]
pub(crate) mod testing;
#[cfg(feature = "encode")]
pub mod verify;

pub use asset::TeSdf;
pub use asset::about::Source;
pub use base::{Certificate, Length, Progress, Side, Stage};
#[cfg(feature = "collide")]
pub use collide::{
    Clearance, ClearanceOptions, CollideOptions, Contact, Contacts, ContactsPer, FaceOptions, Impact,
    Instance, InstanceId, InstancePairs, Mode, Motion, Pose, Reduction, Scene, Shape, ShapeId, TimeOfImpact,
    TimeOfImpactOptions, Velocity, clearance, detect, detect_with, time_of_impact,
};
#[cfg(feature = "encode")]
pub use encode::{Domain, EncodeOptions, Encoder, Preset};
pub use glam;
#[cfg(feature = "encode")]
pub use mesh::{SolidMesh, TriangleMesh};
pub use query::{Answer, Precision};
