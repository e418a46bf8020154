//! [`ModelBackend`] for one more level of autodiff: its operations are those of the level below, tracked.
//!
//! The operations of the backward passes are the default ones, composed of tensor operations that this level
//! tracks: a derivative that is taken on it can itself be differentiated on the level above.

use burn::tensor::ops::FloatTensor;
use burn_autodiff::Autodiff;
use burn_autodiff::checkpoint::strategy::CheckpointStrategy;

use super::activation::Activation;
use super::backend::ModelBackend;
use super::jet::tracked_jet;
use super::lanes::Lanes;
use super::product::tracked_product;

impl<B: ModelBackend, C: CheckpointStrategy> ModelBackend for Autodiff<B, C> {
    const POINTS_AT_A_TIME: Option<usize> = B::POINTS_AT_A_TIME;

    fn product(a: FloatTensor<Self>, b: FloatTensor<Self>) -> FloatTensor<Self> {
        tracked_product::<B, C>(a, b)
    }

    fn activation_jet(
        z: FloatTensor<Self>,
        bias: FloatTensor<Self>,
        lanes: Lanes,
        activation: Activation,
    ) -> (FloatTensor<Self>, FloatTensor<Self>) {
        tracked_jet::<B, C>(z, bias, lanes, activation)
    }
}
