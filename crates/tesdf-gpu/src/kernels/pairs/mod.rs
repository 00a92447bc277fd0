//! Broad phase: finds pairs of instances, then the meshlets that can touch.
pub mod ahead;
pub mod instance_pairs;
pub mod meshlets;
