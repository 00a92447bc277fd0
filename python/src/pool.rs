//! The threads that the library computes on.
use std::num::NonZeroUsize;
use std::sync::{Arc, Mutex, PoisonError};

use rayon::{ThreadPool, ThreadPoolBuilder};

use crate::errors::Error;

/// The pool of this process, one thread per core, or as many as `RAYON_NUM_THREADS` says.
///
/// Not rayon's global one: that has no threads in a process made by `fork`, as Python's `multiprocessing` does it on Linux, and
/// would be waited for without end.
pub fn shared() -> Result<Arc<ThreadPool>, Error> {
    static POOL: Mutex<Option<(u32, Arc<ThreadPool>)>> = Mutex::new(None);
    let mut pool = POOL.lock().unwrap_or_else(PoisonError::into_inner);
    let process = std::process::id();
    match &*pool {
        Some((owner, threads)) if *owner == process => Ok(Arc::clone(threads)),
        _ => {
            let threads = Arc::new(ThreadPoolBuilder::new().build().map_err(Error::Threads)?);
            if let Some((_, of_parent)) = pool.replace((process, Arc::clone(&threads))) {
                // Its threads are not in this process, so nothing of it may be waited for.
                std::mem::forget(of_parent);
            }
            Ok(threads)
        }
    }
}

/// A pool of its own with so many threads, or the shared one.
pub fn of(threads: Option<NonZeroUsize>) -> Result<Arc<ThreadPool>, Error> {
    match threads {
        Some(threads) => {
            let pool = ThreadPoolBuilder::new().num_threads(threads.get()).build();
            pool.map(Arc::new).map_err(Error::Threads)
        }
        None => shared(),
    }
}
