//! Parts that keep to one screw motion each: `mean |V_t + D V|^2`, `D = (J + J^T) / 2`, at points of the
//! moving surface.
//!
//! A rigid part that turns at a constant rate about a fixed axis while it slides along it (a screw, the
//! flow of a constant twist) has the acceleration `W V`, `W = (J - J^T) / 2`. The term is the rest of the
//! material acceleration `V_t + J V`, and is 0 on such a part. A field may change with time wherever nothing
//! is, as when a limb enters a place that another has left. It costs as soon as the twist of a part changes.
//!
//! `mean |V_t|^2` instead would make the field rest in space, and `mean |V_t + J V|^2` would make paths
//! straight. Both cost where a limb turns. On arms that are raised the errors of carried vertices were two and
//! three times as large with these (`scripts/results/README.md`).
//!
//! # Differs from the paper
//! The paper has no such term.

use burn::tensor::Tensor;
use burn::tensor::backend::Backend;

use crate::operators::VelocityJet;

/// The mean of `|V_t + D V|^2`.
///
/// # Panics
/// If the jet has no rate.
pub fn screw<B: Backend>(v: &VelocityJet<B>) -> Tensor<B, 1> {
    let rate = v
        .rate
        .clone()
        .expect("the screw term needs the rate of the jet");
    let [n, _] = v.value.dims();
    let strained = (v.strain_rate() * v.value.clone().reshape([n, 1, 3]))
        .sum_dim(2)
        .reshape([n, 3]);
    let residual = rate + strained;
    (residual.clone() * residual).sum_dim(1).mean()
}
