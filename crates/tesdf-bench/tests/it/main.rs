//! The tests of `tesdf-bench` over several of its modules, in one program.
mod voxel;
