//! Exact, memory-lean signed distances of arbitrary triangle meshes.
#![warn(missing_docs)]

pub mod asset;
pub mod domain;
pub mod encode;
pub mod geometry;
pub mod inspect;
pub mod mesh;
pub mod query;
mod sampling;
pub mod verify;

pub use asset::TeSdf;
pub use glam;
