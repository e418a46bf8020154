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
//! The sweep consists of ordinary operations, so one level of autodiff differentiates it by the weights.
//! The lanes (three tangents, then a time tangent and the Laplacian where asked for) are stacked along
//! the batch axis: one matrix product per layer beside that of the value.

use burn::tensor::{Tensor, TensorData};

use super::{VelocityJet, VelocityRequest};
use crate::backend::ModelBackend;
use crate::encoding::encoding_derivatives;
use crate::velocity_net::VelocityNet;

/// What travels through the network.
struct Sweep<B: ModelBackend> {
    /// `[n, c]`.
    value: Tensor<B, 2>,
    /// `[lanes * n, c]`: the tangents, then the Laplacian if there is one.
    lanes: Tensor<B, 2>,
    tangents: usize,
    laplacian: bool,
}

/// `V`, `J`, and what `request` names, in one sweep.
pub fn velocity_jet<B: ModelBackend>(
    net: &VelocityNet<B>,
    x: Tensor<B, 2>,
    t: Tensor<B, 2>,
    request: VelocityRequest,
) -> VelocityJet<B> {
    let n = x.dims()[0];
    let input = seed(net, x, t, request);
    let mlp = &net.mlp;
    let mut sweep = Sweep {
        value: input.value.clone(),
        lanes: input.lanes.clone(),
        ..input
    };
    for (k, layer) in mlp.hidden().iter().enumerate() {
        sweep.value = mlp.layer_input(k, sweep.value, &input.value);
        sweep.lanes = mlp.layer_input(k, sweep.lanes, &input.lanes);
        let z = layer.forward(sweep.value);
        let lanes = layer.linear(sweep.lanes);
        let (value, slope) = mlp.activation().value_and_slope(z);
        sweep.lanes = if sweep.laplacian {
            let curvature = mlp.activation().curvature(value.clone(), slope.clone());
            bend(lanes, slope, curvature, sweep.tangents)
        } else {
            scale(lanes, slope)
        };
        sweep.value = value;
    }
    let value = mlp.output().forward(sweep.value);
    let lanes = mlp.output().linear(sweep.lanes);
    let lane = |k: usize| lanes.clone().slice([k * n..(k + 1) * n, 0..3]);
    let columns = [lane(0), lane(1), lane(2)].map(|column| column.reshape([n, 3, 1]));
    VelocityJet {
        value,
        jacobian: Tensor::cat(columns.to_vec(), 2),
        laplacian: sweep.laplacian.then(|| lane(sweep.tangents)),
        rate: (sweep.tangents == 4).then(|| lane(3)),
    }
}

/// The input's own tangents and Laplacian.
fn seed<B: ModelBackend>(
    net: &VelocityNet<B>,
    x: Tensor<B, 2>,
    t: Tensor<B, 2>,
    request: VelocityRequest,
) -> Sweep<B> {
    let [n, _] = x.dims();
    let device = x.device();
    let (first, second) = encoding_derivatives(x.clone(), net.frequencies);
    let width = first.dims()[1];
    let time_columns = usize::from(net.time_dependent);
    let padded = |block: Tensor<B, 2>| {
        if net.time_dependent {
            Tensor::cat(vec![block, Tensor::zeros([n, 1], &device)], 1)
        } else {
            block
        }
    };
    // The tangent along coordinate k lives in the columns that encode coordinate k.
    let mut lanes: Vec<Tensor<B, 2>> = (0..3)
        .map(|k| {
            let mask: Vec<f32> = (0..width)
                .map(|column| if column % 3 == k { 1.0 } else { 0.0 })
                .collect();
            let mask = Tensor::from_data(TensorData::new(mask, [1, width]), &device);
            padded(first.clone() * mask)
        })
        .collect();
    let with_rate = request.rate && net.time_dependent;
    if with_rate {
        let ones = Tensor::ones([n, time_columns], &device);
        lanes.push(Tensor::cat(
            vec![Tensor::zeros([n, width], &device), ones],
            1,
        ));
    }
    let tangents = lanes.len();
    if request.laplacian {
        lanes.push(padded(second));
    }
    Sweep {
        value: net.features(x, t),
        lanes: Tensor::cat(lanes, 0),
        tangents,
        laplacian: request.laplacian,
    }
}

/// Every lane times the slope.
fn scale<B: ModelBackend>(lanes: Tensor<B, 2>, slope: Tensor<B, 2>) -> Tensor<B, 2> {
    let ([rows, c], [n, _]) = (lanes.dims(), slope.dims());
    let scaled = lanes.reshape([rows / n, n, c]) * slope.reshape([1, n, c]);
    scaled.reshape([rows, c])
}

/// The tangents times the slope; the Laplacian by the rule above. A tangent of time, the fourth, is not
/// part of the Laplacian.
fn bend<B: ModelBackend>(
    lanes: Tensor<B, 2>,
    slope: Tensor<B, 2>,
    curvature: Tensor<B, 2>,
    tangents: usize,
) -> Tensor<B, 2> {
    let ([rows, c], [n, _]) = (lanes.dims(), slope.dims());
    let spatial = lanes.clone().slice([0..3 * n, 0..c]).reshape([3, n, c]);
    let squares = (spatial.clone() * spatial).sum_dim(0).reshape([n, c]);
    let scaled = scale(lanes, slope);
    let laplacian = scaled.clone().slice([tangents * n..rows, 0..c]) + squares * curvature;
    Tensor::cat(vec![scaled.slice([0..tangents * n, 0..c]), laplacian], 0)
}
