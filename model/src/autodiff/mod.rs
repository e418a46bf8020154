//! What the mathematics needs beyond burn's own operations: products, activations and all that passes through
//! a layer beside the value, each differentiable at every level of autodiff.
//!
//! | file | what |
//! |---|---|
//! | [`activation`] | the activations and the formulas of their derivatives |
//! | [`lanes`] | value, tangents and Laplacian stacked along the batch axis |
//! | `composed` | an activation with its lanes, and both backward passes, of ordinary tensor operations |
//! | [`backend`] | the traits [`ModelBackend`] and [`TrainBackend`]: the operations that a backend may override |
//! | `product` | the matrix product as one tracked operation |
//! | [`jet`] | an activation with its lanes as one tracked operation |
//! | `lifted` | [`ModelBackend`] for one more level of autodiff, of the two files above |
//! | `host`, `kernel` | the overrides of backends in the host's memory, and their loops |
//! | `machine` | the only file with `unsafe`: `gemm`, and the register for denormal numbers |
//!
//! Arrows run from lower rows to higher ones, with one exception: `kernel` and `machine` are below `host`.

pub mod activation;
pub mod backend;
mod composed;
#[cfg(any(feature = "ndarray", feature = "flex"))]
mod host;
pub mod jet;
#[cfg(any(feature = "ndarray", feature = "flex"))]
mod kernel;
pub mod lanes;
mod lifted;
mod machine;
mod product;

pub use activation::Activation;
pub use backend::{ModelBackend, TrainBackend};
pub use lanes::Lanes;
pub use machine::without_denormals;
pub use product::product;
