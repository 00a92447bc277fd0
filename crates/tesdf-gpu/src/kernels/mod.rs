//! Code of the device, by stage; `collide` has the host side of each. A function with `#[cube]` is also a function of the
//! host, which tests compare with the processor's.
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
