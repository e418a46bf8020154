//! A reverse sweep written out in ordinary operations: the gradient of `<w, output>` by the input.
//!
//! ```text
//! g_depth = w W_depth^T,   g_k = (g_{k+1} * s'(z_k)) W_k^T
//! ```
//!
//! For one output direction it costs two evaluations, which nothing beats: `grad f` and `f_t` of the
//! scalar `f`, and the product `J^T w` that carries a normal. One level of autodiff differentiates it by
//! the weights; on an inner backend it records nothing at all.

use burn::tensor::Tensor;

use super::jets::ImplicitJet;
use crate::autodiff::ModelBackend;
use crate::nets::encoding::encoding_derivatives;
use crate::nets::{ImplicitNet, IntervalVelocity, Mlp, VelocityNet};

/// `f`, `grad f`, `f_t`.
pub fn implicit_jet<B: ModelBackend>(
    net: &ImplicitNet<B>,
    x: Tensor<B, 2>,
    t: Tensor<B, 2>,
) -> ImplicitJet<B> {
    let [n, _] = x.dims();
    let features = net.features(x.clone(), t);
    let columns = features.dims()[1];
    let ones = Tensor::ones([n, 1], &x.device());
    let (value, g) = value_and_pullback(&net.mlp, features, ones);
    // Time is the last column, and enters as it is.
    let rate = g.clone().slice([0..n, columns - 1..columns]);
    let gradient = through_encoding(x.clone(), g, net.frequencies);
    match net.sphere_jet(x) {
        None => ImplicitJet {
            value,
            gradient,
            rate,
        },
        Some((sphere, slope)) => ImplicitJet {
            value: value + sphere,
            gradient: gradient + slope,
            rate,
        },
    }
}

/// `V` and `J^T w`.
pub fn pulled_back<B: ModelBackend>(
    net: &VelocityNet<B>,
    x: Tensor<B, 2>,
    t: Tensor<B, 2>,
    w: Tensor<B, 2>,
) -> (Tensor<B, 2>, Tensor<B, 2>) {
    let (value, g) = value_and_pullback(&net.mlp, net.features(x.clone(), t), w);
    (value, through_encoding(x, g, net.frequencies))
}

/// `V` and `J^T w` of a velocity whose last layer changes with time.
pub fn interval_pulled_back<B: ModelBackend>(
    velocity: &IntervalVelocity<B>,
    x: Tensor<B, 2>,
    t: Tensor<B, 2>,
    w: Tensor<B, 2>,
) -> (Tensor<B, 2>, Tensor<B, 2>) {
    let net = &velocity.net;
    let (input, direction) = (net.features(x.clone(), t.clone()), velocity.spread(&w, &t));
    let (outputs, g) = value_and_pullback(&net.mlp, input, direction);
    let gradient = through_encoding(x, g, net.frequencies);
    (velocity.at_time(&outputs, &t), gradient)
}

/// The output, and the gradient of `<w, output>` by the perceptron's input, `[n, inputs]`.
fn value_and_pullback<B: ModelBackend>(
    mlp: &Mlp<B>,
    input: Tensor<B, 2>,
    w: Tensor<B, 2>,
) -> (Tensor<B, 2>, Tensor<B, 2>) {
    let [n, inputs] = input.dims();
    let mut hidden = input.clone();
    let mut slopes = Vec::with_capacity(mlp.hidden().len());
    for (k, layer) in mlp.hidden().iter().enumerate() {
        let z = layer.linear(mlp.layer_input(k, hidden, &input));
        let (value, slope) = mlp.activation().value_and_slope(z, layer.bias.val());
        // The way back reads the slopes, which come with the values at little cost.
        slopes.push(slope);
        hidden = value;
    }
    let output = mlp.output().forward(hidden);
    let mut g = mlp.output().transposed(w);
    let mut past_the_skip = None;
    for ((k, layer), slope) in mlp.hidden().iter().enumerate().zip(slopes).rev() {
        g = layer.transposed(g * slope);
        if mlp.skips_at(k) {
            // The input entered here a second time. Its two gradients are added at the end.
            let columns = g.dims()[1];
            let g_both = g / 2f64.sqrt();
            past_the_skip = Some(g_both.clone().slice([0..n, columns - inputs..columns]));
            g = g_both.slice([0..n, 0..columns - inputs]);
        }
    }
    match past_the_skip {
        None => (output, g),
        Some(more) => (output, g + more),
    }
}

/// From the gradient by the encoding's columns (time's, if any, left aside) to that by the position.
fn through_encoding<B: ModelBackend>(
    x: Tensor<B, 2>,
    g: Tensor<B, 2>,
    frequencies: usize,
) -> Tensor<B, 2> {
    let [n, _] = x.dims();
    if frequencies == 0 {
        return g.slice([0..n, 0..3]);
    }
    let (first, _) = encoding_derivatives(x, frequencies);
    let width = first.dims()[1];
    // Columns come in blocks of three, one block per function and one column per coordinate.
    let each = g.slice([0..n, 0..width]) * first;
    each.reshape([n, width / 3, 3]).sum_dim(1).reshape([n, 3])
}
