//! Work without the interpreter's lock, in a process that may have been forked.
//!
//! A forked process has none of its parent's threads, so rayon's own pool, begun in the parent, would never answer.
//! There, work runs in a pool that the new process begins.

use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::{Mutex, PoisonError};

use isomorph::Backend;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use rayon::{ThreadPool, ThreadPoolBuilder};

/// The process in which the package was imported.
static IMPORTED: AtomicU32 = AtomicU32::new(0);

/// The pool of a forked process, with the process that began it.
static OWN: Mutex<Option<(u32, &'static ThreadPool)>> = Mutex::new(None);

/// Notes in which process the package was imported.
pub(crate) fn imported() {
    IMPORTED.store(std::process::id(), Ordering::Relaxed);
}

/// Whether this process was forked from the one in which the package was imported.
fn is_forked() -> bool {
    std::process::id() != IMPORTED.load(Ordering::Relaxed)
}

/// A forked process has none of the threads that talk to a GPU either, and there nothing else can be begun.
///
/// # Errors
/// `ValueError` for the backend wgpu in a forked process.
pub(crate) fn allowed(backend: &Backend) -> PyResult<()> {
    match backend {
        Backend::Wgpu { .. } if is_forked() => Err(PyValueError::new_err(
            "backend wgpu: a forked process cannot use a GPU; begin it with the method \"spawn\" of multiprocessing",
        )),
        _ => Ok(()),
    }
}

/// Does work while other threads of Python run.
pub(crate) fn released<T: Send>(py: Python<'_>, work: impl FnOnce() -> T + Send) -> T {
    py.detach(|| match own_pool() {
        Some(pool) => pool.install(work),
        None => work(),
    })
}

/// In a forked process the pool of this process; none elsewhere, and none where the system gives no threads.
fn own_pool() -> Option<&'static ThreadPool> {
    if !is_forked() {
        return None;
    }
    let process = std::process::id();
    let mut own = OWN.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some((of, pool)) = &*own
        && *of == process
    {
        return Some(pool);
    }
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    // The caller is a member, so that it sees signals while it works. A second one serves other callers.
    let builder = || ThreadPoolBuilder::new().num_threads(cores.max(2));
    let pool = builder().use_current_thread().build();
    let pool = pool.or_else(|_is_member| builder().build());
    // For good: a pool that ends waits for its threads, and in a fork of this process they are not there.
    let pool: &ThreadPool = Box::leak(Box::new(pool.ok()?));
    *own = Some((process, pool));
    Some(pool)
}
