//! A velocity that is locally rigid: `mean |D|^2`, the squared Frobenius norm of the strain rate
//! `D = (J + J^T) / 2` (a Killing-field energy, as in Solomon et al. 2011). Rotations and translations
//! are free, so it suits changes of pose.
//!
//! With a scale `c > 0` it is the pseudo-Huber form `2 c^2 (sqrt(1 + |D|^2 / c^2) - 1)`, which is `|D|^2`
//! for small rates and grows like `2 c |D|` beyond `c`: strain may gather in joints, and parts stay rigid.
//!
//! # Differs from the paper
//! The paper has no such term.

use burn::tensor::Tensor;
use burn::tensor::backend::Backend;

use crate::operators::VelocityJet;

/// `|D|^2`, or its pseudo-Huber form of scale `c`, at each point, `[n, 1]`.
///
/// `scale` is in units of 1 per unit of time; 0 gives the square.
pub fn strain_energy<B: Backend>(v: &VelocityJet<B>, scale: f64) -> Tensor<B, 2> {
    let squared = squared_norm(v.strain_rate());
    if scale == 0.0 {
        return squared;
    }
    let bent = (squared / (scale * scale) + 1.0).sqrt() - 1.0;
    bent * (2.0 * scale * scale)
}

/// The mean of [`strain_energy`].
pub fn strain<B: Backend>(v: &VelocityJet<B>, scale: f64) -> Tensor<B, 1> {
    strain_energy(v, scale).mean()
}

/// The squared Frobenius norm of each matrix, `[n, 3, 3]` to `[n, 1]`.
fn squared_norm<B: Backend>(matrices: Tensor<B, 3>) -> Tensor<B, 2> {
    let n = matrices.dims()[0];
    let flat = matrices.reshape([n, 9]);
    (flat.clone() * flat).sum_dim(1)
}
