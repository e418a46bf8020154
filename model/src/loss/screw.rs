//! Parts that keep to one screw motion each: `mean |V_t + D V|^2`, `D = (J + J^T) / 2`, at points of the
//! moving surface.
//!
//! A rigid part that turns at a constant rate about a fixed axis while it slides along it (a screw, the
//! flow of a constant twist) has the acceleration `W V`, `W = (J - J^T) / 2`. The term is the rest of the
//! material acceleration `V_t + J V`. It gives time a fair price: a field may change with time wherever
//! nothing is, as when a limb enters a place that another has left, and a part pays as soon as its own
//! twist changes. [`super::steadiness`] asks for a field that rests in space, which is more than rigid parts
//! need; [`super::acceleration`] asks for straight paths, which rotations are not.
//!
//! # Differs from the paper
//! The paper has no such term.

use burn::tensor::Tensor;
use burn::tensor::backend::Backend;

use crate::operators::VelocityJet;

/// The mean of `|V_t + D V|^2`.
///
/// # Panics
/// If the jet was asked for without its rate.
pub fn screw<B: Backend>(v: &VelocityJet<B>) -> Tensor<B, 1> {
    let rate = v.rate.clone().expect("the screw term asks for the rate");
    let [n, _] = v.value.dims();
    let strained = (v.strain_rate() * v.value.clone().reshape([n, 1, 3]))
        .sum_dim(2)
        .reshape([n, 3]);
    let residual = rate + strained;
    (residual.clone() * residual).sum_dim(1).mean()
}
