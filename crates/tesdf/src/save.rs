//! Writes files whole or not at all.
//!
//! A [`Destination`] is checked before the work begins and written after it:
//!
//! ```no_run
//! use std::path::Path;
//! use tesdf::save::{Destination, SaveOptions};
//!
//! # fn main() -> Result<(), tesdf::save::SaveError> {
//! let inputs = [Path::new("part.tesdf")];
//! let options = SaveOptions { inputs: &inputs, ..SaveOptions::default() };
//! let output = Destination::new("part.png", &options)?;
//! let picture = b"minutes of work";
//! output.write(picture)?;
//! # Ok(())
//! # }
//! ```
//!
//! - *An input is never an output.* Files are compared by identity (device and inode), so links are
//!   recognised.
//! - *A regular file* is first written as `.tesdf-….part` in the same folder, then renamed. A
//!   reader sees the old file or the whole new file. The new file has the permissions of the old
//!   file, and its owner and group where the system allows that. Access control lists and other
//!   attributes are not kept. A hard link to the old file keeps the old bytes.
//! - *A pipe, a device or an open descriptor* (`/dev/stdout`) is written directly and never
//!   replaced.
//! - *A read-only file* is replaced only with consent ([`ReadOnly`]), as `mv` and `cp` do. The
//!   permission bits decide, even for an administrator, who could write the file anyway.
//! - *Part files of killed processes* are removed by the next write into their folder. A process
//!   holds a lock on its part file. The system releases the lock when the process ends, however it
//!   ends.
mod destination;
mod error;
mod links;
mod part;

use std::path::Path;

pub use destination::{Destination, ReadOnly, SaveOptions};
pub use error::SaveError;
pub use links::is_same_file;
pub use part::{GrowingFile, Part};

/// Writes `bytes` to `path`: checks and writes a [`Destination`] with default options in one step.
///
/// # Errors
/// As [`Destination::new`] and [`Destination::write`]. On an error, a regular file at `path` is
/// unchanged.
pub fn save_atomic(path: impl AsRef<Path>, bytes: &[u8]) -> Result<(), SaveError> {
    Destination::new(path, &SaveOptions::default())?.write(bytes)
}
