//! Moves the vertices of an asset with a conforming domain. Its trees are refitted, and lists that
//! no longer hold are found and made anew.
//!
//! The input is a list of moves. The asset is changed in place, and inverted tetrahedra are
//! reported. The cost follows the number of moved vertices, except for copies of flat arrays.
mod move_vertices;
mod stale;

#[doc(hidden)]
pub use move_vertices::FARTHEST;
pub use move_vertices::{DeformError, Moved};
pub use stale::Reencoded;
