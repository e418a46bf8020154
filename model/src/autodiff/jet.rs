//! An activation with all that passes through a layer beside the value, as one operation that is
//! differentiable at every level of autodiff.
//!
//! Blocks of `n` rows are stacked along the batch axis: the value, then tangents, then a Laplacian. With
//! `s'`, `s''`, `s'''` the derivatives at `z_0 + b`, the bias acting on the value alone, they become
//!
//! ```text
//! h_0 = s(z_0 + b)                                       the value
//! h_k = s' z_k                                           a tangent
//! h_l = s' z_l + s'' (z_1^2 + z_2^2 + z_3^2)             the Laplacian
//! ```
//!
//! and the gradients `g` by these give those by the `z`:
//!
//! ```text
//! d_0 = s' g_0 + s'' (sum_k z_k g_k + z_l g_l) + s''' g_l (z_1^2 + z_2^2 + z_3^2)
//! d_k = s' g_k + 2 s'' z_k g_l                           (the second only for k = 1, 2, 3)
//! d_l = s' g_l
//! ```
//!
//! Only `s` and `s'` are evaluated: `s''` and `s'''` of every [`Activation`] are a few products of these.

use burn::tensor::Tensor;
use burn::tensor::ops::FloatTensor;
use burn_autodiff::Autodiff;
use burn_autodiff::checkpoint::base::Checkpointer;
use burn_autodiff::checkpoint::strategy::CheckpointStrategy;
use burn_autodiff::grads::Gradients;
use burn_autodiff::ops::{Backward, Ops, OpsKind};

use super::activation::Activation;
use super::backend::ModelBackend;
use super::lanes::{Lanes, block, primitive, tensor};

impl Activation {
    /// `s(z + bias)` and `s'(z + bias)`.
    ///
    /// # Shapes
    /// `z`: `[n, c]`; `bias`: `[1, c]`; results `[n, c]`.
    pub fn value_and_slope<B: ModelBackend>(
        self,
        z: Tensor<B, 2>,
        bias: Tensor<B, 2>,
    ) -> (Tensor<B, 2>, Tensor<B, 2>) {
        self.jet_and_slope(z, bias, Lanes::VALUE)
    }

    /// The value, tangents and Laplacian that leave the activation where `z` enters it, all stacked
    /// (the formulas are in this file's head).
    ///
    /// # Shapes
    /// `z` and the result: `[blocks n, c]`; `bias`: `[1, c]`.
    pub fn jet<B: ModelBackend>(
        self,
        z: Tensor<B, 2>,
        bias: Tensor<B, 2>,
        lanes: Lanes,
    ) -> Tensor<B, 2> {
        self.jet_and_slope(z, bias, lanes).0
    }

    fn jet_and_slope<B: ModelBackend>(
        self,
        z: Tensor<B, 2>,
        bias: Tensor<B, 2>,
        lanes: Lanes,
    ) -> (Tensor<B, 2>, Tensor<B, 2>) {
        let (out, slope) = B::activation_jet(primitive(z), primitive(bias), lanes, self);
        (tensor(out), tensor(slope))
    }
}

/// What the backward passes of a jet need: tensors of the level below, tracked there.
#[derive(Clone, Debug)]
struct Passed<B: ModelBackend> {
    /// What entered, only where there are tangents.
    z: Option<FloatTensor<B>>,
    /// What left.
    out: FloatTensor<B>,
    slope: FloatTensor<B>,
    lanes: Lanes,
    activation: Activation,
}

/// The backward pass of what leaves the activation.
#[derive(Debug)]
struct JetBackward;

impl<B: ModelBackend> Backward<B, 2> for JetBackward {
    type State = Passed<B>;

    fn backward(self, ops: Ops<Self::State, 2>, grads: &mut Gradients, _: &mut Checkpointer) {
        let grad = grads.consume::<B>(&ops.node);
        let Passed {
            z,
            out,
            slope,
            lanes,
            activation,
        } = ops.state;
        let n = tensor::<B>(slope.clone()).dims()[0];
        let by_z = B::activation_jet_backward(z, out, slope, grad, lanes, activation);
        let [z, bias] = ops.parents;
        if let Some(bias) = bias {
            // The bias entered every row of the value and nothing else.
            let by_bias = block(&tensor::<B>(by_z.clone()), 0, n).sum_dim(0);
            grads.register::<B>(bias.id, primitive(by_bias));
        }
        if let Some(z) = z {
            grads.register::<B>(z.id, by_z);
        }
    }
}

/// The backward pass of the slope.
#[derive(Debug)]
struct SlopeBackward;

impl<B: ModelBackend> Backward<B, 2> for SlopeBackward {
    type State = Passed<B>;

    fn backward(self, ops: Ops<Self::State, 2>, grads: &mut Gradients, _: &mut Checkpointer) {
        let grad = grads.consume::<B>(&ops.node);
        let Passed {
            out,
            slope,
            lanes,
            activation,
            ..
        } = ops.state;
        let by_value = tensor::<B>(B::activation_slope_backward(out, slope, grad, activation));
        let [z, bias] = ops.parents;
        if let Some(bias) = bias {
            grads.register::<B>(bias.id, primitive(by_value.clone().sum_dim(0)));
        }
        if let Some(z) = z {
            let mut rows = vec![by_value];
            // The slope does not depend on the other blocks.
            for _ in 1..lanes.blocks() {
                rows.push(rows[0].zeros_like());
            }
            grads.register::<B>(z.id, primitive(Tensor::cat(rows, 0)));
        }
    }
}

/// What leaves an activation, and its slope.
type Pair<B> = (FloatTensor<B>, FloatTensor<B>);

/// [`ModelBackend::activation_jet`] one level up: the pair of the level below, tracked.
pub(crate) fn tracked_jet<B: ModelBackend, C: CheckpointStrategy>(
    z: FloatTensor<Autodiff<B, C>>,
    bias: FloatTensor<Autodiff<B, C>>,
    lanes: Lanes,
    activation: Activation,
) -> Pair<Autodiff<B, C>> {
    // Kept until the backward pass, so only where that reads it: it is as large as all of the lanes.
    let entered = (lanes != Lanes::VALUE).then(|| z.primitive.clone());
    let (out, slope) = B::activation_jet(z.primitive, bias.primitive, lanes, activation);
    let nodes = [z.node, bias.node];
    // A node of burn's graph has one result. The two results become two nodes over the same operands; both are
    // evaluated here, once.
    let passed = |z| Passed {
        z,
        out: out.clone(),
        slope: slope.clone(),
        lanes,
        activation,
    };
    let prepared = Backward::<B, 2>::prepare::<C>(JetBackward, nodes.clone());
    // Compute bound: a checkpointing strategy then keeps the result instead of evaluating it again.
    let tracked_out = match prepared.compute_bound().stateful() {
        OpsKind::Tracked(step) => step.finish(passed(entered), out.clone()),
        OpsKind::UnTracked(step) => step.finish(out.clone()),
    };
    let prepared = Backward::<B, 2>::prepare::<C>(SlopeBackward, nodes);
    let tracked_slope = match prepared.compute_bound().stateful() {
        OpsKind::Tracked(step) => step.finish(passed(None), slope.clone()),
        OpsKind::UnTracked(step) => step.finish(slope.clone()),
    };
    (tracked_out, tracked_slope)
}

#[cfg(test)]
mod tests;
