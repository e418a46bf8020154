//! A velocity that keeps volume: `mean |div V|` (the paper, `L_v`). Weight 0 for shapes of different
//! volume.

use burn::tensor::Tensor;
use burn::tensor::backend::Backend;

use crate::operators::VelocityJet;

/// The mean of `|tr J|`.
pub fn divergence<B: Backend>(v: &VelocityJet<B>) -> Tensor<B, 1> {
    v.divergence().abs().mean()
}
