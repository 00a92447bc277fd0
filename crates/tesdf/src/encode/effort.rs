//! How many comparisons refining has made, and how many it may make.
use std::sync::atomic::{AtomicU64, Ordering};

/// Counts how often a refinement has compared a face with a cell, up to a limit.
///
/// Whether the limit is exceeded depends on the mesh alone: the sum over all cells does, and it
/// only grows.
#[derive(Debug)]
pub struct Effort {
    spent: AtomicU64,
    limit: u64,
}

impl Effort {
    /// Nothing is spent yet.
    pub fn new(limit: u64) -> Self {
        Self { spent: AtomicU64::new(0), limit }
    }

    /// Whether more was spent than the limit allows.
    pub fn is_exceeded(&self) -> bool {
        self.spent.load(Ordering::Relaxed) > self.limit
    }

    pub fn spend(&self, faces: usize) {
        self.spent.fetch_add(faces as u64, Ordering::Relaxed);
    }
}
