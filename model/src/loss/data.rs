//! On the surface `f` is zero: `mean |f|` over points known to lie on it.
//!
//! At `t = 0` and `t = 1` these are the given points (the paper, `L_m`). At times between they are given
//! points carried there along `V`, `|f(phi(x, t), t)|`, which ties `f` to `V` and teaches both.
//!
//! # Differs from the paper
//! The paper has no such term between the ends.

use burn::tensor::Tensor;
use burn::tensor::backend::Backend;

/// `mean |f|` of values `[n, 1]`.
pub fn data<B: Backend>(value: Tensor<B, 2>) -> Tensor<B, 1> {
    value.abs().mean()
}
