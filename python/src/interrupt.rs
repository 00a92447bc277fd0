//! Runs long work that Ctrl-C can end.
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

use pyo3::prelude::*;

/// Time between two checks for Python's signals.
pub const POLL: Duration = Duration::from_millis(50);
/// Time that work that owns what it uses has to end after an exception.
const GRACE: Duration = Duration::from_millis(250);

/// Runs `work` on a separate thread without the interpreter's lock. Meanwhile this thread lets
/// Python handle signals and calls `watch`. When either raises, it calls `cancel`, waits for
/// `work`, and returns the exception.
///
/// # Errors
/// `KeyboardInterrupt` after Ctrl-C, or the exception of `watch`.
pub fn cancellable<T: Send>(
    py: Python<'_>,
    work: impl FnOnce() -> T + Send,
    cancel: impl Fn(),
    watch: impl Fn() -> PyResult<()>,
) -> PyResult<T> {
    let slot = Slot::new();
    thread::scope(|scope| {
        scope.spawn(|| slot.fill(work));
        slot.wait(py, cancel, watch, None)
    })
}

/// As [`cancellable`], for work that owns what it uses. Reading, checking and repairing a mesh do
/// not notice that they are cancelled; after [`GRACE`] they go on by themselves to their end, and
/// the exception is returned.
///
/// # Errors
/// The same as for [`cancellable`].
pub fn abandonable<T: Send + 'static>(
    py: Python<'_>,
    work: impl FnOnce() -> T + Send + 'static,
    cancel: impl Fn(),
    watch: impl Fn() -> PyResult<()>,
) -> PyResult<T> {
    let slot = Arc::new(Slot::new());
    let filled = Arc::clone(&slot);
    thread::Builder::new().spawn(move || filled.fill(work))?;
    slot.wait(py, cancel, watch, Some(GRACE))
}

/// What work returns, once it has ended, or its panic.
struct Slot<T> {
    result: Mutex<Option<thread::Result<T>>>,
    ready: Condvar,
}

impl<T: Send> Slot<T> {
    fn new() -> Self {
        Self { result: Mutex::new(None), ready: Condvar::new() }
    }

    fn locked(&self) -> MutexGuard<'_, Option<thread::Result<T>>> {
        self.result.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn fill(&self, work: impl FnOnce() -> T) {
        let result = catch_unwind(AssertUnwindSafe(work));
        *self.locked() = Some(result);
        self.ready.notify_all();
    }

    /// Waits for the result, or after an exception for no longer than `grace`.
    fn wait(
        &self,
        py: Python<'_>,
        cancel: impl Fn(),
        watch: impl Fn() -> PyResult<()>,
        grace: Option<Duration>,
    ) -> PyResult<T> {
        let mut raised: Option<(PyErr, Instant)> = None;
        loop {
            py.detach(|| {
                drop(self.ready.wait_timeout_while(self.locked(), POLL, |result| result.is_none()));
            });
            if let Some(result) = self.locked().take() {
                // Ctrl-C also ends programs that `work` runs. The interrupt then takes precedence
                // over their errors.
                return match raised.map(|(e, _)| e).or_else(|| py.check_signals().err()) {
                    Some(e) => Err(e),
                    None => result.map_or_else(|panic| resume_unwind(panic), Ok),
                };
            }
            match raised.take() {
                Some((e, at)) if grace.is_some_and(|grace| at.elapsed() >= grace) => return Err(e),
                Some(before) => raised = Some(before),
                None => {
                    if let Err(e) = py.check_signals().and_then(|()| watch()) {
                        cancel();
                        raised = Some((e, Instant::now()));
                    }
                }
            }
        }
    }
}
