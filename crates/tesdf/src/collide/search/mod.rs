//! Best-first search for the lowest point of surfaces: a queue of parts with lower bounds.
pub mod bulge;
pub mod depth_bounds;
pub mod greatest_minimum;
pub mod longest_edge;
pub mod lowest_point;
pub mod piece;
pub mod queue;
