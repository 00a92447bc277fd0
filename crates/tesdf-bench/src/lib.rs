//! Measurements of tesdf: detection on a device, stage by stage, and the tables of the paper.
//!
//! - [`detection`]: `tesdf bench`.
//! - [`evaluate`]: `tesdf evaluate`.
//! - [`voxel`]: voxel grids, which Table III compares with.
//!
//! [`preset`] has the presets of the encoder that they compare.
//!
//! The program `tesdf-bench` compares tesdf with peers; it needs the feature `peers`. Each table
//! names its processor, date and command ([`heading`]).
#![warn(missing_docs)]

pub mod detection;
pub mod evaluate;
pub mod heading;
pub mod preset;
pub mod voxel;
