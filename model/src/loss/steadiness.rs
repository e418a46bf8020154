//! A velocity that changes slowly: `mean |dV/dt|^2`, for a field that depends on time. Without it such a
//! field may wander between the ends, where nothing else holds it.
//!
//! # Differs from the paper
//! The paper has no such term.

use burn::tensor::Tensor;
use burn::tensor::backend::Backend;

use crate::operators::VelocityJet;

/// The mean of `|dV/dt|^2`.
///
/// # Panics
/// If the jet was asked for without its rate.
pub fn steadiness<B: Backend>(v: &VelocityJet<B>) -> Tensor<B, 1> {
    let rate = v
        .rate
        .clone()
        .expect("the steadiness term asks for the rate");
    (rate.clone() * rate).sum_dim(1).mean()
}
