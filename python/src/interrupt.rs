//! Runs long work that Ctrl-C can end.
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};
use std::thread;
use std::time::Duration;

use pyo3::prelude::*;

/// Time between two checks for Python's signals.
pub const POLL: Duration = Duration::from_millis(50);

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
    let (slot, ready) = (Mutex::new(None), Condvar::new());
    let locked = || slot.lock().unwrap_or_else(PoisonError::into_inner);
    let wait = |guard: MutexGuard<'_, Option<_>>| {
        drop(ready.wait_timeout_while(guard, POLL, |result| result.is_none()));
    };
    let (result, raised) = thread::scope(|scope| {
        scope.spawn(|| {
            let result = catch_unwind(AssertUnwindSafe(work));
            *locked() = Some(result);
            ready.notify_all();
        });
        let mut raised = None;
        loop {
            py.detach(|| wait(locked()));
            if let Some(result) = locked().take() {
                // Ctrl-C also ends programs that `work` runs. The interrupt then takes precedence
                // over their errors.
                return (result, raised.or_else(|| py.check_signals().err()));
            }
            if raised.is_none()
                && let Err(e) = py.check_signals().and_then(|()| watch())
            {
                cancel();
                raised = Some(e);
            }
        }
    });
    match (raised, result) {
        (Some(e), _) => Err(e),
        (None, Ok(result)) => Ok(result),
        (None, Err(panic)) => resume_unwind(panic),
    }
}
