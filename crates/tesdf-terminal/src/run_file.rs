//! Opening a run the way every command does.
use std::path::Path;

use tesdf_sim::RunRecord;
use tesdf_sim::record::RecordError;

use crate::report::{self, Failure};

/// Opens a run, and says so when it is not complete.
///
/// # Errors
/// As [`RunRecord::open`]; the message names the file.
pub fn open(path: &Path) -> Result<RunRecord, Failure> {
    let record = RunRecord::open(path).map_err(|e| failure(path, e))?;
    if let Some(planned) = record.planned_steps() {
        let (name, made) = (path.display(), record.steps());
        report::note(&format!(
            "{name} has {made} of {planned} steps: it still grows, or it was cut; `tesdf simulate --resume {name}` goes on"
        ));
    }
    Ok(record)
}

/// The error with the file's name.
pub fn failure(path: &Path, error: RecordError) -> Failure {
    match error {
        RecordError::Read { .. } | RecordError::Save(_) => Failure::new(error),
        e => Failure::new(format!("{}: {e}", path.display())),
    }
}
