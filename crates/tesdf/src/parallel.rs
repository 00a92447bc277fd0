//! Runs work on all threads of the current rayon pool, with the feature `parallel`. Without the
//! feature, the same calls run on the calling thread. The results are the same.
#[cfg(feature = "parallel")]
mod threads {
    #[cfg(feature = "encode")]
    pub use rayon::join;
    pub use rayon::prelude::*;

    /// Runs `work` on a thread of the pool. Each parallel call from outside it costs two switches of
    /// threads, and all those of `work` together cost no more.
    #[cfg(feature = "collide")]
    pub fn in_pool<R: Send>(work: impl FnOnce() -> R + Send) -> R {
        rayon::scope(|_| work())
    }

    /// Joins all items by an associative function, beginning with `identity`.
    pub fn reduce<I: ParallelIterator>(
        items: I,
        identity: impl Fn() -> I::Item + Send + Sync,
        join: impl Fn(I::Item, I::Item) -> I::Item + Send + Sync,
    ) -> I::Item {
        items.reduce(identity, join)
    }

    /// The same as [`reduce`]. Returns `None` as soon as an item is `None`.
    #[cfg(feature = "encode")]
    pub fn try_reduce<T: Send>(
        items: impl ParallelIterator<Item = Option<T>>,
        identity: impl Fn() -> T + Send + Sync,
        join: impl Fn(T, T) -> T + Send + Sync,
    ) -> Option<T> {
        items.try_reduce(identity, |a, b| Some(join(a, b)))
    }

    /// Runs `work` on threads whose stacks have this many bytes. Returns `None` when the threads
    /// cannot be started.
    #[cfg(feature = "encode")]
    pub fn with_stack<R: Send>(bytes: usize, work: impl FnOnce() -> R + Send) -> Option<R> {
        let threads = rayon::ThreadPoolBuilder::new().num_threads(rayon::current_num_threads());
        let pool = threads.stack_size(bytes).build().ok()?;
        Some(pool.install(work))
    }
}

#[cfg(not(feature = "parallel"))]
mod threads {
    /// Runs both functions, one after the other.
    pub fn join<A, B>(a: impl FnOnce() -> A, b: impl FnOnce() -> B) -> (A, B) {
        (a(), b())
    }

    /// Runs `work`.
    #[cfg(feature = "collide")]
    pub fn in_pool<R>(work: impl FnOnce() -> R) -> R {
        work()
    }

    /// Joins all items, beginning with `identity`.
    pub fn reduce<I: Iterator>(
        items: I,
        identity: impl FnOnce() -> I::Item,
        join: impl FnMut(I::Item, I::Item) -> I::Item,
    ) -> I::Item {
        items.fold(identity(), join)
    }

    /// The same as [`reduce`]. Returns `None` as soon as an item is `None`.
    pub fn try_reduce<T>(
        mut items: impl Iterator<Item = Option<T>>,
        identity: impl FnOnce() -> T,
        mut join: impl FnMut(T, T) -> T,
    ) -> Option<T> {
        items.try_fold(identity(), |all, item| item.map(|item| join(all, item)))
    }

    /// Runs `work` on a thread whose stack has this many bytes. Returns `None` when the thread
    /// cannot be started.
    pub fn with_stack<R: Send>(bytes: usize, work: impl FnOnce() -> R + Send) -> Option<R> {
        std::thread::scope(|scope| {
            let thread = std::thread::Builder::new().stack_size(bytes).spawn_scoped(scope, work).ok()?;
            match thread.join() {
                Ok(result) => Some(result),
                Err(panic) => std::panic::resume_unwind(panic),
            }
        })
    }

    /// Rayon's `into_par_iter`.
    pub trait IntoSerialIterator: IntoIterator + Sized {
        fn into_par_iter(self) -> Self::IntoIter {
            self.into_iter()
        }
    }

    impl<I: IntoIterator> IntoSerialIterator for I {}

    /// Rayon's methods for slices.
    pub trait SerialSlice<T> {
        fn par_iter(&self) -> std::slice::Iter<'_, T>;
        fn par_chunks(&self, size: usize) -> std::slice::Chunks<'_, T>;
        fn par_chunks_mut(&mut self, size: usize) -> std::slice::ChunksMut<'_, T>;
        fn par_sort_unstable(&mut self)
        where
            T: Ord;
    }

    impl<T> SerialSlice<T> for [T] {
        fn par_iter(&self) -> std::slice::Iter<'_, T> {
            self.iter()
        }

        fn par_chunks(&self, size: usize) -> std::slice::Chunks<'_, T> {
            self.chunks(size)
        }

        fn par_chunks_mut(&mut self, size: usize) -> std::slice::ChunksMut<'_, T> {
            self.chunks_mut(size)
        }

        fn par_sort_unstable(&mut self)
        where
            T: Ord,
        {
            self.sort_unstable();
        }
    }

    /// Rayon's name for an iterator whose length is known.
    pub trait IndexedParallelIterator: Iterator {}

    impl<I: Iterator> IndexedParallelIterator for I {}

    /// Rayon's methods for iterators that have another name in the standard library.
    pub trait SerialIterator: Iterator + Sized {
        fn map_init<S, R>(
            self,
            init: impl FnOnce() -> S,
            mut f: impl FnMut(&mut S, Self::Item) -> R,
        ) -> impl Iterator<Item = R> {
            let mut state = init();
            self.map(move |item| f(&mut state, item))
        }

        fn flat_map_iter<I: IntoIterator>(
            self,
            f: impl FnMut(Self::Item) -> I,
        ) -> impl Iterator<Item = I::Item> {
            self.flat_map(f)
        }
    }

    impl<I: Iterator> SerialIterator for I {}
}

pub use threads::*;
