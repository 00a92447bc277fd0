//! The parts of the command-line tool `tesdf`.
#![warn(missing_docs)]

pub mod slice;
