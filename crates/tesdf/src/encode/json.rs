//! The JSON files of TES-Encoder, the program of the paper's authors: a surface, the tetrahedra
//! that conform to it, and their lists.
//!
//! - `file` names the keys, `read` reads and checks them.
//! - `import` makes an asset of a file, with the lists as they are; `export` writes an asset.
mod error;
mod export;
mod file;
mod import;
mod read;

pub use error::{ExportJsonError, ImportJsonError};
