//! References that tests of several stages compare with: exact arithmetic and degenerate faces.
pub mod degenerate;
pub mod exact;
#[path = "../../tests/it/support/rotation.rs"]
#[allow(dead_code, reason = "tests of several stages use the rest")]
pub mod rotation;
