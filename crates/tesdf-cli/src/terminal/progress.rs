//! Progress bars on stderr.
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::Duration;

use indicatif::{ProgressBar, ProgressStyle};
use tesdf::base::Named;
use tesdf::{Progress, Stage};

/// A progress bar on stderr with the estimated remaining time. Nothing is drawn unless stderr is a
/// terminal.
#[derive(Debug)]
pub struct Bar {
    bar: ProgressBar,
}

/// Number of steps of a bar; finer than a terminal can draw.
const STEPS: u64 = 10_000;

impl Bar {
    /// A bar with the name of the activity, such as `encoding`.
    pub fn new(what: &'static str) -> Self {
        let bar = ProgressBar::new(STEPS).with_message(what);
        if let Ok(style) = ProgressStyle::with_template("{msg} [{bar:40}] {percent:>3} %  {eta} left") {
            bar.set_style(style.progress_chars("=> "));
        }
        Self { bar }
    }

    /// Sets the name of the activity. When it changes, the estimate starts again.
    pub fn stage(&self, what: impl Into<String>) {
        let what = what.into();
        if self.bar.message() != what {
            self.bar.set_message(what);
            self.bar.set_position(0);
            self.bar.reset_eta();
        }
    }

    /// Sets the completed fraction, 0 to 1. Any thread may call this.
    pub fn set(&self, share: f64) {
        self.bar.set_position((share.clamp(0.0, 1.0) * STEPS as f64) as u64);
    }
}

impl Drop for Bar {
    fn drop(&mut self) {
        self.bar.finish_and_clear();
    }
}

/// Runs `work` while another thread draws its progress and passes Ctrl-C on to it. Where that
/// thread cannot be started, nothing is drawn, and Ctrl-C ends the process after a second.
pub fn watched<T>(progress: &Progress, interrupted: &AtomicBool, work: impl FnOnce() -> T) -> T {
    let done = AtomicBool::new(false);
    thread::scope(|scope| {
        let watch = || {
            let bar = Bar::new("encoding");
            while !done.load(Ordering::Acquire) {
                if interrupted.load(Ordering::Relaxed) {
                    progress.cancel();
                }
                let (stage, share) = progress.state();
                bar.stage(format!("{}/{} {}", stage as u8 + 1, Stage::ALL.len(), stage.meaning()));
                bar.set(share);
                thread::park_timeout(Duration::from_millis(100));
            }
        };
        let watcher = thread::Builder::new().spawn_scoped(scope, watch);
        // `work` may panic; without this the scope would wait for the watcher forever.
        let result = std::panic::catch_unwind(std::panic::AssertUnwindSafe(work));
        done.store(true, Ordering::Release);
        if let Ok(watcher) = watcher {
            watcher.thread().unpark();
        }
        result.unwrap_or_else(|panic| std::panic::resume_unwind(panic))
    })
}
