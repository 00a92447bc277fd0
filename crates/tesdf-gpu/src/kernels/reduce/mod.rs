//! Reduction: of all contacts of a pair of instances the few that can apply nearly the same wrenches.
pub mod choice;
pub mod frame;
pub mod hull;
pub mod members;
#[expect(clippy::module_inception, reason = "the last kernel of the stage has its name")]
pub mod reduce;
