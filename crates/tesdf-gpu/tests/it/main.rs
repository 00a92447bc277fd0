//! The tests of `tesdf-gpu` over several of its modules, in one program.
mod arrays;
mod compare;
mod conforming;
mod contacts;
mod contacts_per_face;
#[cfg(feature = "cuda")]
mod cuda_source;
mod degenerate;
mod encode;
mod hidden;
mod inside_rules;
mod on_device;
mod queries;
mod reduction;
#[path = "../../../tesdf/tests/it/support/mod.rs"]
mod support;
