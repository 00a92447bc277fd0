use std::fmt;
use std::sync::atomic::{AtomicBool, AtomicU8, AtomicU64, Ordering};

use crate::named;

/// The stage of an encoding.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stage {
    /// Bisecting the domain.
    Refine,
    /// Shortening lists and labelling cells.
    Tighten,
    /// Laying out the bytes of the file.
    Assemble,
}

named!(Stage {
    Refine: "refine", "cutting space into cells";
    Tighten: "tighten", "shortening lists";
    Assemble: "assemble", "laying out the file";
});

/// Progress, shared between the thread that works and a thread that watches. It tells how far the
/// work is, and carries the request to stop.
#[derive(Default)]
pub struct Progress {
    cancel: AtomicBool,
    done: AtomicU64,
    total: AtomicU64,
    stage: AtomicU8,
    told: Option<Told>,
}

type Told = Box<dyn Fn(&Progress) + Send + Sync>;

impl Progress {
    /// A progress that also calls a function after each small part of the work, on the thread that
    /// did it. Where there is one thread only, as in a browser, nobody else could watch.
    pub fn telling(told: impl Fn(&Self) + Send + Sync + 'static) -> Self {
        Self { told: Some(Box::new(told)), ..Self::default() }
    }

    /// Asks the work to stop. An encoding then returns
    /// [`EncodeError::Cancelled`](crate::encode::EncodeError::Cancelled).
    pub fn cancel(&self) {
        self.cancel.store(true, Ordering::Relaxed);
    }

    /// Whether [`cancel`](Self::cancel) was called.
    pub fn is_cancelled(&self) -> bool {
        self.cancel.load(Ordering::Relaxed)
    }

    /// The stage, and the share of the stage that is done, from 0 to 1.
    pub fn state(&self) -> (Stage, f64) {
        let stage = match self.stage.load(Ordering::Relaxed) {
            0 => Stage::Refine,
            1 => Stage::Tighten,
            _ => Stage::Assemble,
        };
        let total = self.total.load(Ordering::Relaxed).max(1);
        (stage, (self.done.load(Ordering::Relaxed) as f64 / total as f64).min(1.0))
    }

    pub(crate) fn begin(&self, stage: Stage, total: u64) {
        self.done.store(0, Ordering::Relaxed);
        self.total.store(total, Ordering::Relaxed);
        self.stage.store(stage as u8, Ordering::Relaxed);
        self.tell();
    }

    pub(crate) fn advance(&self, by: u64) {
        self.done.fetch_add(by, Ordering::Relaxed);
        self.tell();
    }

    fn tell(&self) {
        if let Some(told) = &self.told {
            told(self);
        }
    }
}

impl fmt::Debug for Progress {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (stage, share) = self.state();
        f.debug_struct("Progress").field("stage", &stage).field("share", &share).finish_non_exhaustive()
    }
}
