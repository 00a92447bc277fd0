//! Narrow phase: finds the least signed distance over a node, a polygon or a face.
pub mod contact_points;
pub mod exact;
pub mod exact_faces;
pub mod exchange;
pub mod extremes;
pub mod frank_wolfe;
pub mod nodes;
pub mod operations;
pub mod tree_walk;
