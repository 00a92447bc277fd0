//! Broad phase: finds pairs of instances, then the meshlets that can touch.
pub mod ahead;
pub mod meshlets;
pub mod ordered_pair;
pub mod pairs;
pub mod place;
