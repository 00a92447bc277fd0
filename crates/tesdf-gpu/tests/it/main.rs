//! The tests of `tesdf-gpu` over several of its modules, in one program.
mod arrays;
mod compare;
mod conforming;
mod contacts;
mod contacts_per_face;
#[cfg(feature = "cuda")]
mod cuda_source;
mod degenerate;
#[cfg(feature = "cuda")]
mod driver_faults;
mod encode;
mod flush_patches;
mod hidden;
mod inside_rules;
#[cfg(feature = "cuda")]
mod islands;
mod normal_cones;
#[cfg(feature = "cuda")]
mod nvrtc;
mod on_device;
mod order;
mod queries;
mod reduction;
mod smoke;
#[path = "../../../tesdf/tests/it/support/mod.rs"]
mod support;
