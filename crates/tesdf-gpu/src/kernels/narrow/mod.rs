//! Narrow phase: finds the least signed distance over a node or a polygon.
pub mod cones;
pub mod contacts;
pub mod exact;
pub mod exact_faces;
pub mod exchange;
pub mod extremes;
pub mod faces;
pub mod near;
pub mod nodes;
pub mod piece;
pub mod polygon_distance;
pub mod sorted;
pub mod taken;
pub mod work;
pub mod world;
