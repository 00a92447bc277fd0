//! What tests of several stages compare with: exact arithmetic, and faces of degenerate shapes.
pub mod degenerate;
pub mod exact;
