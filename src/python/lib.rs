//! isomorph for Python: the part in Rust. It takes and gives arrays of numpy as they are in memory; what users
//! call, and all that converts, is in `isomorph/`, in Python.
//!
//! | file | what it holds |
//! |---|---|
//! | `arrays.rs` | points from numpy and to it |
//! | `batch.rs` | many runs from one file of jobs |
//! | `evaluation.rs` | runs held against true frames |
//! | `failure.rs` | errors as Python's exceptions |
//! | `fork.rs` | work without the interpreter's lock, in forked processes too |
//! | `watch.rs` | events for a callback, and Ctrl-C |
//! | `run.rs` | `Run`: what was trained |
//! | `shapes.rs` | files of shapes, normals, pairs |
//! | `train.rs` | training: new runs, and those that go on |

mod arrays;
mod batch;
mod evaluation;
mod failure;
mod fork;
mod run;
mod shapes;
mod train;
mod watch;

/// Memory of this module alone: arrays that numpy makes are numpy's, and each is given back to whom it is from.
#[global_allocator]
static ALLOCATOR: mimalloc::MiMalloc = mimalloc::MiMalloc;

/// The module `isomorph._native`.
#[pyo3::pymodule]
mod _native {
    #[pymodule_export]
    use crate::batch::{Batch, run_job};
    #[pymodule_export]
    use crate::evaluation::{Frames, evaluate};
    #[pymodule_export]
    use crate::failure::TrainingError;
    #[pymodule_export]
    use crate::run::{Run, open};
    #[pymodule_export]
    use crate::shapes::{estimate_normals, match_shapes, read_shape, write_shape};
    #[pymodule_export]
    use crate::train::{plan, recipe, resume, train};

    #[pymodule_init]
    #[expect(clippy::unnecessary_wraps, reason = "the form that pyo3 calls")]
    fn init(_module: &pyo3::Bound<'_, pyo3::types::PyModule>) -> pyo3::PyResult<()> {
        crate::fork::imported();
        Ok(())
    }
}
