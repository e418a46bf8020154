//! A velocity that is locally rigid: `mean |(J + J^T) / 2|^2`, the squared Frobenius norm of the strain
//! rate (a Killing-field energy, as in Solomon et al. 2011). Rotations and translations are free, so it
//! suits changes of pose.
//!
//! # Differs from the paper
//! The paper has no such term.

use burn::tensor::Tensor;
use burn::tensor::backend::Backend;

use crate::operators::VelocityJet;

/// The mean over points of the squared Frobenius norm of the strain rate.
pub fn strain<B: Backend>(v: &VelocityJet<B>) -> Tensor<B, 1> {
    let rate = v.strain_rate();
    // The mean over all nine entries, times nine: the mean over points of their sum.
    (rate.clone() * rate).mean() * 9.0
}
