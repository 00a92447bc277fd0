//! Progress on stderr and Ctrl-C.
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::Duration;

use indicatif::{ProgressBar, ProgressStyle};
use tesdf::{Progress, Stage};

use crate::report::Failure;

/// A bar on stderr, with an estimate of the time left; nothing is drawn when stderr is not a terminal.
#[derive(Debug)]
pub struct Bar {
    bar: ProgressBar,
}

/// The bar's steps: finer than it can be drawn.
const STEPS: u64 = 10_000;

impl Bar {
    /// A bar named after what is being done, such as `encoding`.
    pub fn new(what: &'static str) -> Self {
        let bar = ProgressBar::new(STEPS).with_message(what);
        if let Ok(style) = ProgressStyle::with_template("{msg} [{bar:40}] {percent:>3} %  {eta} left") {
            bar.set_style(style.progress_chars("=> "));
        }
        bar.enable_steady_tick(Duration::from_millis(200));
        Self { bar }
    }

    /// Names what is being done now; the estimate begins anew when that changes.
    pub fn stage(&self, what: &'static str) {
        if self.bar.message() != what {
            self.bar.set_message(what);
            self.bar.set_position(0);
            self.bar.reset_eta();
        }
    }

    /// Sets the share done, 0 to 1; may be called from any thread.
    pub fn set(&self, share: f64) {
        self.bar.set_position((share.clamp(0.0, 1.0) * STEPS as f64) as u64);
    }
}

impl Drop for Bar {
    fn drop(&mut self) {
        self.bar.finish_and_clear();
    }
}

/// A flag that the first Ctrl-C sets; the second ends the process at once.
///
/// # Errors
/// When the system refuses the handler, or one is installed already.
pub fn interrupt_flag() -> Result<Arc<AtomicBool>, Failure> {
    let flag = Arc::new(AtomicBool::new(false));
    let seen = Arc::clone(&flag);
    ctrlc::set_handler(move || {
        if seen.swap(true, Ordering::Relaxed) {
            // Files are written aside and renamed, so nothing half-written is left under a final name; a run that grows is read up to
            // its last whole step.
            std::process::exit(2);
        }
    })
    .map_err(|e| Failure::new(format!("cannot handle Ctrl-C: {e}")))?;
    Ok(flag)
}

/// Runs `work` while another thread draws its progress and hands Ctrl-C on.
pub fn watched<T>(progress: &Progress, interrupted: &AtomicBool, work: impl FnOnce() -> T) -> T {
    let done = AtomicBool::new(false);
    thread::scope(|scope| {
        let watcher = scope.spawn(|| {
            let bar = Bar::new("encoding");
            while !done.load(Ordering::Acquire) {
                if interrupted.load(Ordering::Relaxed) {
                    progress.cancel();
                }
                let (stage, share) = progress.state();
                bar.stage(match stage {
                    Stage::Refine => "1/3 cutting space into cells",
                    Stage::Tighten => "2/3 shortening lists",
                    Stage::Assemble => "3/3 laying out the file",
                });
                bar.set(share);
                thread::park_timeout(Duration::from_millis(100));
            }
        });
        // Also when `work` panics, or the scope would wait for the watcher for ever.
        let result = std::panic::catch_unwind(std::panic::AssertUnwindSafe(work));
        done.store(true, Ordering::Release);
        watcher.thread().unpark();
        result.unwrap_or_else(|panic| std::panic::resume_unwind(panic))
    })
}
