//! Narrow phase: finds the least signed distance over a node or a polygon.
pub mod contacts;
pub mod exact;
pub mod exchange;
pub mod faces;
pub mod nodes;
pub mod piece;
pub mod polygon_distance;
