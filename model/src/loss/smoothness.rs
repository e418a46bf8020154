//! A smooth velocity: `mean |(-alpha Laplacian + gamma I) V|` (the paper, `L_v`; the operator is that of
//! diffeomorphic registration, Beg et al. 2005).
//!
//! It needs an activation with a second derivative: with a ReLU the Laplacian is zero almost everywhere.

use burn::tensor::Tensor;
use burn::tensor::backend::Backend;

use crate::operators::{VelocityJet, length};

/// The mean length of `gamma V - alpha Laplacian V`.
///
/// # Panics
/// If the jet has no Laplacian and `alpha` is not 0.
pub fn smoothness<B: Backend>(v: &VelocityJet<B>, alpha: f64, gamma: f64) -> Tensor<B, 1> {
    let still = v.value.clone() * gamma;
    // The Laplacian is the dearest of all derivatives, and jets without it are common.
    if alpha == 0.0 {
        return length(still).mean();
    }
    let laplacian = v
        .laplacian
        .clone()
        .expect("the smoothness term needs the Laplacian of the jet");
    length(still - laplacian * alpha).mean()
}
