//! Code of the device. A function with `#[cube]` is also a function of the host, which tests compare it with.
pub mod triangle;
pub mod vector;
