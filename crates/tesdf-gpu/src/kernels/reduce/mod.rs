//! Reduction: keeps a few contacts of each pair of instances that can apply nearly the same
//! wrenches as all.
pub mod choice;
pub mod frame;
pub mod hull;
pub mod members;
#[expect(clippy::module_inception, reason = "the last kernel of the stage has its name")]
pub mod reduce;
