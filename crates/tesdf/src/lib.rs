//! Exact, memory-lean signed distances of arbitrary triangle meshes.
//!
//! ```text
//! mesh file ──mesh──▶ SolidMesh ──domain, encode──▶ TeSdf ──asset──▶ model.tesdf
//!                                                     └──query──▶ signed distance, gradient, closest point, face
//! ```
//!
//! Each module uses only modules to its left: `base`, `input`, `save` ← `geometry` ← `mesh` ←
//! `domain` ← `asset` ← `query` ← `verify` ← `encode` ← `deform`. Besides, `collide` comes after
//! `query`, `evaluate` after `verify`, and `inspect` after `asset`.
//!
//! ```
//! use tesdf::Progress;
//! use tesdf::asset::about::Source;
//! use tesdf::encode::{EncodeOptions, encode};
//! use tesdf::glam::DVec3;
//! use tesdf::mesh::{MeshFormat, SolidMesh, read_bytes};
//! use tesdf::query::Precision;
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let obj = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n";
//! let mesh = read_bytes(obj.as_bytes(), MeshFormat::Obj)?.mesh; // or mesh::read(path)
//! let solid = SolidMesh::new(mesh)?; // has an inside, or the error says what is wrong where
//! let asset = encode(&solid, &Source::default(), &EncodeOptions::default(), &Progress::default())?;
//!
//! let answer = asset.query(DVec3::new(0.1, 0.3, 0.3), Precision::F64);
//! assert!((answer.signed_distance + 0.1).abs() < 1e-12); // 0.1 inside of the side x = 0
//! assert!(answer.gradient.distance(DVec3::NEG_X) < 1e-12);
//! assert!(answer.closest_point.distance(DVec3::new(0.0, 0.3, 0.3)) < 1e-12);
//! assert_eq!(answer.face, 3);
//!
//! let asset = tesdf::TeSdf::from_bytes(asset.as_bytes())?; // or asset.save(path) and TeSdf::open(path)
//! assert!(asset.signed_distance(DVec3::new(5.0, 0.3, 0.3), Precision::F32) > 0.0);
//! # Ok(())
//! # }
//! ```
#![warn(missing_docs)]
#![cfg_attr(docsrs, feature(doc_cfg))]
// What all features use together, some of them leave alone.
#![cfg_attr(
    not(all(
        feature = "collide",
        feature = "gltf",
        feature = "gmsh",
        feature = "parallel",
        feature = "vtu"
    )),
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
#[cfg(feature = "encode")]
pub mod evaluate;
pub mod geometry;
pub mod input;
#[cfg(feature = "encode")]
pub mod inspect;
#[cfg(feature = "encode")]
pub mod mesh;
mod parallel;
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
pub use base::{Certificate, Length, Progress, Side, Stage};
pub use glam;
