//! The tests of the laboratory over several of its modules, in one program.
mod assembly;
mod detection;
mod folder;
mod hoist;
mod on_grid;
mod simulate;
mod support;
mod tables;
mod transmission;
mod voxel;

// Shared with the tests of the library.
#[path = "../../../crates/tesdf/tests/it/support/random.rs"]
#[allow(dead_code)]
mod random;
#[path = "../../../crates/tesdf/tests/it/support/tetrahedra.rs"]
#[allow(dead_code)]
mod tetrahedra;
