//! The interior point method for the problems of islands, in `f64`. Mirrors `newton/interior` of
//! `tesdf-sim`.
pub mod descend;
pub mod problem;
pub mod row;
pub mod system;
