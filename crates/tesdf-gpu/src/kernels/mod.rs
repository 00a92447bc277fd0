//! The code that runs on the device, by stage. The module `collide` has the host side of each
//! stage. A function with `#[cube]` is also a function of the host: tests compare such functions
//! with those of the processor.
#![allow(
    unused_assignments,
    clippy::manual_clamp,
    clippy::manual_div_ceil,
    clippy::manual_is_multiple_of,
    clippy::manual_range_contains,
    reason = "CubeCL has none of these methods"
)]
pub mod broad;
pub mod catalog;
pub mod counters;
pub mod deform;
pub mod encode;
pub mod field;
pub mod math;
pub mod middle;
pub mod narrow;
pub mod reduce;

/// Threads per group in kernels where each thread works alone.
pub const GROUP: u32 = 64;
