//! Opens run files for all commands.
use std::path::Path;

use tesdf_sim::RunRecord;
use tesdf_sim::record::RecordError;

use crate::terminal::report::{self, Failure};

/// Most warnings of a run that are printed when it is opened.
const MOST: usize = 8;

/// Opens a run, and prints a note if it is not complete, and its warnings.
///
/// # Errors
/// The same errors as [`RunRecord::open`]. The message names the file.
pub fn open(path: &Path) -> Result<RunRecord, Failure> {
    let record = RunRecord::open(path).map_err(|e| failure(path, e))?;
    if let Some(planned) = record.planned_steps() {
        let (name, made) = (path.display(), record.steps());
        report::note(&format!(
            "{name} has {made} of {planned} steps: it is still running, or it was interrupted; `tesdf simulate --resume {name}` continues it"
        ));
    }
    let (name, warnings) = (path.display(), record.warnings());
    for warning in warnings.iter().take(MOST) {
        report::warning(&format!("{name}: {}", warning.message));
    }
    if warnings.len() > MOST {
        let more = report::count(warnings.len() - MOST, "more warning");
        report::note(&format!("{name} has {more}; `tesdf view {name}` shows all of them"));
    }
    Ok(record)
}

/// The error as a failure whose message names the file.
pub fn failure(path: &Path, error: RecordError) -> Failure {
    match error {
        RecordError::Read { .. } | RecordError::Save(_) => Failure::new(error),
        e => Failure::new(format!("{}: {e}", path.display())),
    }
}
