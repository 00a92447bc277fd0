//! Middle phase: finds the cells of nodes, the polygons of faces, and hidden overlaps.
pub mod bits;
pub mod branches;
pub mod clip;
pub mod corners;
pub mod cut;
pub mod faces;
pub mod hidden;
pub mod items;
pub mod nodes;
pub mod outside;
pub mod walk;
