//! What the commands of tesdf share: reports, progress, values of options, opening of files and devices.
//!
//! stdout carries only a command's result; notes, warnings, errors and progress go to stderr.
#![warn(missing_docs)]

pub mod asset_file;
pub mod device;
pub mod mesh_file;
pub mod output;
pub mod parse;
pub mod progress;
pub mod report;
pub mod run_file;
