//! Ctrl-C, and the signals by which a system ends a process.
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, TryLockError};
use std::thread;
use std::time::{Duration, Instant};

use crate::terminal::report::{self, Failure};

/// How long the work may take to notice that it is to end.
const GRACE: Duration = Duration::from_secs(1);

static INTERRUPTED: AtomicBool = AtomicBool::new(false);
/// Whether the command looks at the flag.
static IS_WATCHED: AtomicBool = AtomicBool::new(false);
/// Held by [`undisturbed`] work, and from the end on.
static UNDISTURBED: Mutex<()> = Mutex::new(());

/// Lets Ctrl-C, SIGTERM and SIGHUP end the command with exit code 2: at once where it does not look
/// at the [`flag`], and otherwise when it sees the flag, but within a second. The second signal
/// ends it at once. A process that ignores SIGHUP, as those of `nohup` do, goes on ignoring it.
///
/// # Errors
/// The system refuses the handler.
pub fn install() -> Result<(), Failure> {
    #[cfg(unix)]
    let ignored = is_ignored(libc::SIGHUP);
    ctrlc::set_handler(|| {
        let again = INTERRUPTED.swap(true, Ordering::Relaxed);
        let later = || {
            thread::sleep(GRACE);
            end();
        };
        if !again && IS_WATCHED.load(Ordering::Relaxed) && thread::Builder::new().spawn(later).is_ok() {
            return;
        }
        end();
    })
    .map_err(|e| match e {
        ctrlc::Error::System(reason) => Failure::new(format!("cannot handle Ctrl-C: {reason}")),
        e => Failure::new(format!("cannot handle Ctrl-C: {e}")),
    })?;
    #[cfg(unix)]
    if ignored {
        // SAFETY: it only sets that the signal is ignored, as it was.
        unsafe { libc::signal(libc::SIGHUP, libc::SIG_IGN) };
    }
    Ok(())
}

/// A flag that the first signal sets. Who asks for it ends soon after it is set.
pub fn flag() -> &'static AtomicBool {
    IS_WATCHED.store(true, Ordering::Relaxed);
    &INTERRUPTED
}

/// Does what leaves a file behind if the process ends in the midst of it: the end waits for it, but
/// at most a second.
pub fn undisturbed<T>(work: impl FnOnce() -> T) -> T {
    let _held = UNDISTURBED.lock();
    work()
}

/// Ends the process. Files are written under a temporary name and then renamed, so no incomplete
/// file has its final name. The journal of a run is readable up to its last complete step.
fn end() {
    let start = Instant::now();
    let _held = loop {
        match UNDISTURBED.try_lock() {
            Err(TryLockError::WouldBlock) if start.elapsed() < GRACE => {
                thread::sleep(Duration::from_millis(1));
            }
            held => break held,
        }
    };
    report::error(&Failure::new("interrupted; no output is half written, and a run holds its steps so far"));
    std::process::exit(2);
}

#[cfg(unix)]
fn is_ignored(signal: libc::c_int) -> bool {
    // SAFETY: a null action changes nothing, and the old one is written to a local variable.
    unsafe {
        let mut before: libc::sigaction = std::mem::zeroed();
        libc::sigaction(signal, std::ptr::null(), &raw mut before) == 0
            && before.sa_sigaction == libc::SIG_IGN
    }
}
