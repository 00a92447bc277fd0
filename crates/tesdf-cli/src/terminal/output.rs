//! Output files: every command that writes a file opens it here, before the work.
use std::path::{Path, PathBuf};

use tesdf::save::{Destination, ReadOnly, SaveError, SaveOptions};

use crate::terminal::interrupt;
use crate::terminal::report::{self, Failure};

/// The option of every command that writes a file.
#[derive(clap::Args, Clone, Copy, Debug)]
pub struct Consent {
    /// Replace the output even if it is read-only; its permissions are kept
    #[arg(long)]
    pub force: bool,
}

impl Consent {
    fn read_only(self) -> ReadOnly {
        if self.force { ReadOnly::Replace } else { ReadOnly::Keep }
    }
}

/// Checks that `path` can be written and is not an input. If it is stdout, results for users go to
/// stderr from then on.
///
/// # Errors
/// Those of [`Destination::new`].
pub fn open(path: &Path, inputs: &[PathBuf], consent: Consent) -> Result<Destination, Failure> {
    let inputs: Vec<&Path> = inputs.iter().map(PathBuf::as_path).collect();
    let options = SaveOptions { inputs: &inputs, read_only: consent.read_only() };
    // It creates a file and removes it.
    let destination = interrupt::undisturbed(|| Destination::new(path, &options)).map_err(failure)?;
    if destination.is_stdout() {
        report::leave_stdout_to_the_output();
    }
    Ok(destination)
}

/// Writes the bytes of the result.
///
/// # Errors
/// The same errors as [`Destination::write`].
pub fn write(destination: &Destination, bytes: &[u8]) -> Result<(), Failure> {
    destination.write(bytes).map_err(failure)
}

fn failure(error: SaveError) -> Failure {
    let hint = match error {
        SaveError::Input { .. } => Some("give another file to -o"),
        SaveError::ReadOnly { .. } => Some("--force replaces it and keeps its permissions"),
        SaveError::Busy { .. } => Some("wait for that process, or give another file to -o"),
        _ => None,
    };
    let failure = Failure::new(error);
    match hint {
        Some(hint) => failure.hint(hint),
        None => failure,
    }
}
