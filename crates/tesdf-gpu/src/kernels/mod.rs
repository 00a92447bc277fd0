//! Code of the device. A function with `#[cube]` is also a function of the host, which tests compare it with.
#![allow(
    unused_assignments,
    clippy::manual_clamp,
    clippy::manual_div_ceil,
    clippy::manual_is_multiple_of,
    clippy::manual_range_contains,
    clippy::too_many_arguments,
    reason = "kernels have no values of branches, no methods of newer Rust, and one argument a buffer"
)]
pub mod assets;
pub mod broad;
pub mod catalog;
pub mod choice;
pub mod clip;
pub mod cut;
pub mod deform;
pub mod exact;
pub mod field;
pub mod greatest_minimum;
pub mod group;
pub mod hidden;
pub mod hull;
pub mod list;
pub mod locate;
pub mod members;
pub mod narrow;
pub mod nearest;
pub mod outside;
pub mod pairs;
pub mod polygon_distance;
pub mod pose;
pub mod products;
pub mod query;
pub mod reduce;
pub mod sample;
pub mod surface;
pub mod tetrahedra;
pub mod triangle;
pub mod vector;
pub mod wrench;
