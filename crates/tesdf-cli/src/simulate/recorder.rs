//! Records a run while it is simulated.
use std::ops::ControlFlow;
use std::path::Path;

use tesdf::save::Destination;
use tesdf_sim::record::RecordError;
use tesdf_sim::{InterruptedRun, Moment, RunJournal, RunOrigin, RunRecord, SimulateError};

use crate::terminal::output;
use crate::terminal::report::Failure;

/// Records each step of a run at its destination. The first step replaces the existing file.
pub struct Recorder<'a> {
    destination: &'a Destination,
    origin: &'a RunOrigin,
    /// The interrupted run that is resumed.
    earlier: Option<&'a InterruptedRun>,
    /// `None` before the first step, and when the destination is a pipe or device.
    journal: Option<RunJournal>,
    /// Why the last step could not be recorded.
    failed: Option<RecordError>,
    /// Number of steps of the whole run.
    steps: u64,
}

impl<'a> Recorder<'a> {
    pub fn new(
        destination: &'a Destination,
        origin: &'a RunOrigin,
        earlier: Option<&'a InterruptedRun>,
    ) -> Self {
        Self { destination, origin, earlier, journal: None, failed: None, steps: 0 }
    }

    /// Records a step. Stops the run when that fails; [`failure`](Self::failure) then has the
    /// reason.
    pub fn push(&mut self, moment: &Moment<'_>) -> ControlFlow<()> {
        self.steps = moment.steps;
        match self.try_push(moment) {
            Ok(()) => ControlFlow::Continue(()),
            Err(e) => {
                self.failed = Some(e);
                ControlFlow::Break(())
            }
        }
    }

    fn try_push(&mut self, moment: &Moment<'_>) -> Result<(), RecordError> {
        if self.destination.file_path().is_none() {
            return Ok(());
        }
        if self.journal.is_none() {
            self.journal = match self.earlier {
                Some(earlier) => RunJournal::resume(self.destination, earlier)?,
                None => RunJournal::begin(self.destination, moment.record, self.origin)?,
            };
        }
        match &mut self.journal {
            Some(journal) => journal.push(moment.record, &moment.report),
            None => Ok(()),
        }
    }

    /// Replaces the journal by the complete run.
    ///
    /// # Errors
    /// The file cannot be written. The journal then remains.
    pub fn finish(mut self, record: &RunRecord) -> Result<(), Failure> {
        let bytes = record.to_bytes().map_err(Failure::new)?;
        let is_recorded = self.journal.is_some();
        // Some systems cannot replace an open file.
        self.journal = None;
        output::write(self.destination, &bytes).map_err(|e| match is_recorded {
            true => e.hint(self.next()),
            false => e,
        })
    }

    /// Why the run ended early, and what is left of it.
    pub fn failure(&mut self, error: SimulateError, source: &Path) -> Failure {
        let path = self.destination.path().display();
        let kept = match (&self.journal, self.destination.file_path()) {
            (Some(_), _) => format!("{path} has the previous steps"),
            (None, Some(_)) => format!("{path} is unchanged"),
            (None, None) => "nothing was written".into(),
        };
        let failure = match (self.failed.take(), error) {
            (Some(error), _) => Failure::new(format!("{error}; {kept}")),
            (None, SimulateError::Interrupted { steps }) => {
                let kept = if self.journal.is_some() { format!("{path} has them") } else { kept };
                Failure::new(format!("interrupted after {steps} of {} steps; {kept}", self.steps))
            }
            (None, error) => Failure::new(format!("{}: {error}; {kept}", source.display())),
        };
        match self.journal {
            Some(_) => failure.hint(self.next()),
            None => failure,
        }
    }

    fn next(&self) -> String {
        format!("`tesdf simulate --resume {}` continues from there", self.destination.path().display())
    }
}
