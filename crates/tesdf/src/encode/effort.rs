//! How much refining has cost, and how much it may.
use std::sync::atomic::{AtomicU64, Ordering};

/// How many faces a refinement has held against cells, and how many it may.
///
/// Whether it is too much depends on the mesh alone: the sum over all cells does, and only grows.
#[derive(Debug)]
pub struct Effort {
    spent: AtomicU64,
    limit: u64,
}

impl Effort {
    /// None spent.
    pub fn new(limit: u64) -> Self {
        Self { spent: AtomicU64::new(0), limit }
    }

    /// Whether more was asked for than there is.
    pub fn is_exceeded(&self) -> bool {
        self.spent.load(Ordering::Relaxed) > self.limit
    }

    pub fn spend(&self, faces: usize) {
        self.spent.fetch_add(faces as u64, Ordering::Relaxed);
    }
}
