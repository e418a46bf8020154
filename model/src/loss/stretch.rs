//! A surface that keeps its lengths: `mean |P D P|^2`, `P = I - n n^T`, the rate at which the metric of
//! the surface changes. Unlike [`super::strain`] it lets the space on both sides shear and grow.
//!
//! `|P D P|^2 = |D|^2 - 2 |D n|^2 + <n, D n>^2`.
//!
//! # Differs from the paper
//! The paper has no such term.

use burn::tensor::Tensor;
use burn::tensor::backend::Backend;

use super::strain::squared_norm;
use crate::operators::VelocityJet;

/// The mean over points of the surface with unit normals `n`, `[n, 3]`.
///
/// # Panics
/// If there are not as many normals as points.
pub fn stretch<B: Backend>(v: &VelocityJet<B>, n: Tensor<B, 2>) -> Tensor<B, 1> {
    let [count, _] = v.value.dims();
    assert_eq!(n.dims(), [count, 3], "a normal for each of {count} points");
    let rate = v.strain_rate();
    let across = (rate.clone() * n.clone().reshape([count, 1, 3]))
        .sum_dim(2)
        .reshape([count, 3]);
    let along = (across.clone() * n).sum_dim(1);
    let squared = (across.clone() * across).sum_dim(1);
    (squared_norm(rate) - squared * 2.0 + along.clone() * along).mean()
}
