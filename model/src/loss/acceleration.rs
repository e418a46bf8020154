//! Points that move evenly: `mean |V_t + J V|^2`, the squared acceleration of what the velocity carries.
//! It prefers straight paths at constant speed, so rotations cost; [`super::steadiness`] leaves them free.
//!
//! # Differs from the paper
//! The paper has no such term.

use burn::tensor::Tensor;
use burn::tensor::backend::Backend;

use crate::operators::VelocityJet;

/// The mean of `|V_t + J V|^2`.
///
/// # Panics
/// If the jet was asked for without its rate.
pub fn acceleration<B: Backend>(v: &VelocityJet<B>) -> Tensor<B, 1> {
    let rate = v
        .rate
        .clone()
        .expect("the acceleration term asks for the rate");
    let acceleration = rate + v.along(v.value.clone());
    (acceleration.clone() * acceleration).sum_dim(1).mean()
}
