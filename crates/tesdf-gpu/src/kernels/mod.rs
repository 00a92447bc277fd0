//! Code of the device. A function with `#[cube]` is also a function of the host, which tests compare it with.
pub mod assets;
pub mod field;
pub mod list;
pub mod locate;
pub mod nearest;
pub mod pose;
pub mod query;
pub mod triangle;
pub mod vector;
