//! The signed distance of a shape at a point.
pub mod list;
pub mod locate;
pub mod nearest;
pub mod opposing;
pub mod query;
pub mod rule;
pub mod shapes;
pub mod simple;
pub mod tetrahedra;
pub mod value;
pub mod walk;
pub mod winding;
