//! Ordered pairs of instances, the product of the middle phase, and hidden overlaps.
pub mod candidates;
pub mod hidden;
pub mod ordered_pair;
