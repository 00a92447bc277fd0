//! References that tests of several stages compare with: exact arithmetic and degenerate faces.
pub mod degenerate;
pub mod exact;
