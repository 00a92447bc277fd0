//! Reduction: keeps a few contacts of each pair of instances that can apply nearly the same
//! wrenches as all.
pub mod choice;
pub mod frame;
pub mod members;
pub mod selection;
