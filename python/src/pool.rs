//! The thread pools of the library.
use std::num::NonZeroUsize;
use std::sync::{Arc, Mutex, PoisonError};

use rayon::{ThreadPool, ThreadPoolBuilder};

use crate::errors::Error;

/// The pool of this process, with one thread per core or the number in `RAYON_NUM_THREADS`.
///
/// This is not rayon's global pool. After a `fork`, which Python's `multiprocessing` uses on Linux,
/// the global pool has no threads in the child process, and the child would wait for them forever.
pub fn shared() -> Result<Arc<ThreadPool>, Error> {
    static POOL: Mutex<Option<(u32, Arc<ThreadPool>)>> = Mutex::new(None);
    let mut pool = POOL.lock().unwrap_or_else(PoisonError::into_inner);
    let process = std::process::id();
    match &*pool {
        Some((owner, threads)) if *owner == process => Ok(Arc::clone(threads)),
        _ => {
            let threads = Arc::new(ThreadPoolBuilder::new().build().map_err(Error::Threads)?);
            if let Some((_, of_parent)) = pool.replace((process, Arc::clone(&threads))) {
                // The threads of the parent's pool do not exist in this process, so dropping the
                // pool would wait forever.
                std::mem::forget(of_parent);
            }
            Ok(threads)
        }
    }
}

/// Largest number of threads that a caller may ask for, as in the command-line tool.
const MOST: usize = 1024;

/// A new pool with this number of threads, or the shared pool.
pub fn of(threads: Option<NonZeroUsize>) -> Result<Arc<ThreadPool>, Error> {
    match threads {
        Some(threads) if threads.get() > MOST => Err(Error::TooManyThreads(threads.get(), MOST)),
        Some(threads) => {
            let pool = ThreadPoolBuilder::new().num_threads(threads.get()).build();
            pool.map(Arc::new).map_err(Error::Threads)
        }
        None => shared(),
    }
}
