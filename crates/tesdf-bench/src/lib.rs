//! Measurements of tesdf: detection on a device, stage by stage, and the tables of the paper.
//!
//! - [`detection`]: `tesdf bench`.
//! - [`evaluate`]: `tesdf evaluate`.
//!
//! The program `tesdf-bench` compares with peers; it is built with the feature `peers`. Each table says on which
//! processor, when and by which command it was made ([`heading`]).
#![warn(missing_docs)]

pub mod detection;
pub mod evaluate;
pub mod heading;
