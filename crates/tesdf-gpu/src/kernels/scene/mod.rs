//! Shapes and poses of instances as the device holds them.
pub mod pose;
pub mod pose_arrays;
pub mod shape;
pub mod simple;
