//! What the mathematics needs of a backend beyond burn's own operations: matrix products, activations with
//! all that passes through a layer beside the value ([`super::jet`]), and how large its working set should be.

use burn::tensor::backend::{AutodiffBackend, Backend};
use burn::tensor::ops::FloatTensor;

use super::activation::Activation;
use super::composed::{composed_jet, composed_jet_backward, composed_slope_backward};
use super::lanes::{Lanes, primitive, tensor};

/// A backend on which the networks can be evaluated.
///
/// The operations have bodies of ordinary tensor operations, differentiable at any level of autodiff; a
/// backend in the host's memory overrides them with kernels.
pub trait ModelBackend: Backend {
    /// How many points a core should take at a time, where the device is a processor: enough to pay for a
    /// layer's weights, few enough that the values of some layers stay in its cache. `None` where larger
    /// batches are only better.
    const POINTS_AT_A_TIME: Option<usize> = None;

    /// The matrix product `a b`, tracked; `[m, k]` and `[k, n]` to `[m, n]`.
    fn product(a: FloatTensor<Self>, b: FloatTensor<Self>) -> FloatTensor<Self> {
        Self::float_matmul(a, b)
    }

    /// What leaves an activation, and its slope; both tracked.
    ///
    /// # Shapes
    /// `z`: `[blocks n, c]`; `bias`: `[1, c]`, added to the first block; results `[blocks n, c]`, `[n, c]`.
    fn activation_jet(
        z: FloatTensor<Self>,
        bias: FloatTensor<Self>,
        lanes: Lanes,
        activation: Activation,
    ) -> (FloatTensor<Self>, FloatTensor<Self>) {
        let (out, slope) = composed_jet::<Self>(tensor(z), tensor(bias), lanes, activation);
        (primitive(out), primitive(slope))
    }

    /// The gradient by `z` of [`Self::activation_jet`] from that by its first result, `[blocks n, c]`; `out`
    /// and `slope` are its results, and `z` is left out where the value travels alone.
    fn activation_jet_backward(
        z: Option<FloatTensor<Self>>,
        out: FloatTensor<Self>,
        slope: FloatTensor<Self>,
        grad: FloatTensor<Self>,
        lanes: Lanes,
        activation: Activation,
    ) -> FloatTensor<Self> {
        let z = z.map(tensor::<Self>);
        let (out, slope, grad) = (tensor(out), tensor(slope), tensor(grad));
        primitive(composed_jet_backward(
            z, &out, slope, grad, lanes, activation,
        ))
    }

    /// The gradient by the first block of `z` of [`Self::activation_jet`] from that by the slope, `[n, c]`;
    /// `out` and `slope` are its results.
    fn activation_slope_backward(
        out: FloatTensor<Self>,
        slope: FloatTensor<Self>,
        grad: FloatTensor<Self>,
        activation: Activation,
    ) -> FloatTensor<Self> {
        let (out, slope) = (tensor::<Self>(out), tensor(slope));
        primitive(composed_slope_backward(
            &out,
            &slope,
            tensor(grad),
            activation,
        ))
    }
}

/// A backend on which the networks can be trained: one level of autodiff over a [`ModelBackend`].
pub trait TrainBackend: ModelBackend + AutodiffBackend<InnerBackend: ModelBackend> {}

impl<B> TrainBackend for B where B: ModelBackend + AutodiffBackend<InnerBackend: ModelBackend> {}

#[cfg(feature = "wgpu")]
impl ModelBackend for burn_wgpu::Wgpu {}
