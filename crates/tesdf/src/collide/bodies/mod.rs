//! The two sides of a pair: the surface of one body, and the field of the other.
pub mod branch;
pub mod clip;
pub mod field;
pub mod jump;
pub mod polygon;
pub mod reach;
pub mod round_side;
pub mod surface;
pub mod turned;
