//! Encoding by samples.
pub mod sample;
