//! The code that runs on the device. Folders and files have the names of those of `tesdf`: a file
//! that mirrors one of the processor says so at its head. The module `collide` has the host side. A
//! function with `#[cube]` is also a function of the host: tests compare such functions with those
//! of the processor.
#![allow(
    unused_assignments,
    clippy::manual_clamp,
    clippy::manual_div_ceil,
    clippy::manual_is_multiple_of,
    clippy::manual_range_contains,
    reason = "CubeCL has none of these methods"
)]
pub mod bodies;
pub mod catalog;
pub mod cones;
pub mod counters;
pub mod deform;
pub mod detect;
pub mod encode;
pub mod geometry;
pub mod interior;
pub mod narrow;
pub mod pairs;
pub mod query;
pub mod report;
pub mod scene;
pub mod search;

/// Threads per group in kernels where each thread works alone.
pub const GROUP: u32 = 64;
