//! Muon: how it moves a matrix, and which weights it leaves to Adam.

use burn::module::{AutodiffModule, Module, ModuleVisitor, Param, ParamId};
use burn::tensor::backend::Backend;
use burn::tensor::{Tensor, TensorData};
use isomorph_model::autodiff::activation::Activation;
use isomorph_model::{VelocityNet, VelocityNetConfig};

use super::*;
use crate::optimiser::Optimiser;

type Plain = NdArray;

/// Columns of a hidden layer.
const WIDTH: usize = 12;

/// A network with three matrices between hidden layers.
fn net() -> VelocityNet<B> {
    let config = VelocityNetConfig {
        depth: 4,
        width: WIDTH,
        activation: Activation::Softplus { beta: 100.0 },
        frequencies: 0,
        skip: 0,
        time_dependent: true,
    };
    config.init(5, &Default::default())
}

/// A parameter, its shape and its values, row by row.
type Weights = (ParamId, [usize; 2], Vec<f64>);

/// All parameters of a network, in order.
#[derive(Default)]
struct All(Vec<Weights>);

impl<C: Backend> ModuleVisitor<C> for All {
    fn visit_float<const D: usize>(&mut self, param: &Param<Tensor<C, D>>) {
        let shape = param.val().dims();
        let values = param.val().into_data().iter::<f64>().collect();
        self.0.push((param.id, [shape[0], shape[D - 1]], values));
    }
}

fn weights(net: &VelocityNet<B>) -> Vec<Weights> {
    let mut all = All::default();
    AutodiffModule::<B>::valid(net).visit(&mut all);
    all.0
}

/// The reflection at the plane across a vector that depends on `seed`: an orthogonal matrix.
fn reflection(seed: usize) -> Vec<f64> {
    let axis: Vec<f64> = (0..WIDTH)
        .map(|k| ((7 * k + 3 * seed) as f64).sin())
        .collect();
    let square: f64 = axis.iter().map(|a| a * a).sum();
    let entry = |k: usize| {
        let (i, j) = (k / WIDTH, k % WIDTH);
        f64::from(i == j) - 2.0 * axis[i] * axis[j] / square
    };
    (0..WIDTH * WIDTH).map(entry).collect()
}

fn times(a: &[f64], b: &[f64]) -> Vec<f64> {
    let entry = |k: usize| -> f64 {
        let (i, j) = (k / WIDTH, k % WIDTH);
        (0..WIDTH)
            .map(|m| a[i * WIDTH + m] * b[m * WIDTH + j])
            .sum()
    };
    (0..WIDTH * WIDTH).map(entry).collect()
}

/// The singular values of the hidden matrices' gradients: from 1 down to 0.08 of it.
fn singular_value(k: usize) -> f64 {
    0.8f64.powi(k as i32)
}

/// A gradient of known singular value decomposition, `Q S R` of two reflections.
fn known_gradient(q: &[f64], r: &[f64]) -> Vec<f64> {
    let scaled: Vec<f64> = q
        .iter()
        .enumerate()
        .map(|(k, value)| value * singular_value(k % WIDTH))
        .collect();
    times(&scaled, r)
}

/// The change of each parameter in one step against given gradients.
fn changes(rate: f64, ratio: f64, gradient: impl Fn(&Weights) -> Vec<f64>) -> Vec<Weights> {
    let net = net();
    let before = weights(&net);
    let mut gradients = GradientsParams::new();
    for parameter in &before {
        let (id, shape, _) = parameter;
        let values: Vec<f32> = gradient(parameter).iter().map(|g| *g as f32).collect();
        let data = TensorData::new(values, *shape);
        let tensor = Tensor::<Plain, 2>::from_data(data, &Default::default());
        gradients.register::<Plain, 2>(*id, tensor);
    }
    let hidden = net.hidden_weights();
    let mut optimiser = Optimiser::<B, VelocityNet<B>>::muon(hidden, ratio);
    let after = weights(&optimiser.advance(net, vec![gradients], rate, 100.0));
    let change = |((id, shape, old), (_, _, new)): (Weights, Weights)| {
        let moved = old.iter().zip(&new).map(|(old, new)| old - new);
        (id, shape, moved.collect())
    };
    before.into_iter().zip(after).map(change).collect()
}

#[test]
fn muon_moves_hidden_matrices_along_the_singular_vectors_and_evenly() {
    let (q, r) = (reflection(1), reflection(2));
    let (rate, ratio) = (1e-3, 50.0);
    let hidden = net().hidden_weights();
    assert_eq!(hidden.len(), 3);
    let moved = changes(rate, ratio, |(id, _, values)| {
        if hidden.contains(id) {
            known_gradient(&q, &r)
        } else {
            vec![0.0; values.len()]
        }
    });
    // What MatchRmsAdamW makes of a singular value of 1.
    let length = ratio * rate * 0.2 * (WIDTH as f64).sqrt();
    for (id, _, change) in moved.iter().filter(|(id, ..)| hidden.contains(id)) {
        // A reflection is its own inverse: the change between the singular vectors.
        let between = times(&times(&q, change), &r);
        for (k, entry) in between.iter().enumerate() {
            let entry = entry / length;
            if k / WIDTH == k % WIDTH {
                // Five steps take all values down to .01 into this band (Jordan et al. 2024).
                assert!((0.65..1.25).contains(&entry), "{id:?}: {k}: {entry}");
            } else {
                // Weights of up to 1 in f32, divided by the length of .035: 1e-5 and some more.
                assert!(entry.abs() < 1e-4, "{id:?}: {k}: {entry}");
            }
        }
    }
}

#[test]
fn all_other_weights_are_left_to_adam() {
    let hidden = net().hidden_weights();
    // Gradients of either sign, none of them 0.
    let gradient = |k: usize| if k.is_multiple_of(3) { -2.0 } else { 0.5 };
    let moved = changes(1e-3, 50.0, |(id, _, values)| {
        if hidden.contains(id) {
            vec![0.0; values.len()]
        } else {
            (0..values.len()).map(gradient).collect()
        }
    });
    let mut others = 0;
    for (id, shape, change) in &moved {
        for (k, change) in change.iter().enumerate() {
            // The first step of Adam is the rate, along the sign; a step of Muon against 0 is none.
            let wanted = if hidden.contains(id) {
                0.0
            } else {
                1e-3 * gradient(k).signum()
            };
            assert!(
                (change - wanted).abs() < 1e-6,
                "{id:?} {shape:?}: {k}: {change}"
            );
        }
        others += usize::from(!hidden.contains(id));
    }
    // The first and the last matrix, and all five biases.
    assert_eq!(others, 7);
}
