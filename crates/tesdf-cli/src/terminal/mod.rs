//! Shared parts of tesdf's commands: reports, progress bars, option values, input and output files,
//! and devices.
//!
//! Stdout carries only a command's result; notes, warnings, errors and progress go to stderr.
pub mod asset_file;
pub mod device;
pub mod files;
pub mod interrupt;
pub mod mesh_file;
pub mod output;
pub mod parse;
pub mod progress;
pub mod report;
pub mod run_file;
