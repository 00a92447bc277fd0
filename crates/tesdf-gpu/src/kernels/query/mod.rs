//! The signed distance of a shape at a point, and the queries of many points.
pub mod batch;
pub mod face_walk;
pub mod list;
pub mod locate;
pub mod nearest;
pub mod opposing;
pub mod sign;
pub mod tetrahedra;
pub mod value;
pub mod winding;
