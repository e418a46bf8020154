//! What the benches share: the backends, the allocator, and tensors to work on.

use burn::tensor::backend::Backend;
use burn::tensor::{Distribution, Tensor};

/// The program's own allocator: the system's faults in the pages of every large result anew.
#[global_allocator]
static ALLOCATOR: mimalloc::MiMalloc = mimalloc::MiMalloc;

/// The benches of the body, once for each backend in the host's memory that is compiled in: as module `flex`
/// and as module `ndarray`, in which `Plain` is the backend and `Train` one level of autodiff over it.
macro_rules! on_each_backend {
    ($($benches:tt)*) => {
        #[cfg(feature = "flex")]
        mod flex {
            use super::*;

            type Plain = burn_flex::Flex;
            type Train = burn_autodiff::Autodiff<Plain>;

            $($benches)*
        }

        #[cfg(feature = "ndarray")]
        mod ndarray {
            use super::*;

            type Plain = burn_ndarray::NdArray;
            type Train = burn_autodiff::Autodiff<Plain>;

            $($benches)*
        }
    };
}
pub(crate) use on_each_backend;

/// Numbers between -0.5 and 0.5: as far out as the shapes are in normalised units.
pub(crate) fn numbers<B: Backend>(rows: usize, columns: usize) -> Tensor<B, 2> {
    let range = Distribution::Uniform(-0.5, 0.5);
    Tensor::random([rows, columns], range, &Default::default())
}
