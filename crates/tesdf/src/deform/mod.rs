//! Moved vertices of an asset with a conforming domain: trees are refitted, lists that no longer hold are found and made anew.
//!
//! In go moves of vertices; out come the asset itself, changed in place, and what was inverted. All cost follows what moved, but for
//! copies of flat arrays.
mod move_vertices;
mod stale;

pub use move_vertices::{DeformError, Moved};
pub use stale::Reencoded;
