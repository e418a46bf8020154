//! LipMLP: `f(x, t)` with a trained bound on its slope, which the objective makes small (Liu, Williams,
//! Jacobson, Fidler, Litany, "Learning Smooth Neural Functions via Lipschitz Regularization", SIGGRAPH 2022).
//!
//! ```text
//! h_{k+1} = tanh(h_k W^_k + b_k),   f = h_depth W^_depth + b_depth
//! column i of W^ = column i of W * min(1, softplus(c) / sum |column i of W|)
//! ```
//!
//! each layer, the last included, with a `c` of its own (columns are the source's rows: inputs stand on the
//! left here). In the maximum norm no layer stretches by more than its `softplus(c)`, nor does `f` by more
//! than their product, and that product is a term of the objective:
//!
//! ```text
//! distances   mean (f - d)^2 at t = 0, 1, on the surfaces (d = 0) and in space     weight 1
//! lipschitz   prod softplus(c)                                                     weight 1e-6
//! ```
//!
//! `c` starts where `softplus(c)` is the largest sum of its layer: nothing is scaled at first, and nothing
//! is given away.
//!
//! **Space is pre-scaled** by `space_scale`, `s`: the bound is on `f` as a function of `(s x, t)`, so
//! `|f(x, t) - f(y, u)| <= prod softplus(c) max(s |x - y|, |t - u|)`. `f` is in units of distance, not of `s`:
//! in `s x` its slope is `1 / s`, far below what it needs in time, so the bound acts on time alone.
//!
//! # Differs from the source
//! The weights of the first layer are those of the unscaled `x`; their share of the sums is divided by `s`.
//! The functions, the bounds and the objective are the same, and an optimiser's step on them has the
//! size that it has elsewhere. Liu et al. add the squared errors of the two ends; here they are averaged.

use std::f64::consts::LN_2;

use burn::module::{Module, Param, ParamId};
use burn::tensor::backend::Backend;
use burn::tensor::{Tensor, TensorData};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Normal, Uniform};

use crate::autodiff::{Activation, ModelBackend, product};
use crate::flow::Geometry;
use crate::flow::end_terms::EndSamples;
use crate::objective::Objective;

/// Standard deviation of the first layer's weights for the position, in radians per normalised unit.
const BANDWIDTH: f64 = 4.0;

/// The output layer's share of its usual initial size.
const OUTPUT: f64 = 0.1;

/// The shape of a [`LipMlp`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LipMlpConfig {
    /// Hidden layers; the source has 5.
    pub depth: usize,
    /// Columns of each hidden layer; the source has 256.
    pub width: usize,
    /// What positions are multiplied by, as far as the bound is concerned; the source has 100.
    pub space_scale: f64,
}

impl LipMlpConfig {
    /// A network of random weights, the same on every backend for one seed.
    ///
    /// Weights are normal with deviation `1 / sqrt(inputs)`, those for the position with deviation 4, the
    /// output layer's a tenth of it: `f` starts near 0. The first layer's biases are uniform in `[-2, 2]`, so
    /// that its units divide the whole box; the others are 0.
    pub fn init<B: ModelBackend>(&self, seed: u64, device: &B::Device) -> LipMlp<B> {
        let rng = &mut ChaCha8Rng::seed_from_u64(seed);
        let layers = (0..=self.depth).map(|k| {
            let inputs = if k == 0 { 4 } else { self.width };
            let outputs = if k == self.depth { 1 } else { self.width };
            let share = if k == self.depth { OUTPUT } else { 1.0 };
            let deviation = share / (inputs as f64).sqrt();
            let normal = Normal::new(0.0, deviation).expect("the deviation is above 0");
            let drawn = normal.sample_iter(&mut *rng).take(inputs * outputs);
            let mut weight: Vec<f64> = drawn.collect();
            let mut bias = vec![0.0; outputs];
            if k == 0 {
                let position = weight[..3 * outputs].iter_mut();
                position.for_each(|w| *w *= BANDWIDTH / deviation);
                let half = BANDWIDTH / 2.0;
                let uniform = Uniform::new_inclusive(-half, half).expect("the limits are in order");
                bias = uniform.sample_iter(&mut *rng).take(outputs).collect();
            }
            let scale = if k == 0 { self.space_scale } else { 1.0 };
            let shape = [inputs, outputs];
            LipschitzLayer::new(3 * k as u64 + 1, shape, weight, bias, scale, device)
        });
        LipMlp {
            layers: layers.collect(),
            space_scale: self.space_scale,
        }
    }
}

/// An affine layer that stretches by `softplus(c)` at most.
#[derive(Module, Debug)]
struct LipschitzLayer<B: Backend> {
    /// `[inputs, outputs]`.
    weight: Param<Tensor<B, 2>>,
    /// `[1, outputs]`.
    bias: Param<Tensor<B, 2>>,
    /// `c`, `[1, 1]`.
    c: Param<Tensor<B, 2>>,
}

impl<B: ModelBackend> LipschitzLayer<B> {
    /// With parameters numbered from `first`, and `c` where nothing is scaled.
    fn new(
        first: u64,
        shape: [usize; 2],
        weight: Vec<f64>,
        bias: Vec<f64>,
        space_scale: f64,
        device: &B::Device,
    ) -> Self {
        let parameter = |id: u64, values: Vec<f64>, shape: [usize; 2]| {
            let tensor = Tensor::from_data(TensorData::new(values, shape), device);
            Param::initialized(ParamId::from(id), tensor.require_grad())
        };
        let sum = |column: usize| -> f64 {
            let weights = weight.iter().skip(column).step_by(shape[1]).enumerate();
            let share = |(row, w): (usize, &f64)| w.abs() / if row < 3 { space_scale } else { 1.0 };
            weights.map(share).sum()
        };
        let largest = (0..shape[1]).map(sum).fold(0.0, f64::max);
        Self {
            c: parameter(first + 2, vec![inverse_softplus(largest)], [1, 1]),
            bias: parameter(first + 1, bias, [1, shape[1]]),
            weight: parameter(first, weight, shape),
        }
    }

    /// `softplus(c)`, `[1, 1]`.
    fn bound(&self) -> Tensor<B, 2> {
        Activation::Softplus { beta: 1.0 }.value(self.c.val())
    }

    /// `W^`; the first three inputs count `1 / space_scale`.
    fn bounded(&self, space_scale: f64) -> Tensor<B, 2> {
        let weight = self.weight.val();
        let [inputs, outputs] = weight.dims();
        let sizes = weight.clone().abs();
        let position = sizes
            .clone()
            .slice([0..3.min(inputs), 0..outputs])
            .sum_dim(0);
        let sums = if inputs > 3 {
            position / space_scale + sizes.slice([3..inputs, 0..outputs]).sum_dim(0)
        } else {
            position / space_scale
        };
        // A column of zeros stays one.
        weight * (self.bound() / (sums + 1e-12)).clamp_max(1.0)
    }

    /// `[n, inputs]` to `[n, outputs]`.
    fn forward(&self, input: Tensor<B, 2>, space_scale: f64) -> Tensor<B, 2> {
        product(input, self.bounded(space_scale)) + self.bias.val()
    }
}

/// The `c` with `softplus(c) = bound`, for a bound above 0: `bound + log(1 - exp(-bound))`.
fn inverse_softplus(bound: f64) -> f64 {
    if bound < LN_2 {
        bound.exp_m1().ln()
    } else {
        bound + (-(-bound).exp()).ln_1p()
    }
}

/// The network `f(x, t)` with a bounded slope.
#[derive(Module, Debug)]
pub struct LipMlp<B: Backend> {
    layers: Vec<LipschitzLayer<B>>,
    space_scale: f64,
}

impl<B: ModelBackend> LipMlp<B> {
    /// `f(x, t)`.
    ///
    /// # Shapes
    /// `x`: `[n, 3]`, normalised; `t`: `[n, 1]`, in `[0, 1]`; result `[n, 1]`, normalised distance.
    pub fn forward(&self, x: Tensor<B, 2>, t: Tensor<B, 2>) -> Tensor<B, 2> {
        let mut hidden = Tensor::cat(vec![x, t], 1);
        for (k, layer) in self.layers.iter().enumerate() {
            if k > 0 {
                hidden = hidden.tanh();
            }
            hidden = layer.forward(hidden, if k == 0 { self.space_scale } else { 1.0 });
        }
        hidden
    }

    /// `prod softplus(c)`, `[1]`: the bound on the slope in `(space_scale x, t)`, in the maximum norm.
    pub fn bound(&self) -> Tensor<B, 1> {
        let bounds = self.layers.iter().map(LipschitzLayer::bound);
        bounds
            .reduce(|product, bound| product * bound)
            .expect("there is an output layer")
            .reshape([1])
    }

    /// The terms "distances", of weight 1, and "lipschitz", of weight `lipschitz`; the source's is 1e-6.
    ///
    /// # Panics
    /// If the samples have no distances.
    pub fn objective(&self, samples: &EndSamples<B>, lipschitz: f64) -> Objective<B> {
        let mut objective = Objective::new();
        objective.add("distances", 1.0, || {
            let Some(in_space) = samples.distances.clone() else {
                panic!("LipMlp: the samples have no distances, which it is trained on");
            };
            let [on_surface, _] = samples.surface.dims();
            let zeros = Tensor::zeros([on_surface, 1], &in_space.device());
            let (x, t) = samples.all();
            let off = self.forward(x, t) - Tensor::cat(vec![zeros, in_space], 0);
            (off.clone() * off).mean()
        });
        objective.add("lipschitz", lipschitz, || self.bound());
        objective
    }
}

impl<B: ModelBackend> Geometry<B> for LipMlp<B> {
    fn value(&self, x: Tensor<B, 2>, t: Tensor<B, 2>) -> Tensor<B, 2> {
        self.forward(x, t)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::learning::{check_gradients, directions, radius, spheres, trained};
    use crate::testing::{Plain, Train, column, host, points, shaken};

    fn config(depth: usize, width: usize) -> LipMlpConfig {
        LipMlpConfig {
            depth,
            width,
            space_scale: 100.0,
        }
    }

    #[test]
    fn nothing_is_scaled_at_first_and_no_bound_is_wider_than_its_layer_needs() {
        let net: LipMlp<Plain> = config(3, 32).init(1, &Default::default());
        for (k, layer) in net.layers.iter().enumerate() {
            let scale = if k == 0 { 100.0 } else { 1.0 };
            let (weight, bounded) = (host(layer.weight.val()), host(layer.bounded(scale)));
            let outputs = layer.weight.dims()[1];
            let sums: Vec<f64> = (0..outputs)
                .map(|column| {
                    let each = weight.iter().skip(column).step_by(outputs).enumerate();
                    each.map(|(row, w)| w.abs() / if k == 0 && row < 3 { scale } else { 1.0 })
                        .sum()
                })
                .collect();
            let largest = sums.into_iter().fold(0.0, f64::max);
            let bound = host(layer.bound())[0];
            // f32 rounding of sums of up to 32 numbers.
            assert!((bound / largest - 1.0).abs() < 1e-5, "{bound}, {largest}");
            for (w, b) in weight.iter().zip(&bounded) {
                assert!((w - b).abs() <= 1e-5 * w.abs(), "layer {k}: {w} became {b}");
            }
        }
    }

    /// The largest difference quotient of `f` in time, over positions and pairs of times.
    fn steepest(net: &LipMlp<Plain>) -> f64 {
        let mut steepest = 0.0f64;
        for (a, b) in (0..40).map(|k| (0.025 * k as f64, 0.025 * (k + 1) as f64)) {
            for radius in [0.1, 0.3, 0.6] {
                let x: Vec<_> = directions(32)
                    .iter()
                    .map(|d| d.map(|c| c * radius))
                    .collect();
                let at = |t: f64| host(net.forward(points(&x), column(&[t; 32])));
                let quotients = at(b)
                    .into_iter()
                    .zip(at(a))
                    .map(|(p, q)| (p - q).abs() / (b - a));
                steepest = quotients.fold(steepest, f64::max);
            }
        }
        steepest
    }

    /// Lowers every `c`, so that the layers are scaled.
    fn tightened(mut net: LipMlp<Plain>, by: f64) -> LipMlp<Plain> {
        for layer in &mut net.layers {
            layer.c = layer.c.clone().map(|c| c - by);
        }
        net
    }

    #[test]
    fn the_slope_in_time_stays_below_the_bound_and_one_unit_nearly_attains_it() {
        for seed in 0..4 {
            for (depth, width) in [(1, 1), (1, 24), (4, 24)] {
                let net = config(depth, width).init(seed, &Default::default());
                let net = tightened(shaken(net, 0.1), 0.5);
                let (slope, bound) = (steepest(&net), host(net.bound())[0]);
                // f32 rounding of values of size 1 over steps of 0.025.
                assert!(slope <= bound + 1e-5, "{depth} x {width}: {slope}, {bound}");
            }
        }
        // One unit without bias: tanh' is 1 at the origin, and only the position's share is lost.
        let mut net: LipMlp<Plain> = config(1, 1).init(2, &Default::default());
        let first = &mut net.layers[0];
        first.weight = first.weight.clone().map(|_| column(&[0.1, -0.1, 0.1, 0.8]));
        first.bias = first.bias.clone().map(|bias| bias * 0.0);
        let net = tightened(net, 1.0);
        let (slope, bound) = (steepest(&net), host(net.bound())[0]);
        // Within 2 %: 0.3 / 100 of the sum belongs to the position, and tanh' falls along the first step.
        assert!(
            slope > 0.98 * bound && slope <= bound + 1e-5,
            "{slope}, {bound}"
        );
    }

    #[test]
    fn the_gradient_of_every_term_reaches_the_weights() {
        let net: LipMlp<Train> = config(2, 8).init(3, &Default::default());
        let samples = spheres(16, [0.3, 0.45]);
        check_gradients(&shaken(net, 0.1), |net: &LipMlp<Train>| {
            net.objective(&samples, 1e-6)
        });
    }

    #[test]
    #[should_panic(expected = "LipMlp: the samples have no distances")]
    fn samples_without_distances_are_refused() {
        let net: LipMlp<Plain> = config(1, 4).init(3, &Default::default());
        let mut samples = spheres(4, [0.3, 0.45]);
        samples.distances = None;
        net.objective(&samples, 1e-6);
    }

    #[test]
    fn between_two_spheres_it_learns_both_and_one_between() {
        let net: LipMlp<Train> = config(2, 32).init(3, &Default::default());
        let samples = spheres(256, [0.3, 0.45]);
        let net = trained(net, 200, 5e-3, |net| net.objective(&samples, 1e-6));
        let got = [0.0, 0.5, 1.0].map(|t| radius(&net, t));
        // A tenth of the distance between the ends: the training is short.
        assert!((got[0] - 0.3).abs() < 0.015, "{got:?}");
        assert!((got[2] - 0.45).abs() < 0.015, "{got:?}");
        assert!(got[1] > 0.32 && got[1] < 0.43, "{got:?}");
    }
}
