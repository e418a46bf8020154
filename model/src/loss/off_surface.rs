//! Away from the surface `f` is not zero: `mean exp(-100 |f|)` over points of the box (Sitzmann et al.
//! 2020). It keeps spurious sheets away where the data has no normals.
//!
//! # Differs from the paper
//! The paper has no such term.

use burn::tensor::Tensor;
use burn::tensor::backend::Backend;

/// How fast the penalty falls with the distance, per normalised unit.
const SHARPNESS: f64 = 100.0;

/// The mean of `exp(-100 |f|)` of values `[n, 1]`.
pub fn off_surface<B: Backend>(value: Tensor<B, 2>) -> Tensor<B, 1> {
    (value.abs() * -SHARPNESS).exp().mean()
}
