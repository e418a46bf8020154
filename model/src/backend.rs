//! What the mathematics asks of a backend beyond burn's own operations: softplus together with its
//! slope, evaluated once and differentiable at every level of autodiff.
//!
//! burn's own `softplus` takes `exp(beta z)` and overflows to NaN; and derived by autodiff, each
//! level would evaluate the exponential again. Here the pair
//!
//! ```text
//! value(z) = log(1 + exp(beta z)) / beta        slope(z) = 1 / (1 + exp(-beta z))
//! value'   = slope                              slope'   = beta slope (1 - slope)
//! ```
//!
//! is one operation whose backward reuses the slope, so three nested levels still evaluate one
//! exponential and one logarithm per element.

use burn::tensor::backend::{AutodiffBackend, Backend};
use burn::tensor::ops::FloatTensor;
use burn::tensor::{Tensor, TensorData, TensorPrimitive};
use burn_autodiff::Autodiff;
use burn_autodiff::checkpoint::base::Checkpointer;
use burn_autodiff::checkpoint::strategy::CheckpointStrategy;
use burn_autodiff::grads::Gradients;
use burn_autodiff::ops::{Backward, Ops, OpsKind, unary};

/// A backend on which the networks can be evaluated.
pub trait ModelBackend: Backend {
    /// Softplus with sharpness `beta` and its first derivative, both of the shape of `z`.
    ///
    /// Stable for every finite `z`: nothing larger than `exp(0)` is ever taken.
    fn softplus_and_slope(
        z: FloatTensor<Self>,
        beta: f64,
    ) -> (FloatTensor<Self>, FloatTensor<Self>) {
        let z = Tensor::<Self, 2>::from_primitive(TensorPrimitive::Float(z));
        let (value, slope) = composed_softplus(z, beta);
        (
            value.into_primitive().tensor(),
            slope.into_primitive().tensor(),
        )
    }
}

/// A backend on which the networks can be trained: one level of autodiff over a [`ModelBackend`].
pub trait TrainBackend: ModelBackend + AutodiffBackend<InnerBackend: ModelBackend> {}

impl<B> TrainBackend for B where B: ModelBackend + AutodiffBackend<InnerBackend: ModelBackend> {}

/// The pair from ordinary tensor operations, with `e = exp(-|beta z|)` in `(0, 1]`.
fn composed_softplus<B: Backend>(z: Tensor<B, 2>, beta: f64) -> (Tensor<B, 2>, Tensor<B, 2>) {
    let e = (z.clone().abs() * -beta).exp();
    let value = z.clone().clamp_min(0.0) + e.clone().log1p() / beta;
    // slope = 1 / (1 + e) right of zero and e / (1 + e) left of it. Divided, not multiplied by `recip`:
    // burn-ndarray's vectorised reciprocal is an approximation, good to 4e-5 only.
    let numerator = e.clone().mask_fill(z.greater_equal_elem(0.0), 1.0);
    let slope = numerator / (e + 1.0);
    (value, slope)
}

/// The pair by the kernel of this crate, on a backend whose tensors live in the host's memory.
#[cfg(any(feature = "ndarray", feature = "flex"))]
fn host_softplus<B: Backend>(z: FloatTensor<B>, beta: f64) -> (FloatTensor<B>, FloatTensor<B>) {
    let z = Tensor::<B, 2>::from_primitive(TensorPrimitive::Float(z));
    let (device, shape) = (z.device(), z.shape());
    let data = z.into_data();
    let input = data
        .as_slice::<f32>()
        .expect("the CPU backends compute in f32");
    let (value, slope) = crate::kernel::softplus_and_slope(input, beta as f32);
    let wrap = |values: Vec<f32>| {
        let data = TensorData::new(values, shape.clone());
        Tensor::<B, 2>::from_data(data, &device)
            .into_primitive()
            .tensor()
    };
    (wrap(value), wrap(slope))
}

#[cfg(feature = "ndarray")]
impl ModelBackend for burn_ndarray::NdArray {
    fn softplus_and_slope(
        z: FloatTensor<Self>,
        beta: f64,
    ) -> (FloatTensor<Self>, FloatTensor<Self>) {
        host_softplus::<Self>(z, beta)
    }
}

#[cfg(feature = "flex")]
impl ModelBackend for burn_flex::Flex {
    fn softplus_and_slope(
        z: FloatTensor<Self>,
        beta: f64,
    ) -> (FloatTensor<Self>, FloatTensor<Self>) {
        host_softplus::<Self>(z, beta)
    }
}

#[cfg(feature = "wgpu")]
impl ModelBackend for burn_wgpu::Wgpu {}

/// Backward of the value: `grad * slope`. The slope is a tensor of the level below, tracked there.
#[derive(Debug)]
struct SoftplusValue;

impl<B: ModelBackend> Backward<B, 1> for SoftplusValue {
    type State = FloatTensor<B>;

    fn backward(self, ops: Ops<Self::State, 1>, grads: &mut Gradients, _: &mut Checkpointer) {
        let slope = ops.state;
        unary::<B, _>(ops.parents, ops.node, grads, |grad| {
            B::float_mul(grad, slope)
        });
    }
}

/// Backward of the slope: `grad * beta slope (1 - slope)`.
#[derive(Debug)]
struct SoftplusSlope;

impl<B: ModelBackend> Backward<B, 1> for SoftplusSlope {
    type State = (FloatTensor<B>, f64);

    fn backward(self, ops: Ops<Self::State, 1>, grads: &mut Gradients, _: &mut Checkpointer) {
        let (slope, beta) = ops.state;
        unary::<B, _>(ops.parents, ops.node, grads, |grad| {
            let square = B::float_mul(slope.clone(), slope.clone());
            let curvature = B::float_mul_scalar(B::float_sub(slope, square), beta.into());
            B::float_mul(grad, curvature)
        });
    }
}

impl<B: ModelBackend, C: CheckpointStrategy> ModelBackend for Autodiff<B, C> {
    fn softplus_and_slope(
        z: FloatTensor<Self>,
        beta: f64,
    ) -> (FloatTensor<Self>, FloatTensor<Self>) {
        let (value, slope) = B::softplus_and_slope(z.primitive, beta);
        let prepared = Backward::<B, 1>::prepare::<C>(SoftplusValue, [z.node.clone()]);
        let tracked_value = match prepared.compute_bound().stateful() {
            OpsKind::Tracked(step) => step.finish(slope.clone(), value),
            OpsKind::UnTracked(step) => step.finish(value),
        };
        let prepared = Backward::<B, 1>::prepare::<C>(SoftplusSlope, [z.node]);
        let tracked_slope = match prepared.compute_bound().stateful() {
            OpsKind::Tracked(step) => step.finish((slope.clone(), beta), slope),
            OpsKind::UnTracked(step) => step.finish(slope),
        };
        (tracked_value, tracked_slope)
    }
}
