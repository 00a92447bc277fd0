//! Code of the device. A function with `#[cube]` is also a function of the host, which tests compare it with.
pub mod assets;
pub mod broad;
pub mod clip;
pub mod exact;
pub mod field;
pub mod list;
pub mod locate;
pub mod narrow;
pub mod nearest;
pub mod pairs;
pub mod polygon_distance;
pub mod pose;
pub mod products;
pub mod query;
pub mod surface;
pub mod triangle;
pub mod vector;
