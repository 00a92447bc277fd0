//! Long work that Ctrl-C ends.
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};
use std::thread;
use std::time::Duration;

use pyo3::prelude::*;

/// Time between two looks at Python's signals.
const POLL: Duration = Duration::from_millis(50);

/// Runs `work` on a thread of its own with the interpreter's lock free. In between `watch` is called, and Python handles its
/// signals; when either raises, `cancel` is called and the error is given once `work` has ended.
///
/// # Errors
/// `KeyboardInterrupt` after Ctrl-C, or what `watch` raised.
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
                // Ctrl-C ends programs that `work` has run, too, and then it is not their error that counts.
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
