//! An activation with its lanes, and both of its backward passes, from ordinary tensor operations: the
//! formulas of [`super::jet`], for any backend and any level of autodiff.

use burn::tensor::Tensor;
use burn::tensor::backend::Backend;

use super::activation::Activation;
use super::lanes::{Lanes, SPATIAL, block};

/// `z_1^2 + z_2^2 + z_3^2`.
fn squares<B: Backend>(z: &Tensor<B, 2>, n: usize) -> Tensor<B, 2> {
    let square = |k| block(z, k, n) * block(z, k, n);
    square(1) + square(2) + square(3)
}

/// What leaves the activation, and the slope, from ordinary tensor operations; the shapes are those of
/// [`super::ModelBackend::activation_jet`].
pub(crate) fn composed_jet<B: Backend>(
    z: Tensor<B, 2>,
    bias: Tensor<B, 2>,
    lanes: Lanes,
    activation: Activation,
) -> (Tensor<B, 2>, Tensor<B, 2>) {
    let n = z.dims()[0] / lanes.blocks();
    let (value, slope) = activation.composed(block(&z, 0, n) + bias);
    // Nothing to stack. A copy of the value would be one more node on every level of autodiff.
    if lanes == Lanes::VALUE {
        return (value, slope);
    }
    let mut blocks = vec![value];
    for k in 1..lanes.blocks() {
        let passed = block(&z, k, n) * slope.clone();
        // The Laplacian is the last block, so the curvature is evaluated once at most.
        blocks.push(if k > lanes.tangents {
            passed + squares(&z, n) * activation.curvature(&blocks[0], &slope)
        } else {
            passed
        });
    }
    (Tensor::cat(blocks, 0), slope)
}

/// The gradient by what entered, from ordinary tensor operations; the shapes are those of
/// [`super::ModelBackend::activation_jet_backward`].
pub(crate) fn composed_jet_backward<B: Backend>(
    z: Option<Tensor<B, 2>>,
    out: &Tensor<B, 2>,
    slope: Tensor<B, 2>,
    grad: Tensor<B, 2>,
    lanes: Lanes,
    activation: Activation,
) -> Tensor<B, 2> {
    // Alone, the value needs its slope only, and what entered was not kept.
    let Some(z) = z else { return grad * slope };
    let n = slope.dims()[0];
    let curvature = activation.curvature(out, &slope);
    let mut blocks: Vec<_> = (0..lanes.blocks())
        .map(|k| block(&grad, k, n) * slope.clone())
        .collect();
    // Every lane was multiplied by the slope at `z_0`, and so changes with `z_0` by the curvature.
    for k in 1..lanes.blocks() {
        let through = block(&z, k, n) * block(&grad, k, n) * curvature.clone();
        blocks[0] = blocks[0].clone() + through;
    }
    if lanes.laplacian {
        // The Laplacian holds `s'' |grad z|^2` as well: it changes with `z_0` by the third derivative, and with
        // each tangent of space. The tangent of time is no part of it.
        let by_laplacian = block(&grad, lanes.tangents + 1, n);
        let third = activation.third(slope, curvature.clone());
        blocks[0] = blocks[0].clone() + squares(&z, n) * by_laplacian.clone() * third;
        for (k, tangent) in blocks.iter_mut().enumerate().skip(1).take(SPATIAL) {
            let bent = block(&z, k, n) * by_laplacian.clone() * curvature.clone();
            *tangent = tangent.clone() + bent * 2.0;
        }
    }
    Tensor::cat(blocks, 0)
}

/// The gradient by what entered, from that by the slope, from ordinary tensor operations.
pub(crate) fn composed_slope_backward<B: Backend>(
    out: &Tensor<B, 2>,
    slope: &Tensor<B, 2>,
    grad: Tensor<B, 2>,
    activation: Activation,
) -> Tensor<B, 2> {
    activation.curvature(out, slope) * grad
}
