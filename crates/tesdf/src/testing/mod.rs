//! What tests of several stages need: exact arithmetic, degenerate faces and random numbers.
pub mod degenerate;
pub mod exact;
#[path = "../../tests/it/support/rotation.rs"]
#[allow(dead_code, reason = "tests of several stages use the rest")]
pub mod rotation;

/// The next number, from 0 to 1, of a pseudorandom sequence with this state.
pub fn random(state: &mut u64) -> f64 {
    *state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
    (*state >> 11) as f64 / (1u64 << 53) as f64
}
