//! Middle phase: the cells of nodes and the polygons of faces; hidden overlaps.
pub mod bits;
pub mod clip;
pub mod corners;
pub mod cut;
pub mod hidden;
pub mod items;
pub mod nodes;
pub mod outside;
