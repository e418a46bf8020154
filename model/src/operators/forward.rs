//! One forward sweep through `V` that carries the value, the tangents and the Laplacian together
//! (forward-mode differentiation; the "forward Laplacian", Li et al. 2023).
//!
//! Through an affine layer `z = h W + b` tangents and Laplacian pass as `h' W`. Through an activation
//!
//! ```text
//! h   = s(z)
//! h_k = s'(z) z_k                                   for each direction k
//! lap = s'(z) lap z + s''(z) sum_k z_k^2
//! ```
//!
//! Value and lanes (three tangents, then a time tangent and the Laplacian where requested) are stacked
//! along the batch axis: one matrix product and one activation ([`crate::autodiff::jet`]) per layer, which one
//! level of autodiff differentiates by the weights.

use burn::tensor::{Tensor, TensorData};

use super::jets::{VelocityJet, VelocityRequest};
use crate::autodiff::{Lanes, ModelBackend};
use crate::nets::encoding::encoding_derivatives;
use crate::nets::{IntervalVelocity, VelocityNet};

/// `V`, `J`, and what `request` names, in one sweep.
pub fn velocity_jet<B: ModelBackend>(
    net: &VelocityNet<B>,
    x: Tensor<B, 2>,
    t: Tensor<B, 2>,
    request: VelocityRequest,
) -> VelocityJet<B> {
    let lanes = Lanes {
        tangents: 3 + usize::from(request.rate && net.time_dependent),
        laplacian: request.laplacian,
    };
    let out = outputs(net, x, t, lanes);
    let columns = [1, 2, 3].map(|k| column_of(out[k].clone()));
    VelocityJet {
        value: out[0].clone(),
        jacobian: Tensor::cat(columns.to_vec(), 2),
        laplacian: lanes.laplacian.then(|| out[lanes.tangents + 1].clone()),
        rate: (lanes.tangents == 4).then(|| out[4].clone()),
    }
}

/// `V`, `J`, and what `request` names, of a velocity whose last layer changes with time.
///
/// The sweep goes through the outputs of all functions of time together. They are summed up afterwards, each derivative
/// with the same weights.
pub fn interval_jet<B: ModelBackend>(
    velocity: &IntervalVelocity<B>,
    x: Tensor<B, 2>,
    t: Tensor<B, 2>,
    request: VelocityRequest,
) -> VelocityJet<B> {
    let lanes = Lanes {
        tangents: 3,
        laplacian: request.laplacian,
    };
    let out = outputs(&velocity.net, x, t.clone(), lanes);
    let summed = |k: usize| velocity.at_time(&out[k], &t);
    let columns = [1, 2, 3].map(|k| column_of(summed(k)));
    VelocityJet {
        value: summed(0),
        jacobian: Tensor::cat(columns.to_vec(), 2),
        laplacian: lanes.laplacian.then(|| summed(4)),
        rate: request.rate.then(|| velocity.at_rate(&out[0], &t)),
    }
}

/// A vector at each point as a column, `[n, 3]` to `[n, 3, 1]`.
fn column_of<B: ModelBackend>(vectors: Tensor<B, 2>) -> Tensor<B, 3> {
    let [n, _] = vectors.dims();
    vectors.reshape([n, 3, 1])
}

/// The outputs of the perceptron: its values, then each lane, `[n, outputs]` each.
fn outputs<B: ModelBackend>(
    net: &VelocityNet<B>,
    x: Tensor<B, 2>,
    t: Tensor<B, 2>,
    lanes: Lanes,
) -> Vec<Tensor<B, 2>> {
    let [n, _] = x.dims();
    let input = seed(net, x, t, lanes);
    let mlp = &net.mlp;
    let mut sweep = input.clone();
    for (k, layer) in mlp.hidden().iter().enumerate() {
        let z = layer.linear(mlp.layer_input(k, sweep, &input));
        sweep = mlp.activation().jet(z, layer.bias.val(), lanes);
    }
    let out = mlp.output().linear(sweep);
    let [rows, columns] = out.dims();
    let blocks = (0..rows / n).map(|k| out.clone().slice([k * n..(k + 1) * n, 0..columns]));
    let mut blocks: Vec<_> = blocks.collect();
    // The output layer is affine: its bias moves the value and no derivative.
    blocks[0] = blocks[0].clone() + mlp.output().bias.val();
    blocks
}

/// The input, its own tangents and Laplacian, stacked.
fn seed<B: ModelBackend>(
    net: &VelocityNet<B>,
    x: Tensor<B, 2>,
    t: Tensor<B, 2>,
    lanes: Lanes,
) -> Tensor<B, 2> {
    let [n, _] = x.dims();
    let device = x.device();
    let (first, second) = encoding_derivatives(x.clone(), net.frequencies);
    let width = first.dims()[1];
    let padded = |block: Tensor<B, 2>| {
        // Time does not change along a direction of space.
        if net.time_dependent {
            Tensor::cat(vec![block, Tensor::zeros([n, 1], &device)], 1)
        } else {
            block
        }
    };
    let mut blocks = vec![net.features(x, t)];
    // The tangent along coordinate k lives in the columns that encode coordinate k.
    blocks.extend((0..3).map(|k| {
        let mask: Vec<f32> = (0..width)
            .map(|column| if column % 3 == k { 1.0 } else { 0.0 })
            .collect();
        let mask = Tensor::from_data(TensorData::new(mask, [1, width]), &device);
        padded(first.clone() * mask)
    }));
    if lanes.tangents == 4 {
        let ones = Tensor::ones([n, 1], &device);
        blocks.push(Tensor::cat(
            vec![Tensor::zeros([n, width], &device), ones],
            1,
        ));
    }
    if lanes.laplacian {
        blocks.push(padded(second));
    }
    Tensor::cat(blocks, 0)
}
