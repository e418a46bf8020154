//! Work divided among the cores: one thread for each, and whatever a job calls stays on its thread.
//!
//! A step of training is a few thousand small tensor operations. Divided one by one they wait for each
//! other more than they work; divided by samples, each core runs all operations of its own samples, whose
//! values stay in its cache.

use std::panic::resume_unwind;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};
use std::thread::ScopedJoinHandle;

use isomorph_model::without_denormals;
use rayon::{ThreadPool, ThreadPoolBuilder};

/// Threads that take jobs.
#[derive(Debug)]
pub(crate) struct Workers {
    /// Pools of one thread: parallel iterators that a job calls, in burn and its matrix products too,
    /// find one thread there and stay on it.
    pools: Vec<ThreadPool>,
}

impl Workers {
    /// As many workers as rayon's own pool has threads (`RAYON_NUM_THREADS`, else the cores).
    ///
    /// A process that was forked from one with workers has none of their threads, and makes its own.
    pub(crate) fn shared() -> &'static Self {
        static SHARED: Mutex<Option<(u32, &Workers)>> = Mutex::new(None);
        let own = std::process::id();
        let mut shared = SHARED.lock().unwrap_or_else(PoisonError::into_inner);
        match *shared {
            Some((process, workers)) if process == own => workers,
            // Those of the parent stay in memory: their threads, which would end them, are not here.
            _ => {
                let workers: &Workers =
                    Box::leak(Box::new(Self::new(rayon::current_num_threads())));
                *shared = Some((own, workers));
                workers
            }
        }
    }

    /// `count` workers, or fewer if the system gives no more threads.
    fn new(count: usize) -> Self {
        let pool = |k| {
            ThreadPoolBuilder::new()
                .num_threads(1)
                .thread_name(move |_| format!("worker-{k}"))
                .build()
                .ok()
        };
        Self {
            pools: (0..count).map_while(pool).collect(),
        }
    }

    /// `job(0), …, job(count - 1)`, in that order; the jobs run side by side.
    ///
    /// One job alone runs on the caller's thread, with all of rayon's threads at its command. Jobs run
    /// [`without_denormals`].
    ///
    /// # Panics
    /// If a job does.
    pub(crate) fn map<T: Send>(&self, count: usize, job: impl Fn(usize) -> T + Sync) -> Vec<T> {
        let job = |k| without_denormals(|| job(k));
        if count < 2 || self.pools.len() < 2 {
            return (0..count).map(job).collect();
        }
        let next = AtomicUsize::new(0);
        let work = &|| {
            let jobs = std::iter::repeat_with(|| next.fetch_add(1, Ordering::Relaxed));
            let mine = jobs.take_while(|k| *k < count).map(|k| (k, job(k)));
            mine.collect::<Vec<_>>()
        };
        let mut done: Vec<(usize, T)> = std::thread::scope(|scope| {
            // Collected, so that all have begun before the first is waited for.
            let pools = self.pools.iter();
            let threads: Vec<_> = pools
                .map(|pool| scope.spawn(move || pool.install(work)))
                .collect();
            let finish = |thread: ScopedJoinHandle<'_, _>| {
                thread.join().unwrap_or_else(|panic| resume_unwind(panic))
            };
            threads.into_iter().flat_map(finish).collect()
        });
        done.sort_unstable_by_key(|(k, _)| *k);
        done.into_iter().map(|(_, result)| result).collect()
    }
}

#[cfg(test)]
mod tests {
    use std::collections::HashSet;
    use std::sync::Mutex;
    use std::thread;

    use super::*;

    #[test]
    fn results_come_in_the_order_of_the_jobs() {
        for workers in [0, 1, 3] {
            let workers = Workers::new(workers);
            for count in [0, 1, 2, 50] {
                let squares = workers.map(count, |k| k * k);
                let wanted: Vec<usize> = (0..count).map(|k| k * k).collect();
                assert_eq!(squares, wanted, "{} workers", workers.pools.len());
            }
        }
    }

    #[test]
    fn jobs_run_side_by_side_and_what_they_call_stays_on_their_thread() {
        let workers = Workers::new(2);
        let seen = Mutex::new(HashSet::new());
        let both = std::sync::Barrier::new(2);
        workers.map(2, |_| {
            // Neither job passes before the other has begun.
            both.wait();
            assert_eq!(rayon::current_num_threads(), 1);
            let here = thread::current().id();
            let there = rayon::join(|| thread::current().id(), || thread::current().id());
            assert_eq!(there, (here, here));
            seen.lock().expect("no job panicked").insert(here);
        });
        assert_eq!(seen.into_inner().expect("no job panicked").len(), 2);
    }

    #[test]
    #[should_panic(expected = "the third job")]
    fn a_job_that_panics_is_not_lost() {
        Workers::new(2).map(4, |k| assert_ne!(k, 2, "the third job"));
    }
}
