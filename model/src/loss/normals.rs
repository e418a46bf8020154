//! The normal of `f` is the normal of the surface: `mean (1 - <n, n_given>)`, `n = grad f / |grad f|`.
//!
//! At `t = 0, 1` against the normals of the data; in between against normals carried along `V` by
//! `dn/dt = -J^T n` ([`crate::flow::transport::transport`]), without a gradient through the carried normal.
//! The level-set equation holds the values of `f` in between; only this term holds the direction of its slope.
//!
//! # Differs from the paper
//! Transported normals are ours.

use burn::tensor::Tensor;
use burn::tensor::backend::Backend;

use crate::operators::ImplicitJet;

/// The mean of `1 - <n, n_given>`; `given`: unit vectors, `[n, 3]`.
pub fn normals<B: Backend>(f: &ImplicitJet<B>, given: Tensor<B, 2>) -> Tensor<B, 1> {
    (-(f.normal() * given).sum_dim(1) + 1.0).mean()
}
