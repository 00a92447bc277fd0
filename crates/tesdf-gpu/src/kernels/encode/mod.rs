//! Encoding by samples.
pub mod sampled;
